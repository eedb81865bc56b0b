/** The caches of fields: a table of their kinds. */
import type { FieldInfo, FieldKind } from '../codec/catalog.js';
import type { FieldCache, Surroundings } from './field.js';
import { LightmapCache } from './lightmap.js';
import { VolumeCache } from './volume.js';

const CACHES: {
  readonly [K in FieldKind]: (field: FieldInfo<K>, surroundings: Surroundings) => FieldCache;
} = {
  volume: (field, { onLight }) => new VolumeCache(field, onLight),
  lightmap: (field, surroundings) => new LightmapCache(field, surroundings),
};

/** A cache of a field's kind, without light. */
export function createFieldCache<K extends FieldKind>(
  field: FieldInfo<K>,
  surroundings: Surroundings,
): FieldCache {
  return CACHES[field.kind](field, surroundings);
}
