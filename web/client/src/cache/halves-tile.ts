import type { LumelRegion } from '../api.js';
import type { Tile } from '../codec/lightmap-shape.js';
import { splitLumelFrame } from '../codec/lumel-header.js';
import { LumelDecoder } from '../codec/lumels.js';
import type { Arrival, OnLight, Received } from './field.js';
import { ShownPicture } from './shown-picture.js';
import type { TileCache } from './tile.js';

/** A tile that is coded as half floats: its decoder, and the passage to its newest light. */
export class HalvesTile implements TileCache {
  newest: Arrival | undefined;
  private decoder: LumelDecoder;
  private readonly shown: ShownPicture;

  constructor(
    private readonly region: number,
    private readonly tile: Tile,
    private readonly onLight: OnLight,
  ) {
    this.decoder = new LumelDecoder(tile.size);
    this.shown = new ShownPicture(region, tile);
  }

  get lit(): boolean {
    return this.shown.lit;
  }

  forgetUpdates(): void {
    this.decoder = new LumelDecoder(this.tile.size);
    this.newest = undefined;
  }

  add(frame: Uint8Array, now: number, tickSeconds: number): Received {
    const { header: head } = splitLumelFrame(frame);
    const before = this.newest?.head;
    // As when a group is sent again from its beginning, to a reader who had it: nothing builds on it.
    if (before && head.update <= before.update) return { head, news: false };
    const { texels, changed } = this.decoder.decode(frame);
    this.newest = { head, arrived: now };
    // On the way to the same light nothing changes.
    if (changed || !before) {
      this.shown.replace({ kind: 'halves', scale: head.scale, texels });
      this.shown.begin(now, before ? (head.tick - before.tick) * tickSeconds : 0);
    }
    this.onLight(this.region, head);
    return { head, news: true };
  }

  at(now: number): LumelRegion | undefined {
    return this.shown.at(now);
  }

  close(): void {}
}
