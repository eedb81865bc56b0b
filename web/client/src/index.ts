/**
 * Receives the indirect light of a Lumencast server and blends it in time.
 *
 * ```ts
 * const session = connect('https://localhost:4443/sponza');
 * session.on('edit', ({ edit }) => apply(edit));
 * await session.edit({ edit: 'set_light', node: 7, intensity: 800 });
 * const { fields, age } = session.light();
 * const volumes = fields.filter(isVolume);
 * ```
 */
export * from './api.js';
export { type AtlasLayout, atlasLayout, halfBits, packAtlas } from './atlas.js';
export { Cache, type CacheEvent, type CacheOptions } from './cache.js';
export { capabilities, type Capabilities } from './capabilities.js';
export type { Received } from './cache/field.js';
export type { OpenDecoder, PictureDecoder, VideoFormat } from './cache/picture-decoder.js';
export {
  type Catalog,
  epochOf,
  type FieldHead,
  type FieldInfo,
  type FieldKind,
  hasMorePages,
  hasSameShape,
  isLightmap,
  isVolume,
  parseCatalog,
  type Shapes,
  type UnknownField,
  WIRE_VERSION,
} from './codec/catalog.js';
export type { Charts } from './codec/charts.js';
export { type LightFile, readLightFile } from './codec/file.js';
export type { LightmapLayout, LightmapSurface, Rectangle } from './codec/layout.js';
export {
  type Coding,
  isVideo,
  type LightmapShape,
  lumelCount,
  type Tile,
  tileCount,
  tileOf,
  type VideoCoding,
} from './codec/lightmap-shape.js';
export type { FrameHead, LightHead } from './codec/frame-head.js';
export type { ProbeHeader } from './codec/probe-header.js';
export { ProbeDecoder, type RegionLight } from './codec/probes.js';
export { parseState, type StateFrame } from './codec/state.js';
export {
  type Grid,
  type Offset,
  type Region,
  valuesPerProbe,
  type VolumeShape,
} from './codec/volume-shape.js';
export type * from './edit.js';
export { irradianceOf } from './picture.js';
export { LONGEST_PASSAGE } from './cache/passage.js';
export { slopeOf, STEEPEST } from './slopes.js';
export { fetchLight, openLight, type SavedOptions } from './saved.js';
export { connect, type ConnectOptions } from './session.js';
export type { Connector, Link, ReadOptions, Target, TrackReader } from './transport.js';
export { WireError, type WireErrorKind } from './wire-error.js';
