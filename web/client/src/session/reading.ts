import { type Catalog, epochOf, isVolume } from '../codec/catalog.js';
import { STATE_TRACK } from '../codec/tracks.js';
import type { Vec3 } from '../edit.js';
import type { Link, TrackReader } from '../transport.js';
import { LayerControl } from './layers.js';
import { lowestTracks, MOST_TRACKS, planTracks, type TrackPlan } from './plan.js';
import { layersOf } from './regions.js';
import { Turns } from './turns.js';

/** Milliseconds for which state frames are waited for: every one of them counts. */
const STATE_AGE = 5000;

/** Who takes what is read. */
export interface Sink {
  stateFrame(frame: Uint8Array): void;
  /** Returns whether this is newer light than the region had. */
  lightFrame(track: TrackPlan, frame: Uint8Array): boolean;
}

/** The tracks read of one server's epoch over one connection: which, and with what priority. */
export class Reading {
  readonly layers: LayerControl;
  private readonly stateReader: TrackReader;
  private readonly readers = new Map<string, TrackReader>();
  /** Fields by which the link is judged. */
  private readonly judged: ReadonlySet<number>;
  private readonly turns: Turns;
  private camera: Vec3 | undefined;
  private moved = false;
  private stale = true;
  /** Whether upper layers are read, which could be dropped. */
  private upper = false;
  /** Time of the last beat, and whether the server has ticked since. */
  private beat: number;
  private ticked = false;
  /** Time of the last beat by which it had ticked. */
  private tickedAt: number;
  /** Time that stands still while the server does not tick. */
  private awake: number;

  constructor(
    private readonly link: Link,
    private readonly catalog: Catalog,
    private readonly sink: Sink,
    now: number,
  ) {
    this.beat = this.tickedAt = this.awake = now;
    const most = Math.max(1, ...catalog.fields.map((field) => layersOf(field)));
    // Only of the catalog's own server are clock and updates known by which delivery is judged; and lightmaps
    // number theirs apart, and have no upper layers to be dropped.
    const own = catalog.fields.filter((field) => epochOf(catalog, field) === catalog.epoch);
    this.judged = new Set(own.filter(isVolume).map((field) => field.id));
    this.turns = new Turns(lowestTracks(catalog, undefined), catalog.tickSeconds, now, MOST_TRACKS);
    const steady = ({ field, name }: TrackPlan) => this.judged.has(field) && !this.turns.isFar(name);
    this.layers = new LayerControl(most, catalog.tickSeconds, (layers) =>
      framesPerUpdate(planTracks(catalog, layers, this.camera).filter(steady)),
    );
    const { name: state, priority } = STATE_TRACK;
    this.stateReader = link.subscribe(state, { priority, maxAge: STATE_AGE }, (frame) => {
      this.ticked = true;
      sink.stateFrame(frame);
    });
  }

  setCamera(camera: Vec3 | undefined): void {
    this.camera = camera;
    this.moved = true;
  }

  /** Light came; see {@link LayerControl.arrived}. What comes and goes in turn tells nothing of the link. */
  arrived({ field, name }: TrackPlan, update: number, delay: number, bytes: number, now: number): void {
    if (this.judged.has(field) && !this.turns.isFar(name)) this.layers.arrived(update, delay, bytes, now);
  }

  /** Adapts to the link and the camera. To be called some times a second. */
  adapt(now: number): void {
    this.keepTime(now);
    if (this.moved) {
      this.turns.order(lowestTracks(this.catalog, this.camera), this.awake);
      this.moved = false;
      this.stale = true;
    }
    if (this.layers.judge(now, this.link.bandwidth())) this.stale = true;
    const slow = this.layers.layers === 1 || !this.upper;
    if (this.turns.judge(this.awake, slow)) this.stale = true;
    if (!this.stale) return;
    this.stale = false;
    const plan = planTracks(this.catalog, this.layers.layers, this.camera, this.turns);
    this.upper = plan.some(({ layer }) => layer > 0);
    const wanted = new Set(plan.map((track) => track.name));
    for (const [name, reader] of this.readers) {
      if (wanted.has(name)) continue;
      reader.close();
      this.readers.delete(name);
    }
    for (const track of plan) this.read(track);
  }

  /** A server that stands still, or takes longer for a tick than it should, starves nobody. */
  private keepTime(now: number): void {
    if (this.ticked) {
      this.awake += Math.min(now - this.tickedAt, Math.max(now - this.beat, this.catalog.tickSeconds));
      this.tickedAt = now;
    }
    this.ticked = false;
    this.beat = now;
  }

  private read(track: TrackPlan): void {
    const { name, priority } = track;
    const reader = this.readers.get(name);
    if (reader) return reader.setPriority(priority);
    const options = { priority, maxAge: 0 };
    this.readers.set(
      name,
      this.link.subscribe(name, options, (frame) => {
        // A group under way is sent from its beginning: that is light of the last turn.
        if (this.sink.lightFrame(track, frame)) this.turns.heard(name);
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
