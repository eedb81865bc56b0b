import type { LightmapLight, LumelRegion } from '../api.js';
import type { FieldInfo } from '../codec/catalog.js';
import type { LightmapLayout } from '../codec/layout.js';
import { isVideo, type Tile, tileOf } from '../codec/lightmap-shape.js';
import { WireError } from '../wire-error.js';
import type { AgeOf, Arrival, FieldCache, Received, Surroundings } from './field.js';
import { HalvesTile } from './halves-tile.js';
import type { TileCache } from './tile.js';
import { VideoTile } from './video-tile.js';

/**
 * The light of a lightmap: the pictures of its regions, each with a passage of its own, and the layout by
 * which they are read. Regions of which no frame has come take no memory.
 */
export class LightmapCache implements FieldCache {
  private readonly tiles = new Map<number, TileCache>();
  /** The last layout that was known: it stands until another one is. */
  private layout: LightmapLayout | undefined;

  constructor(
    public field: FieldInfo<'lightmap'>,
    private readonly surroundings: Surroundings,
  ) {}

  has(region: number): boolean {
    const { shape } = this.field;
    const isDecoded = !isVideo(shape.coding) || this.surroundings.openDecoder !== undefined;
    return isDecoded && tileOf(shape, region) !== undefined;
  }

  get lit(): boolean {
    return [...this.tiles.values()].some(({ lit }) => lit);
  }

  forgetUpdates(): void {
    for (const tile of this.tiles.values()) tile.forgetUpdates();
  }

  add(region: number, layer: number, frame: Uint8Array, now: number, tickSeconds: number): Received {
    const place = tileOf(this.field.shape, region);
    if (!place) throw new RangeError(`field ${this.field.id} has no region ${region}`);
    if (layer !== 0) throw new WireError('malformed', `layer ${layer} of a lightmap, which has one`);
    const tile = this.tiles.get(region) ?? this.tileCache(region, place);
    const received = tile.add(frame, now, tickSeconds);
    this.tiles.set(region, tile);
    return received;
  }

  private tileCache(region: number, place: Tile): TileCache {
    const { coding, pageSize } = this.field.shape;
    const { onLight, onLate, openDecoder } = this.surroundings;
    if (!isVideo(coding)) return new HalvesTile(region, place, onLight);
    if (!openDecoder) throw new RangeError(`field ${this.field.id} is video, which nobody decodes`);
    return new VideoTile(region, place, () => openDecoder({ coding, pageSize }), onLight, onLate);
  }

  span(): { oldest: Arrival; newest: Arrival } | undefined {
    const arrivals = [...this.tiles.values()].map(({ newest }) => newest).filter((one) => one !== undefined);
    if (arrivals.length === 0) return undefined;
    arrivals.sort((a, b) => a.head.tick - b.head.tick);
    return { oldest: arrivals[0], newest: arrivals[arrivals.length - 1] };
  }

  light(now: number, ageOf: AgeOf): LightmapLight | undefined {
    this.keepResources();
    const regions: LumelRegion[] = [];
    for (const tile of this.tiles.values()) {
      const region = tile.at(now);
      if (region) regions.push(region);
    }
    const scales = regions.filter(({ slopes }) => !slopes).map(({ picture }) => picture.scale);
    if (scales.length === 0) return undefined;
    const oldest = this.span()?.oldest;
    return {
      kind: 'lightmap',
      field: this.field,
      layout: this.layout,
      regions,
      scale: Math.max(...scales),
      age: oldest && ageOf(oldest.head.tick, oldest.arrived),
      sceneVersion: oldest?.head.sceneVersion,
      tick: oldest?.head.tick,
    };
  }

  keepResources(): void {
    this.layout = this.surroundings.layoutOf(this.field.shape) ?? this.layout;
  }

  close(): void {
    for (const tile of this.tiles.values()) tile.close();
  }
}
