import type { LightState, VolumeLight } from '../../src/api.js';
import { type Catalog, type FieldInfo, isVolume } from '../../src/codec/catalog.js';

/** The light of a state's first volume. */
export function volumeOf({ fields }: LightState): VolumeLight {
  return fields.filter(isVolume)[0];
}

/** What a catalog says of its first volume. */
export function volumeIn({ fields }: Catalog): FieldInfo<'volume'> {
  return fields.filter(isVolume)[0];
}
