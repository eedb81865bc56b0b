import {
  connect,
  type ConnectOptions as SessionOptions,
  fetchLight,
  openLight,
  type Session,
} from '@lumencast/client';
import type { Mesh, Scene } from 'three';
import type { GLTF } from 'three/addons/loaders/GLTFLoader.js';
import { loadGltf } from './content.js';
import { sceneFile } from './files.js';
import { joined, reportLosses } from './joining.js';
import { type AttachOptions, LumencastLight, type SceneEvent, warnInConsole } from './light.js';
import { type NamedNode, readNames } from './names.js';
import type { Platform } from './platform.js';

interface LoadOptions extends AttachOptions {
  /** Progress of loading the scene's file: bytes so far and, where known, of all. */
  onProgress?: (loaded: number, total: number | undefined) => void;
}

export interface ConnectOptions extends LoadOptions {
  /** Options of the connection itself. */
  session?: SessionOptions;
}

export interface ShowOptions extends LoadOptions {
  /** Address of the scene's glTF file; what the light file names, beside it, unless given. */
  file?: string | URL;
}

export async function connectWith(
  platform: Platform,
  url: string,
  options: ConnectOptions,
): Promise<LumencastLight> {
  const session = connect(url, options.session);
  const missed = record(session);
  try {
    // Saved light knows its scene without a server.
    if (isToLoad(options) && !session.catalog) await joined(session);
    reportLosses(session, options.onWarning ?? warnInConsole);
    const gltf = await sceneOf(session, options);
    const names = gltf ? undefined : namesOn(session);
    return new LumencastLight(session, platform, { ...options, gltf }, missed(), names);
  } catch (error) {
    session.close();
    throw error;
  }
}

export async function showWith(
  platform: Platform,
  light: string | URL | Uint8Array,
  options: ShowOptions,
): Promise<LumencastLight> {
  const page = globalThis.document?.baseURI;
  const address = light instanceof Uint8Array ? page : new URL(light, page).href;
  const file = options.file === undefined ? undefined : new URL(options.file, page).href;
  const files = file ?? address;
  const bytes = light instanceof Uint8Array ? light : await fetchLight(light);
  const session = openLight(bytes, files === undefined ? {} : { files });
  const gltf = await sceneOf(session, options, file);
  return new LumencastLight(session, platform, { ...options, gltf });
}

/** The names of the server's nodes, by which a page's own scene is matched with them. */
async function namesOn(session: Session): Promise<readonly NamedNode[]> {
  await session.ready;
  return readNames(sceneFile(session, session.catalog!.scene.root));
}

/** Whether the scene shows nothing yet. */
function isToLoad({ scene, gltf }: AttachOptions): boolean {
  return !gltf && !hasMesh(scene);
}

/** The scene's file, which is loaded into a scene that shows nothing. */
async function sceneOf(session: Session, options: LoadOptions, file?: string): Promise<GLTF | undefined> {
  if (!isToLoad(options)) return options.gltf;
  const gltf = await loadGltf(file ?? sceneFile(session, session.catalog!.scene.root), options.onProgress);
  options.scene.add(gltf.scene);
  return gltf;
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
