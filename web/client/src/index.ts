export * from './api.js';
export { type AtlasLayout, atlasLayout, halfBits, packAtlas } from './atlas.js';
export {
  type Catalog,
  type Field,
  type Grid,
  parseCatalog,
  type Region,
  valuesPerProbe,
  WIRE_VERSION,
} from './codec/catalog.js';
export type * from './edit.js';
export { WireError, type WireErrorKind } from './wire-error.js';
