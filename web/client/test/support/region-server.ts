import type { Catalog, FieldInfo } from '../../src/codec/catalog.js';
import type { Region } from '../../src/codec/volume-shape.js';
import type { Vec3 } from '../../src/edit.js';
import { boxDistance } from '../../src/session/box.js';
import type { TrackPlan } from '../../src/session/plan.js';
import { Reading } from '../../src/session/reading.js';
import type { Target, TrackReader } from '../../src/transport.js';
import { FakeLink } from './fake-link.js';
import { volumeIn } from './volumes.js';

const TICK = 0.04;
const BEAT = 0.25;
/** Cells, and metres, of a region along each axis. */
const CELLS = 4;

/** A catalog of one field with so many regions along each axis; the first begins at the origin. */
export function catalogOf(counts: Vec3, tickSeconds = TICK): Catalog {
  const resolution = counts.map((count) => count * CELLS) as Vec3;
  const regions: Region[] = [];
  for (let z = 0; z < counts[2]; z++) {
    for (let y = 0; y < counts[1]; y++) {
      for (let x = 0; x < counts[0]; x++) {
        const min = [x, y, z].map((i) => i * CELLS) as Vec3;
        regions.push({ id: regions.length, min, size: [CELLS, CELLS, CELLS] });
      }
    }
  }
  const field: FieldInfo = {
    id: 0,
    use: 'all',
    kind: 'volume',
    shape: {
      basis: 'sh',
      order: 1,
      grid: {
        center: resolution.map((c) => c / 2) as Vec3,
        rotation: [0, 0, 0, 1],
        size: resolution,
        resolution,
      },
      offset: { cells: 0.5 },
      cellsMin: [0, 0, 0],
      regions,
      layers: 3,
    },
  };
  const scene = { name: 'x', root: 'x.glb' };
  return { epoch: '0123456789abcdef', scene, tickSeconds, fields: [field], unknown: [] };
}

/** Numbers of the regions, nearest first. */
export function byDistance(catalog: Catalog, camera: Vec3): number[] {
  const { grid, regions } = volumeIn(catalog).shape;
  const distances = regions.map((region) => boxDistance(grid, region, camera));
  return regions.map(({ id }) => id).sort((a, b) => distances[a] - distances[b]);
}

export interface WorldOptions {
  /** Seconds that a tick of the server really takes; may change. */
  tick?: number;
  /** Seconds from here to the server, and as many back. */
  way?: number;
  /** Frames a second that the link carries at a time. */
  rate?: (now: number) => number;
  /** Whether a track that is asked for again begins with what it had before. */
  again?: boolean;
  /** Regions for which there never is light. */
  dark?: ReadonlySet<number>;
}

/** A frame on its way: what is queued keeps the priority with which it was. */
interface Queued {
  readonly name: string;
  readonly reader: object;
  readonly priority: number;
  readonly update: number;
  readonly at: number;
  /** Whether it came before. */
  readonly old?: boolean;
}

/**
 * One client of a server of many regions, on a simulated clock: frames of the tracks that are read pass a
 * link, those of higher priority first. A track that is asked for begins at the next update of layer 0.
 */
export class World {
  now = 0;
  readonly reading: Reading;
  readonly link = new FakeLink({} as Target);
  /** Tracks read now, and since when. */
  readonly since = new Map<string, number>();
  /** When tracks were asked for. */
  readonly asked: number[] = [];
  /** When light came, by region. */
  readonly light: number[][];
  mostRead = 0;
  private queue: Queued[] = [];
  private readonly told = new WeakSet<object>();
  private frame: Queued | undefined;
  private credit = 0;
  private ticked = 0;
  private updates = 0;
  private beats = 0;

  constructor(
    catalog: Catalog,
    private readonly options: WorldOptions = {},
  ) {
    this.light = volumeIn(catalog).shape.regions.map(() => []);
    const subscribe = this.link.subscribe.bind(this.link);
    this.link.subscribe = (track, options, onFrame): TrackReader => {
      const reader = subscribe(track, options, onFrame);
      if (track === 'state') return reader;
      this.since.set(track, this.now);
      this.asked.push(this.now);
      this.mostRead = Math.max(this.mostRead, this.since.size);
      const close = () => {
        this.since.delete(track);
        reader.close();
      };
      return { setPriority: (priority) => reader.setPriority(priority), close };
    };
    const sink = { stateFrame: () => {}, lightFrame: (track: TrackPlan) => this.came(track) };
    this.reading = new Reading(this.link, catalog, sink, 0);
  }

  private came(track: TrackPlan): boolean {
    const { update, at, old } = this.frame!;
    this.reading.arrived(track, update, this.now - at, 1000, this.now);
    if (old) return false;
    this.light[track.region].push(this.now);
    return true;
  }

  run(seconds: number): void {
    const end = this.now + seconds;
    for (;;) {
      const tickAt = Math.max(this.ticked + (this.options.tick ?? TICK), this.now);
      const beatAt = this.beats * BEAT;
      if (Math.min(tickAt, beatAt) >= end) {
        this.now = end;
        return;
      }
      this.now = Math.min(tickAt, beatAt);
      if (beatAt <= tickAt) {
        this.beats++;
        this.reading.adapt(this.now);
      } else {
        this.ticked = this.now;
        this.tick(this.updates++);
      }
    }
  }

  private tick(update: number): void {
    const { tick = TICK, way = 0.02, rate, again, dark } = this.options;
    const layer = update % 4 === 0 ? 0 : update % 2 === 0 ? 1 : 2;
    for (const [name, reader] of this.link.readers) {
      const came = this.light[regionOf(name)];
      if (again && came?.length && !this.told.has(reader)) {
        this.told.add(reader);
        const at = came[came.length - 1];
        this.queue.push({ name, reader, priority: reader.priority, update: update - 4, at, old: true });
      }
      if (!name.endsWith(`l${layer}`) || this.now < this.since.get(name)! + way) continue;
      if (dark?.has(regionOf(name))) continue;
      this.queue.push({ name, reader, priority: reader.priority, update, at: this.now });
    }
    // Nothing is sent for a track that is read no more.
    this.queue = this.queue.filter(({ name, reader }) => this.link.readers.get(name) === reader);
    this.queue.sort((a, b) => b.priority - a.priority || a.at - b.at);
    this.credit = rate ? Math.min(this.credit + rate(this.now) * tick, 50) : Infinity;
    const sent = this.now;
    this.now += way;
    this.link.deliver('state', new Uint8Array());
    while (this.credit >= 1 && this.queue.length > 0) {
      this.frame = this.queue.shift()!;
      this.credit--;
      this.link.deliver(this.frame.name, new Uint8Array());
    }
    this.now = sent;
  }

  /** The longest time that each region was without light, from one moment to another. */
  waits(from: number, to = this.now): number[] {
    return this.light.map((times) => {
      const moments = [from, ...times.filter((time) => time > from && time < to), to];
      return Math.max(...moments.slice(1).map((time, i) => time - moments[i]));
    });
  }
}

function regionOf(track: string): number {
  return Number(/r(\d+)/.exec(track)?.[1]);
}
