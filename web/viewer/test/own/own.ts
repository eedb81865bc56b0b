/** A page that somebody else might write, from which a test connects. */
import { connect, type ConnectOptions } from '@lumencast/three';
import { PerspectiveCamera, Scene, WebGLRenderer } from 'three';

/** What came of connecting. */
export interface Outcome {
  /** What was thrown, if anything. */
  readonly problem?: string;
  readonly message?: string;
  readonly transport?: string;
  /** Objects that the server's file brought. */
  readonly objects: number;
  /** Whether light came. */
  readonly isLit: boolean;
}

const renderer = new WebGLRenderer();

async function own(address: string, session: ConnectOptions['session'] = {}): Promise<Outcome> {
  const scene = new Scene();
  try {
    const light = await connect(address, { scene, renderer, session });
    const camera = new PerspectiveCamera();
    for (let tries = 0; tries < 200 && light.lightRevision === 0; tries++) {
      light.update(camera);
      await new Promise((resolve) => setTimeout(resolve, 50));
    }
    const { status } = light.session;
    const outcome = {
      ...(status.state === 'connected' && { transport: status.transport }),
      objects: light.content.cameras.length + [...scene.children].length,
      isLit: light.lightRevision > 0,
    };
    light.dispose();
    return outcome;
  } catch (error) {
    const { message, problem } = error as Error & { problem?: string };
    return { message, ...(problem && { problem }), objects: scene.children.length, isLit: false };
  }
}

declare global {
  interface Window {
    own?: typeof own;
  }
}
window.own = own;
