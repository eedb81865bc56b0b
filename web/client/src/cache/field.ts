import type { VolumeLight } from '../api.js';
import type { FieldInfo } from '../codec/catalog.js';
import { type ProbeHeader, splitProbeFrame } from '../codec/probe-header.js';
import { ProbeDecoder } from '../codec/probes.js';
import { cellCount, type Region, valuesPerProbe } from '../codec/volume-shape.js';

/** Seconds that a change takes to show at most, however long the silence before it was. */
const LONGEST_BLEND = 0.5;

/** A frame that came. */
export interface Arrival {
  readonly header: ProbeHeader;
  readonly arrived: number;
}

/** The newest light of a region and what is shown on the way there. */
interface RegionState {
  readonly region: Region;
  decoder: ProbeDecoder;
  /** Head of the newest frame; `undefined` before there is one in this epoch. */
  header: ProbeHeader | undefined;
  /** What was shown when the newest frame came; `undefined` when nothing was. */
  from: Float32Array | undefined;
  /** The newest frame's light. */
  to: Float32Array | undefined;
  /** Scale of the newest frame. */
  scale: number;
  /** When it came. */
  arrived: number;
  /** Seconds between it and the one before: how long the blend takes. */
  interval: number;
  /** Weight of `to` in what `shown` holds; −1 when it holds neither. */
  shown: number;
}

/**
 * The light of one field: decodes its regions and blends each from what was shown when its newest
 * update came to that update, over the time that lay between the last two. So the light never jumps,
 * is late by one interval, and stands still when an update is overdue.
 */
export class FieldCache {
  private readonly regions = new Map<number, RegionState>();
  private readonly coefficients: Float32Array;
  private revision = 0;

  constructor(
    /** What the newest catalog says of it. */
    public field: FieldInfo<'volume'>,
    private readonly tickSeconds: number,
  ) {
    const { grid, order, regions } = field.shape;
    this.coefficients = new Float32Array(cellCount(grid.resolution) * valuesPerProbe(order));
    for (const region of regions) {
      this.regions.set(region.id, {
        region,
        decoder: new ProbeDecoder(region.size, order),
        header: undefined,
        from: undefined,
        to: undefined,
        scale: 1,
        arrived: 0,
        interval: 0,
        shown: -1,
      });
    }
  }

  has(region: number): boolean {
    return this.regions.has(region);
  }

  /** Whether any region has light. */
  get lit(): boolean {
    return [...this.regions.values()].some(({ to }) => to !== undefined);
  }

  /** Forgets updates, which are numbered anew after a restart of the server; what is shown stays. */
  forgetUpdates(): void {
    for (const state of this.regions.values()) {
      state.decoder = new ProbeDecoder(state.region.size, this.field.shape.order);
      state.header = undefined;
    }
  }

  /**
   * Takes in a frame of a region that this field has. Returns its head, and whether it is news: an
   * update older than the newest only serves later deltas as their base.
   * @throws WireError; nothing has changed then.
   */
  add(region: number, frame: Uint8Array, now: number): { header: ProbeHeader; news: boolean } {
    const state = this.regions.get(region);
    if (!state) throw new RangeError(`field ${this.field.id} has no region ${region}`);
    const { header } = splitProbeFrame(frame);
    const before = state.header;
    const news = !before || header.update > before.update;
    // As when a group is sent again from its beginning, to a reader who had it.
    if (!news && !state.decoder.lacks(header.update)) return { header, news };
    const { coefficients } = state.decoder.decode(frame);
    if (!news) return { header, news };
    if (state.to) {
      // Frames that come in a burst blend over the time in which they were made.
      const made = before ? (header.tick - before.tick) * this.tickSeconds : 0;
      const from = state.from ?? new Float32Array(coefficients.length);
      blend(state.from ?? state.to, state.to, weight(state, now), from);
      state.from = from;
      state.interval = Math.min(Math.max(now - state.arrived, made), LONGEST_BLEND);
    }
    state.to = coefficients;
    state.header = header;
    state.scale = header.scale;
    state.arrived = now;
    state.shown = -1;
    return { header, news };
  }

  /** Of the regions' newest frames the oldest and the newest: their heads, and when they came. */
  span(): { oldest: Arrival; newest: Arrival } | undefined {
    let oldest: Arrival | undefined;
    let newest: Arrival | undefined;
    for (const { header, arrived } of this.regions.values()) {
      if (!header) continue;
      if (!oldest || header.tick < oldest.header.tick) oldest = { header, arrived };
      if (!newest || header.tick > newest.header.tick) newest = { header, arrived };
    }
    return oldest && newest && { oldest, newest };
  }

  /** The light at `now`; `undefined` when no region has any. `ageOf` tells the age of a tick's light. */
  light(now: number, ageOf: (tick: number, arrived: number) => number | undefined): VolumeLight | undefined {
    let lit = 0;
    let scale = 0;
    let changed = false;
    for (const state of this.regions.values()) {
      if (!state.to) continue;
      lit++;
      scale = Math.max(scale, state.scale);
      changed = this.show(state, weight(state, now)) || changed;
    }
    if (lit === 0) return undefined;
    if (changed) this.revision++;
    const oldest = this.span()?.oldest;
    return {
      kind: 'volume',
      field: this.field,
      coefficients: this.coefficients,
      scale,
      revision: this.revision,
      age: oldest && ageOf(oldest.header.tick, oldest.arrived),
      sceneVersion: oldest?.header.sceneVersion,
      tick: oldest?.header.tick,
      regions: { lit, all: this.regions.size },
    };
  }

  /** Writes a region's blend into the field's coefficients, unless it stands there already. */
  private show(state: RegionState, w: number): boolean {
    if (!state.to || state.shown === w) return false;
    state.shown = w;
    const { min, size } = state.region;
    const { grid, order } = this.field.shape;
    const [width, height] = grid.resolution;
    const n = valuesPerProbe(order);
    const row = size[0] * n;
    const from = state.from ?? state.to;
    for (let z = 0; z < size[2]; z++) {
      for (let y = 0; y < size[1]; y++) {
        const source = (z * size[1] + y) * row;
        const target = (((min[2] + z) * height + min[1] + y) * width + min[0]) * n;
        blend(
          from.subarray(source, source + row),
          state.to.subarray(source, source + row),
          w,
          this.coefficients.subarray(target, target + row),
        );
      }
    }
    return true;
  }
}

/** How far a region is on its way to its newest update, 0 to 1. */
function weight(state: RegionState, now: number): number {
  if (!state.from || !(state.interval > 0)) return 1;
  return Math.min(1, Math.max(0, (now - state.arrived) / state.interval));
}

/** `out` = `from` + `w` · (`to` − `from`); `out` may be `from`. */
function blend(from: Float32Array, to: Float32Array, w: number, out: Float32Array): void {
  if (w >= 1) out.set(to);
  else for (let i = 0; i < out.length; i++) out[i] = from[i] + w * (to[i] - from[i]);
}
