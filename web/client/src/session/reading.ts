import { type Catalog, epochOf } from '../codec/catalog.js';
import type { Vec3 } from '../edit.js';
import type { Link, TrackReader } from '../transport.js';
import { LayerControl } from './layers.js';
import { planTracks, STATE_PRIORITY, type TrackPlan } from './plan.js';
import { Turns } from './turns.js';

/** Milliseconds for which state frames are waited for: every one of them counts. */
const STATE_AGE = 5000;

/** Who takes what is read. */
export interface Sink {
  state(frame: Uint8Array): void;
  probes(track: TrackPlan, frame: Uint8Array): void;
}

/** The tracks read of one server's epoch over one connection: which, and with what priority. */
export class Reading {
  readonly layers: LayerControl;
  private readonly stateReader: TrackReader;
  private readonly readers = new Map<string, TrackReader>();
  private readonly turns: Turns;
  private camera: Vec3 | undefined;
  private stale = true;

  constructor(
    private readonly link: Link,
    private readonly catalog: Catalog,
    private readonly sink: Sink,
    now: number,
  ) {
    const most = Math.max(1, ...catalog.fields.map((field) => field.layers));
    // Only of the catalog's own server are clock and updates known by which delivery is judged.
    const own = catalog.fields.filter((field) => epochOf(catalog, field) === catalog.epoch);
    const judged = new Set(own.map((field) => field.id));
    const perUpdate = [1, 2, 3].map((layers) =>
      framesPerUpdate(planTracks(catalog, layers, undefined).filter(({ field }) => judged.has(field))),
    );
    this.layers = new LayerControl(most, catalog.tickSeconds, (layers) => perUpdate[layers - 1]);
    const lowest = planTracks(catalog, 1, undefined).map(({ name }) => name);
    this.turns = new Turns(lowest, catalog.tickSeconds, now);
    this.stateReader = link.subscribe('state', { priority: STATE_PRIORITY, maxAge: STATE_AGE }, (frame) =>
      sink.state(frame),
    );
  }

  setCamera(camera: Vec3 | undefined): void {
    this.camera = camera;
    this.stale = true;
  }

  /** Adapts to the link and the camera. To be called some times a second. */
  adapt(now: number): void {
    if (this.layers.judge(now, this.link.bandwidth())) this.stale = true;
    if (this.turns.judge(now, this.layers.layers === 1)) this.stale = true;
    if (!this.stale) return;
    this.stale = false;
    const planned = planTracks(this.catalog, this.layers.layers, this.camera, this.turns.turn);
    const plan = planned.filter(({ name }) => this.turns.reads(name));
    const wanted = new Set(plan.map((track) => track.name));
    for (const [name, reader] of this.readers) {
      if (wanted.has(name)) continue;
      reader.close();
      this.readers.delete(name);
    }
    for (const track of plan) this.read(track);
  }

  private read(track: TrackPlan): void {
    const { name, priority } = track;
    const reader = this.readers.get(name);
    if (reader) return reader.setPriority(priority);
    const options = { priority, maxAge: 0 };
    this.readers.set(
      name,
      this.link.subscribe(name, options, (frame) => {
        this.turns.heard(name);
        this.sink.probes(track, frame);
      }),
    );
  }

  close(): void {
    this.stateReader.close();
    for (const reader of this.readers.values()) reader.close();
    this.readers.clear();
  }
}

/** Frames that an update brings on average: layers 0 and 1 have every fourth each, layer 2 every second. */
function framesPerUpdate(plan: readonly TrackPlan[]): number {
  return plan.reduce((sum, { layer }) => sum + (layer < 2 ? 1 / 4 : 1 / 2), 0);
}
