/**
 * Lights a three.js scene, drawn by WebGLRenderer, with the indirect light of a Lumencast server. For
 * WebGPURenderer import the same names from `@lumencast/three/webgpu`.
 *
 * ```ts
 * const light = await connect('http://localhost:4443/sponza', { scene, renderer });
 * light.follow(lamp); // this page moves it; the server and everyone else follow
 * renderer.setAnimationLoop(() => { light.update(camera); renderer.render(scene, camera); });
 * ```
 */
import type { WebGLRenderer } from 'three';
import { type ConnectOptions, connectWith, type ShowOptions, showWith } from './connect.js';
import { type AttachOptions, LumencastLight } from './light.js';
import type { LightSession } from './light-session.js';
import { webglPlatform } from './webgl.js';

export * from './common.js';

/**
 * Connects to the light of a scene. Without `gltf`, and when the scene shows nothing yet, the server's
 * scene file is loaded and added to it. A scene of the program's own is matched with the server's by the
 * names of its objects. With `session: { saved }`, the bytes of a `.light` file, its light shows before
 * the server answers.
 *
 * Connections are tried until one comes about, and again after a loss. `onWarning` hears of each loss,
 * with its reason, and of its end.
 * @param url the server's address with the scene's name as last part of its path
 * @throws ConnectError when there is nothing to show and no connection comes about: after three attempts,
 * or at once where a further one would fail alike. It says what happened and what to do.
 * @throws Error when the scene's file cannot be loaded
 */
export function connect(
  url: string,
  options: ConnectOptions & { renderer: WebGLRenderer },
): Promise<LumencastLight> {
  return connectWith(webglPlatform(options.renderer), url, options);
}

/**
 * Shows saved light, the address or the bytes of a `.light` file, without a server. Without
 * `gltf`, and when the scene shows nothing yet, the scene's file is loaded and added to it.
 * @throws Error, with the address and what was answered, when a file is missing
 */
export function show(
  light: string | URL | Uint8Array,
  options: ShowOptions & { renderer: WebGLRenderer },
): Promise<LumencastLight> {
  return showWith(webglPlatform(options.renderer), light, options);
}

/**
 * As {@link connect}, with a session that was made this moment: what it tells of the scene before is
 * missed.
 */
export function attach(
  session: LightSession,
  options: AttachOptions & { renderer: WebGLRenderer },
): LumencastLight {
  return new LumencastLight(session, webglPlatform(options.renderer), options);
}
