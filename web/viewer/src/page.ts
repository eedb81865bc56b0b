import type { Session } from '@lumencast/client';
import { Curtain } from './ui/curtain.js';
import { h } from './ui/dom.js';
import { openViewer, type Viewer } from './viewer.js';
import { Failure } from './words.js';

/** Where the scene and its light come from. */
export interface Source {
  /** The scene, for messages. */
  readonly name: string;
  /** Address of its glTF file. */
  readonly file: string;
  readonly connect: () => Session;
}

declare global {
  interface Window {
    /** For tests and for those who like to look inside. */
    lumencast?: Inside;
  }
}

/** What `window.lumencast` holds. */
export interface Inside extends Pick<Viewer, 'light' | 'scene' | 'renderer' | 'session'> {
  /** Resolves when the first light has been drawn. */
  readonly ready: Promise<void>;
  readonly camera: Viewer['rig']['camera'];
  readonly viewer: Viewer;
  stats(): ReturnType<Viewer['stats']>;
  setMode: Viewer['setMode'];
  pixel: Viewer['pixel'];
  pixels: Viewer['pixels'];
}

/** Builds the page: a curtain with progress, then the picture beside its controls, or why there is none. */
export async function openPage(find: () => Promise<Source>): Promise<void> {
  const canvas = h('canvas', { class: 'view', tabindex: '0' });
  const curtain = new Curtain();
  const stage = h('main', { class: 'stage' }, canvas);
  document.body.replaceChildren(stage, curtain.element);
  try {
    const { name, file, connect } = await find();
    document.title = `${name} · Lumencast`;
    const query = new URLSearchParams(location.search);
    const pixelRatio = Number(query.get('scale')) || undefined;
    const early: string[] = [];
    let warn = (message: string): void => void early.push(message);
    const viewer = await openViewer({
      canvas,
      renderer: query.get('renderer') === 'webgpu' ? 'webgpu' : 'webgl',
      file,
      connect,
      pixelRatio,
      onProgress: (loaded, total) => curtain.progress(name, loaded, total),
      onWarning: (message) => warn(message),
    });
    warn = (message) => viewer.controls.notices.passing(message);
    early.forEach(warn);
    curtain.say('Connecting to the light…');
    stage.append(viewer.controls.overlay);
    stage.after(viewer.controls.bar);
    // Compiling shaders keeps the page busy for so long that WebTransport would lose against a WebSocket.
    if (!viewer.session.catalog) await Promise.race([viewer.session.ready, afterSeconds(4)]);
    curtain.say('Preparing the picture…');
    viewer.start();
    window.lumencast = inside(viewer);
    curtain.lift();
  } catch (error) {
    console.error(error);
    curtain.fail(
      error instanceof Failure ? error : new Failure('The picture cannot be shown.', '', { cause: error }),
    );
  }
}

function inside(viewer: Viewer): Inside {
  const { light, scene, renderer, session, rig } = viewer;
  return {
    light,
    scene,
    renderer,
    session,
    camera: rig.camera,
    viewer,
    ready: firstLight(viewer),
    stats: () => viewer.stats(),
    setMode: (shown) => viewer.setMode(shown),
    pixel: (x, y) => viewer.pixel(x, y),
    pixels: (points, now) => viewer.pixels(points, now),
  };
}

/** Resolves two pictures after the first light. */
function firstLight({ light }: Viewer): Promise<void> {
  return new Promise((resolve) => {
    const look = (): void => {
      if (light.lightRevision === 0) requestAnimationFrame(look);
      else requestAnimationFrame(() => requestAnimationFrame(() => resolve()));
    };
    look();
  });
}

function afterSeconds(seconds: number): Promise<void> {
  return new Promise((resolve) => setTimeout(resolve, seconds * 1000));
}
