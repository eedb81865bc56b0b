import type { Vec3 } from '../../src/edit.js';
import type { Edit } from '../../src/edit.js';
import { layerOf } from '../../src/codec/probe-header.js';
import { valuesPerProbe } from '../../src/codec/volume-shape.js';
import { type EncodedRegion, encodeProbes } from './probe-encoder.js';

export const TICK = 0.04;
const utf8 = new TextEncoder();

export function json(value: unknown): Uint8Array {
  return utf8.encode(JSON.stringify(value));
}

export interface Options {
  epoch?: string;
  /** The field's own epoch. */
  fieldEpoch?: string;
  /** Number of regions, side by side along x, of 2×2×2 cells each. */
  regions?: number;
  /** The server's clock at its first tick. */
  clock?: number;
  /** Red, green and blue of every c0 at an update. */
  brightness?: (update: number) => number;
}

export interface SentFrame {
  readonly track: string;
  readonly bytes: Uint8Array;
}

const CELLS: Vec3 = [2, 2, 2];
const ORDER = 1;
/** S(−40) = 2⁻¹⁰: how finely light is coded. */
const STEP = -40;

/** A server with one field of uniform light that changes with every tick. */
export class FakeServer {
  tick = -1;
  readonly scene = new Map<number, Edit>();
  private readonly acks: Record<string, number> = {};
  private accepted: { client?: string; seq?: number; edit: Edit }[] = [];
  private refused: { client: string; seq: number; reason: string }[] = [];
  private sent: EncodedRegion[] = [];
  readonly epoch: string;
  private readonly fieldEpoch: string | undefined;
  private readonly regions: number;
  private readonly clock: number;
  readonly brightness: (update: number) => number;
  /** log2 of the field's scale, as the catalog tells it. */
  scaleLog2: number | undefined;

  constructor(options: Options = {}) {
    this.epoch = options.epoch ?? '00000000000000aa';
    this.fieldEpoch = options.fieldEpoch;
    this.regions = options.regions ?? 1;
    this.clock = options.clock ?? 1000;
    this.brightness = options.brightness ?? ((update) => 1 + update);
  }

  get catalog(): Uint8Array {
    const resolution = [CELLS[0] * this.regions, CELLS[1], CELLS[2]];
    return json({
      lumencast: 1,
      epoch: this.epoch,
      scene: { name: 'test', root: 'test.glb' },
      tick_seconds: TICK,
      fields: [
        {
          id: 0,
          use: 'all',
          scale_log2: this.scaleLog2,
          ...(this.fieldEpoch === undefined ? {} : { source: 'a test', epoch: this.fieldEpoch }),
          kind: 'volume',
          shape: {
            basis: 'sh',
            order: ORDER,
            grid: { center: [0, 0, 0], rotation: [0, 0, 0, 1], size: resolution, resolution },
            cells_min: [0, 0, 0],
            regions: Array.from({ length: this.regions }, (_, id) => ({
              id,
              min: [2 * id, 0, 0],
              size: CELLS,
            })),
            layers: 3,
          },
        },
        { id: 9, kind: 'something later' },
      ],
    });
  }

  /** An edit from a client, or without one the server's own. */
  accept(edit: Edit, client?: string, seq?: number): void {
    if (client !== undefined && seq !== undefined) {
      if (seq <= (this.acks[client] ?? 0)) return;
      this.acks[client] = seq;
    }
    if ('node' in edit && edit.node !== undefined) this.scene.set(edit.node, edit);
    this.accepted.push({
      ...(client === undefined ? {} : { client }),
      ...(seq === undefined ? {} : { seq }),
      edit,
    });
  }

  refuse(client: string, seq: number, reason: string): void {
    this.acks[client] = seq;
    this.refused.push({ client, seq, reason });
  }

  /** The server's clock at the end of a tick. */
  clockOf(tick: number): number {
    return this.clock + tick * TICK;
  }

  /** One tick: its state frame, every 64th a snapshot, and the probe frames of every region. */
  step(isSnapshot = (this.tick + 1) % 64 === 0): { state: Uint8Array; probes: SentFrame[] } {
    this.tick++;
    const state = {
      ...(isSnapshot ? { snapshot: [...this.scene.values()], acks: this.acks } : {}),
      ...(this.accepted.length ? { edits: this.accepted } : {}),
      ...(this.refused.length ? { refused: this.refused } : {}),
      tick: this.tick,
      time: this.tick * TICK,
      clock: this.clockOf(this.tick),
      version: this.tick,
      tick_ms: 20,
      samples: 16,
    };
    this.accepted = [];
    this.refused = [];
    return { state: json(state), probes: this.probes() };
  }

  private probes(): SentFrame[] {
    const update = this.tick;
    const layer = layerOf(update);
    const back = [4, 2, 1][layer];
    const key = update % 40 === 0;
    const target = new Float32Array(8 * valuesPerProbe(ORDER));
    const a = this.brightness(update) * Math.sqrt(3);
    for (let probe = 0; probe < 8; probe++) target[probe * valuesPerProbe(ORDER)] = a;
    const info = { update, tick: this.tick, sceneVersion: this.tick, scaleLog2: 8 };
    const encoded = key
      ? encodeProbes(target, CELLS, ORDER, STEP, info)
      : encodeProbes(target, CELLS, ORDER, STEP, { ...info, base: update - back }, this.sent[update - back]);
    this.sent[update] = encoded;
    return Array.from({ length: this.regions }, (_, region) => ({
      track: `f0/r${region}/l${layer}`,
      bytes: encoded.frame,
    }));
  }
}
