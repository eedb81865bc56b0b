import type { Coding } from '../../src/codec/lightmap-shape.js';
import { json, type SentFrame, TICK } from './fake-server.js';
import { type EncodedTile, encodeLumels } from './lumel-encoder.js';
import { frameHead, join } from './probe-encoder.js';
import { layoutOf, type PlacedTriangle, type Resource, triangle } from './resource-writer.js';

export const FIELD = 7;

export interface LightmapOptions {
  epoch?: string;
  coding?: Coding;
  pageSize?: number;
  pages?: number;
  surfaces?: readonly PlacedTriangle[];
  /** Every so many updates are keyframes. */
  keyframeEvery?: number;
}

/** A server with one lightmap, whose light is the same everywhere. Its pages are one region each. */
export class LightmapServer {
  update = -1;
  readonly layout: Resource;
  /** Its layout, then its charts. */
  readonly resources: readonly Resource[];
  private readonly sent: (EncodedTile | undefined)[] = [];
  readonly shape: { coding: Coding; page_size: number; pages: number; layout: string };
  scaleLog2 = 4;

  constructor(private readonly options: LightmapOptions = {}) {
    const { coding = 'halves', pageSize = 16, pages = 2 } = options;
    const surfaces = options.surfaces ?? [
      { node: 1, charts: triangle(4) },
      { node: 2, charts: triangle(8), x: 8 },
    ];
    this.layout = layoutOf(pageSize, pages, surfaces);
    const charts = new Map(surfaces.map((surface) => [surface.charts.hash, surface.charts]));
    this.resources = [this.layout, ...charts.values()];
    this.shape = { coding, page_size: pageSize, pages, layout: this.layout.hash };
  }

  get catalog(): Uint8Array {
    return json({
      lumencast: 1,
      epoch: this.options.epoch ?? '00000000000000aa',
      scene: { name: 'test', root: 'test.glb' },
      tick_seconds: TICK,
      fields: [{ id: FIELD, use: 'static', scale_log2: this.scaleLog2, kind: 'lightmap', shape: this.shape }],
    });
  }

  state(tick = this.update): Uint8Array {
    const times = { time: tick * TICK, clock: 1000 + tick * TICK };
    return json({ snapshot: [], acks: {}, tick, ...times, version: tick, tick_ms: 1, samples: 1 });
  }

  /** The frames of an update of video in which nothing has changed. */
  idle(): SentFrame[] {
    const base = this.update++;
    const { update, scaleLog2 } = this;
    const info = { update, base, sceneVersion: 5, scaleLog2 };
    const frame = (region: number) => ({
      track: `f${FIELD}/r${region}/l0`,
      bytes: join(frameHead(info), [7, 96]),
    });
    return Array.from({ length: this.shape.pages }, (_, region) => frame(region));
  }

  /** The frames of an update in which all lumels are so bright; a frame of video says it in its unit. */
  step(value: number): SentFrame[] {
    this.update++;
    const { update, scaleLog2 } = this;
    const key = update % (this.options.keyframeEvery ?? 60) === 0;
    const info = { update, ...(key ? {} : { base: update - 1 }), sceneVersion: 5, scaleLog2 };
    return Array.from({ length: this.shape.pages }, (_, region) => {
      const track = `f${FIELD}/r${region}/l0`;
      if (this.shape.coding !== 'halves') {
        return { track, bytes: join(frameHead(info), [7, 96], [key ? 1 : 0, value]) };
      }
      const side = this.shape.page_size;
      const light = new Array<number>(3 * side * side).fill(value);
      const base = key ? undefined : this.sent[region];
      this.sent[region] = encodeLumels(light, [side, side], info, base);
      return { track, bytes: this.sent[region]!.frame };
    });
  }
}
