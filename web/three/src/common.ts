/** What both entry points export. */
export { ConnectError, type Edit, type EditOptions, type Problem } from '@lumencast/client';
export type { ConnectOptions, ShowOptions } from './connect.js';
export { Content, loadGltf } from './content.js';
export { isHidden } from './exported.js';
export type { AttachOptions, LumencastLight, Shown } from './light.js';
export type { LightSession } from './light-session.js';
export { createLight, isPunctualLight, lightSpec, type PunctualLight } from './lights.js';
export type { LumelLook } from './lumel-pages.js';
export type { ProbeGrid } from './platform.js';
export type { ShadowOptions } from './shadows.js';
