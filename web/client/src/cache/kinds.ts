/** The caches of fields: a table of their kinds. */
import type { FieldInfo, FieldKind } from '../codec/catalog.js';
import type { FieldCache, OnLight } from './field.js';
import { LightmapCache } from './lightmap.js';
import { VolumeCache } from './volume.js';

const CACHES: {
  readonly [K in FieldKind]: (field: FieldInfo<K>, onLight: OnLight) => FieldCache;
} = {
  volume: (field, onLight) => new VolumeCache(field, onLight),
  lightmap: (field) => new LightmapCache(field),
};

/** A cache of a field's kind, without light. */
export function createFieldCache<K extends FieldKind>(field: FieldInfo<K>, onLight: OnLight): FieldCache {
  return CACHES[field.kind](field, onLight);
}
