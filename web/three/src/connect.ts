import { connect, type ConnectOptions as SessionOptions, type Session } from '@lumencast/client';
import type { Mesh, Scene } from 'three';
import { loadGltf } from './content.js';
import { joined, reportLosses } from './joining.js';
import { type AttachOptions, LumencastLight, type SceneEvent, sceneFile, warnInConsole } from './light.js';
import type { Platform } from './platform.js';

export interface ConnectOptions extends AttachOptions {
  /** Options of the connection itself. */
  session?: SessionOptions;
  /** Progress of loading the scene's file: bytes so far and, where known, of all. */
  onProgress?: (loaded: number, total: number | undefined) => void;
}

export async function connectWith(
  platform: Platform,
  url: string,
  options: ConnectOptions,
): Promise<LumencastLight> {
  const { scene, onProgress, onWarning = warnInConsole } = options;
  const session = connect(url, options.session);
  const missed = record(session);
  try {
    let { gltf } = options;
    const isEmpty = !gltf && !hasMesh(scene);
    // A saved light field knows its scene without a server.
    if (isEmpty && !session.catalog) await joined(session);
    reportLosses(session, onWarning);
    if (isEmpty) {
      gltf = await loadGltf(sceneFile(session, session.catalog!.scene.root), onProgress);
      scene.add(gltf.scene);
    }
    return new LumencastLight(session, platform, { ...options, gltf }, missed());
  } catch (error) {
    session.close();
    throw error;
  }
}

/** Keeps what the session tells of the scene while its file is loading. */
function record(session: Session): () => readonly SceneEvent[] {
  let events: SceneEvent[] = [];
  const stop = [
    session.on('snapshot', (edits) => (events = [{ snapshot: edits }])),
    session.on('edit', (accepted) => events.push({ accepted })),
  ];
  return () => {
    for (const off of stop) off();
    return events;
  };
}

function hasMesh(scene: Scene): boolean {
  let found = false;
  scene.traverse((object) => (found ||= (object as Mesh).isMesh === true));
  return found;
}
