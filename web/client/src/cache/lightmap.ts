import type { LightmapLight } from '../api.js';
import type { FieldInfo } from '../codec/catalog.js';
import { tileOf } from '../codec/lightmap-shape.js';
import { WireError } from '../wire-error.js';
import type { FieldCache } from './field.js';

/** The light of a lightmap, of which no coding is read yet. */
export class LightmapCache implements FieldCache {
  readonly lit = false;

  constructor(public field: FieldInfo<'lightmap'>) {}

  has(region: number): boolean {
    return tileOf(this.field.shape, region) !== undefined;
  }

  forgetUpdates(): void {}

  add(): never {
    throw new WireError('version', `lumels coded as ${this.field.shape.coding}`);
  }

  span(): undefined {
    return undefined;
  }

  light(): LightmapLight | undefined {
    return undefined;
  }
}
