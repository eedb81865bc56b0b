import type { VolumeLight } from '../api.js';
import type { FieldInfo } from '../codec/catalog.js';
import { layerOf, type ProbeHeader, splitProbeFrame } from '../codec/probe-header.js';
import { ProbeDecoder } from '../codec/probes.js';
import { cellCount, type Region, valuesPerProbe } from '../codec/volume-shape.js';
import { WireError } from '../wire-error.js';
import type { AgeOf, Arrival, FieldCache, OnLight, Received } from './field.js';
import { Passage } from './passage.js';

/** The newest light of a region and what is shown on the way there. */
interface RegionState {
  readonly region: Region;
  decoder: ProbeDecoder;
  /** Head of the newest frame; `undefined` before there is one in this epoch. */
  head: ProbeHeader | undefined;
  /** What was shown when the newest frame came; `undefined` when nothing was. */
  from: Float32Array | undefined;
  /** The newest frame's light. */
  to: Float32Array | undefined;
  /** Scale of the newest frame. */
  scale: number;
  /** When it came. */
  arrived: number;
  /** From `from` to `to`. */
  readonly passage: Passage;
  /** Weight of `to` in what `shown` holds; −1 when it holds neither. */
  shown: number;
}

/**
 * The light of a volume: decodes its regions and blends each on its {@link Passage} to its newest update.
 * Frames are decoded as they come.
 */
export class VolumeCache implements FieldCache {
  private readonly regions = new Map<number, RegionState>();
  private readonly coefficients: Float32Array;
  private revision = 0;

  constructor(
    public field: FieldInfo<'volume'>,
    private readonly onLight: OnLight,
  ) {
    const { grid, order, regions } = field.shape;
    this.coefficients = new Float32Array(cellCount(grid.resolution) * valuesPerProbe(order));
    for (const region of regions) {
      this.regions.set(region.id, {
        region,
        decoder: new ProbeDecoder(region.size, order),
        head: undefined,
        from: undefined,
        to: undefined,
        scale: 1,
        arrived: 0,
        passage: new Passage(),
        shown: -1,
      });
    }
  }

  has(region: number): boolean {
    return this.regions.has(region);
  }

  get lit(): boolean {
    return [...this.regions.values()].some(({ to }) => to !== undefined);
  }

  forgetUpdates(): void {
    for (const state of this.regions.values()) {
      state.decoder = new ProbeDecoder(state.region.size, this.field.shape.order);
      state.head = undefined;
    }
  }

  add(region: number, layer: number, frame: Uint8Array, now: number, tickSeconds: number): Received {
    const state = this.regions.get(region);
    if (!state) throw new RangeError(`field ${this.field.id} has no region ${region}`);
    const { header: head } = splitProbeFrame(frame);
    if (layerOf(head.update) !== layer) {
      throw new WireError('malformed', `update ${head.update} does not belong to layer ${layer}`);
    }
    const before = state.head;
    const news = !before || head.update > before.update;
    // As when a group is sent again from its beginning, to a reader who had it.
    if (!news && !state.decoder.lacks(head.update)) return { head, news };
    const { coefficients } = state.decoder.decode(frame);
    if (!news) return { head, news };
    if (state.to) {
      const from = state.from ?? new Float32Array(coefficients.length);
      blend(state.from ?? state.to, state.to, state.passage.at(now), from);
      state.from = from;
    }
    state.passage.begin(now, before ? (head.tick - before.tick) * tickSeconds : 0);
    state.to = coefficients;
    state.head = head;
    state.scale = head.scale;
    state.arrived = now;
    state.shown = -1;
    this.onLight(region, head);
    return { head, news };
  }

  span(): { oldest: Arrival; newest: Arrival } | undefined {
    let oldest: Arrival | undefined;
    let newest: Arrival | undefined;
    for (const { head, arrived } of this.regions.values()) {
      if (!head) continue;
      if (!oldest || head.tick < oldest.head.tick) oldest = { head, arrived };
      if (!newest || head.tick > newest.head.tick) newest = { head, arrived };
    }
    return oldest && newest && { oldest, newest };
  }

  light(now: number, ageOf: AgeOf): VolumeLight | undefined {
    let lit = 0;
    let scale = 0;
    let changed = false;
    for (const state of this.regions.values()) {
      if (!state.to) continue;
      lit++;
      scale = Math.max(scale, state.scale);
      changed = this.show(state, state.passage.at(now)) || changed;
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
      age: oldest && ageOf(oldest.head.tick, oldest.arrived),
      sceneVersion: oldest?.head.sceneVersion,
      tick: oldest?.head.tick,
      regions: { lit, all: this.regions.size },
    };
  }

  keepResources(): void {}

  close(): void {}

  /** Writes a region's blend into the volume's coefficients, unless it stands there already. */
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

/** `out` = `from` + `w` · (`to` − `from`); `out` may be `from`. */
function blend(from: Float32Array, to: Float32Array, w: number, out: Float32Array): void {
  if (w >= 1) out.set(to);
  else for (let i = 0; i < out.length; i++) out[i] = from[i] + w * (to[i] - from[i]);
}
