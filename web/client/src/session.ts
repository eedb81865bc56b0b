import {
  ConnectError,
  EditError,
  type EditOptions,
  type LightState,
  type Problem,
  type SavedScene,
  type Session,
  type SessionEvents,
  type SessionStats,
  type Status,
  type Timing,
} from './api.js';
import { Cache } from './cache.js';
import type { OpenDecoder } from './cache/picture-decoder.js';
import type { Catalog, FieldInfo } from './codec/catalog.js';
import { checkEdit } from './codec/state.js';
import { CATALOG_TRACK, STATE_TRACK } from './codec/tracks.js';
import type { Edit, Vec3 } from './edit.js';
import { Emitter } from './session/emitter.js';
import { Meter } from './session/meter.js';
import { Outbox } from './session/outbox.js';
import type { TrackPlan } from './session/plan.js';
import { Reading, type Sink } from './session/reading.js';
import { ResourceFetcher, type Seeker } from './session/resources.js';
import { parseTarget } from './session/target.js';
import { reportUncaught } from './session/uncaught.js';
import type { Connector, Link, Target } from './transport.js';
import { moqConnector } from './transport/moq.js';
import { videoDecoders } from './video/decoders.js';
import { WireError } from './wire-error.js';

/** How to connect; all of it may be left out. */
export interface ConnectOptions {
  /** Name of the scene; the last part of the address' path unless given. */
  scene?: string;
  /** A token that allows edits; the address's `jwt` parameter unless given. */
  token?: string;
  /** Which transport to use; WebTransport, and a WebSocket where that fails, unless given. */
  transport?: 'auto' | 'webtransport' | 'websocket';
  /**
   * SHA-256 of the server's certificate in hexadecimal, where no authority vouches for it. Asked from
   * the server itself on this machine's own addresses.
   */
  certificateHash?: string;
  /**
   * Saved light (the bytes of a `.light` file) to show until the server's light comes: its
   * catalog is there at once, `ready` waits for the server all the same.
   */
  saved?: Uint8Array;
  /** Makes connections; tests bring their own. */
  connector?: Connector;
  /** Opens decoders of video; those of the browser unless given, where it has any. */
  openDecoder?: OpenDecoder;
}

/** Milliseconds between two looks at link, camera and pending edits. */
const BEAT = 250;
/** Milliseconds that an attempt to connect may take. */
const ATTEMPT = 10_000;
/** Seconds before the next attempt, at first and at most. */
const BACKOFF = { first: 0.25, most: 2 } as const;
/** Seconds of silence, and ticks, after which a connection counts as dead. */
const SILENCE = { seconds: 3, ticks: 10 } as const;
/** Seconds for which the catalog is waited for. */
const CATALOG_WAIT = 5;
/** How a connection ends over which none comes. */
const NO_CATALOG: Ending = { reason: 'no catalog has come', problem: 'scene' };
/** Seconds by which animations are played late unless said otherwise. */
const ANIMATION_DELAY = 0.1;

/** Why a connection ended, or did not come about. */
interface Ending {
  readonly reason: string;
  readonly problem?: Problem;
}

/**
 * Connects to a scene's light, `https://host:port/scene`, or `https://host/base/scene` where a reverse
 * proxy has the server under a path. Returns at once; the session connects, and connects again after a
 * loss, by itself.
 * @throws TypeError when the address is none, or names no scene; WireError when `saved` is no light file.
 */
export function connect(url: string | URL, options: ConnectOptions = {}): Session {
  return new LiveSession(parseTarget(new URL(url), options), options);
}

/** Seconds of the clock that all times of a session are told by. */
function seconds(): number {
  return performance.now() / 1000;
}

class LiveSession implements Session, Sink, Seeker {
  readonly origin: string;
  readonly scene: string;
  readonly client: string;
  readonly ready: Promise<void>;
  readonly saved: SavedScene | undefined;
  private settleReady: { resolve: () => void; reject: (error: Error) => void } | undefined;
  private readonly cache: Cache;
  private readonly outbox: Outbox;
  private readonly resources: ResourceFetcher;
  private readonly meter = new Meter();
  private readonly emitter = new Emitter<SessionEvents>();
  private readonly ending = new AbortController();
  private readonly connector: Connector;
  private current: Status = { state: 'connecting', attempt: 1 };
  private link: Link | undefined;
  /** What is read over the link, once it has given a catalog. */
  private reading: Reading | undefined;
  private camera: Vec3 | undefined;
  /** Where the server answers plain requests, as far as is known. */
  base: URL;
  /** Seconds awake since the link was made, or last gave a frame. */
  private silence = 0;

  constructor(
    private readonly target: Target,
    options: ConnectOptions,
  ) {
    this.origin = target.base.origin;
    this.base = target.base;
    this.scene = target.scene;
    this.client = target.client;
    this.connector = options.connector ?? moqConnector;
    this.cache = new Cache(target.client, {
      openDecoder: options.openDecoder ?? videoDecoders(),
      onLate: () => this.dispatch(),
    });
    this.outbox = new Outbox(this.cache);
    this.resources = new ResourceFetcher(this, this.ending.signal);
    this.ready = new Promise((resolve, reject) => (this.settleReady = { resolve, reject }));
    // Who does not wait for it need not hear that it failed.
    this.ready.catch(() => {});
    if (options.saved) {
      this.saved = this.cache.load(options.saved, seconds());
      // Nobody listens yet; the catalog is there to be read.
      this.cache.events();
    }
    void this.run();
  }

  // The connection's life

  private async run(): Promise<void> {
    let backoff: number = BACKOFF.first;
    for (let attempt = 1; !this.ending.signal.aborted; attempt++) {
      this.setStatus({ state: 'connecting', attempt });
      const { reason, problem } = await this.attempt();
      if (this.ending.signal.aborted) return;
      if (this.current.state === 'connected') {
        attempt = 0;
        backoff = BACKOFF.first;
      }
      this.setStatus({ state: 'lost', reason, ...(problem && { problem }), retryIn: backoff });
      await pause(backoff, this.ending.signal);
      backoff = Math.min(2 * backoff, BACKOFF.most);
    }
  }

  /** Connects once and stays until the connection ends; returns why it did. */
  private async attempt(): Promise<Ending> {
    let link: Link;
    try {
      const limit = AbortSignal.any([this.ending.signal, AbortSignal.timeout(ATTEMPT)]);
      link = await this.connector(this.target, limit);
    } catch (error) {
      const { message, problem = 'unreachable' } = error as Partial<ConnectError> & Error;
      return { reason: message, problem };
    }
    if (this.ending.signal.aborted) {
      link.close();
      return { reason: 'closed' };
    }
    this.base = link.base ?? this.target.base;
    let die = (_ending: Ending): void => {};
    const dead = new Promise<Ending>((resolve) => (die = resolve));
    this.link = link;
    this.silence = 0;
    const { name, priority } = CATALOG_TRACK;
    const catalog = link.subscribe(name, { priority, maxAge: 0 }, (frame) => this.catalogFrame(frame, link));
    let beaten = seconds();
    const beat = setInterval(() => {
      const now = seconds();
      this.beat(now, now - beaten, die);
      beaten = now;
    }, BEAT);
    const aborted = () => die({ reason: 'closed' });
    this.ending.signal.addEventListener('abort', aborted, { once: true });
    const ending = await Promise.race([link.ended.then((reason) => ({ reason })), dead]);
    this.ending.signal.removeEventListener('abort', aborted);
    clearInterval(beat);
    catalog.close();
    this.reading?.close();
    this.reading = undefined;
    this.outbox.disconnected();
    this.link = undefined;
    link.close();
    return ending === NO_CATALOG ? this.withoutCatalog(link) : ending;
  }

  /** A connection over which no catalog comes. */
  private async withoutCatalog(link: Link): Promise<Ending> {
    const { base, scene } = this;
    const casts = await link.casts?.();
    if (casts === scene) return { problem: 'silent', reason: `${base} casts ${scene}, but sends no light` };
    const hint = casts === undefined ? '' : `; it casts ${casts}: connect to ${base}${casts}`;
    return { problem: 'scene', reason: `${base} has no scene named ${scene}${hint}` };
  }

  private beat(now: number, elapsed: number, die: (ending: Ending) => void): void {
    // A page that is busy or in the background beats late, and has not heard what came meanwhile.
    this.silence += Math.min(elapsed, (2 * BEAT) / 1000);
    if (!this.reading) {
      if (this.silence > CATALOG_WAIT) die(NO_CATALOG);
      return;
    }
    const tick = this.cache.catalog?.tickSeconds ?? 0;
    const limit = Math.max(SILENCE.seconds, SILENCE.ticks * tick);
    if (this.silence > limit) return die({ reason: `nothing has come for ${limit} s` });
    this.reading.adapt(now);
    this.outbox.check(now);
  }

  private setStatus(status: Status): void {
    this.current = status;
    this.emitter.emit('status', status);
  }

  // What arrives

  private catalogFrame(frame: Uint8Array, link: Link): void {
    const now = this.hear(CATALOG_TRACK.name, frame);
    let changed: boolean;
    try {
      changed = this.cache.addCatalog(frame, now);
    } catch (error) {
      if (error instanceof WireError && error.kind === 'version') return this.end(error.message, 'version');
      return this.drop(error);
    }
    this.dispatch();
    this.resources.look();
    if (!this.cache.catalog || (this.reading && !changed)) return;
    // Tracks of a former epoch or set of fields are read no more.
    this.reading?.close();
    this.meter.restart();
    this.reading = new Reading(link, this.readable(this.cache.catalog), this, now);
    this.reading.setCamera(this.camera);
    this.reading.adapt(now);
    this.outbox.connected((bytes) => link.sendEdit(bytes), now);
    if (this.current.state !== 'connected') this.setStatus({ state: 'connected', transport: link.kind });
    this.settleReady?.resolve();
  }

  /** A catalog without fields that nothing is made of here. */
  private readable(catalog: Catalog): Catalog {
    const { unshown } = this;
    return { ...catalog, fields: catalog.fields.filter((field) => !unshown.includes(field)) };
  }

  stateFrame(frame: Uint8Array): void {
    const now = this.hear(STATE_TRACK.name, frame);
    try {
      this.cache.addState(frame, now);
    } catch (error) {
      return this.drop(error);
    }
    this.meter.ticks.add(1, now);
    this.dispatch();
  }

  lightFrame(track: TrackPlan, frame: Uint8Array): boolean {
    const { name, field, region, layer } = track;
    const now = this.hear(name, frame);
    let added: ReturnType<Cache['addLight']>;
    try {
      added = this.cache.addLight(field, region, layer, frame, now);
    } catch (error) {
      this.drop(error);
      return false;
    }
    if (!added) return false;
    const { update, tick } = added.head;
    const arrived = performance.timeOrigin + 1000 * now;
    const decoded = performance.timeOrigin + performance.now();
    const bytes = frame.length;
    this.meter.update(update, { field, region, layer, tick, arrived, decoded, bytes }, now);
    const delay = this.cache.delayOf(field, tick, now);
    if (delay !== undefined) this.reading?.arrived(track, update, delay, bytes, now);
    this.dispatch();
    return added.news;
  }

  takeResource(bytes: Uint8Array): void {
    try {
      this.cache.addResource(bytes);
    } catch (error) {
      this.drop(error);
    }
  }

  /** Notes that a frame came; returns when. */
  private hear(track: string, frame: Uint8Array): number {
    const now = seconds();
    this.silence = 0;
    this.meter.frame(track, frame.length, now);
    return now;
  }

  private drop(error: unknown): void {
    if (error instanceof WireError) this.meter.dropped++;
    // A slip of this program, not of the sender.
    else reportUncaught(error);
  }

  /** Passes on what the cache has learnt. */
  private dispatch(): void {
    for (const event of this.cache.events()) {
      switch (event.kind) {
        case 'catalog':
          this.emitter.emit('catalog', event.catalog);
          break;
        case 'snapshot':
          this.emitter.emit('snapshot', event.edits);
          break;
        case 'edit':
          this.emitter.emit('edit', event.accepted);
          break;
        case 'light':
          this.emitter.emit('light', event.light);
          break;
        case 'refused':
          this.emitter.emit('refused', event.refused);
          this.outbox.settled(event);
          break;
        default:
          this.outbox.settled(event);
      }
    }
  }

  // What a program asks

  get files(): string {
    return new URL('scene/', this.base).href;
  }

  get status(): Status {
    return this.current;
  }

  get catalog(): Catalog | undefined {
    return this.cache.catalog;
  }

  get unshown(): readonly FieldInfo[] {
    return this.cache.unshown;
  }

  get wantedResources(): readonly string[] {
    return this.cache.wantedResources;
  }

  get pending(): readonly Edit[] {
    return this.cache.pending.map(({ edit }) => edit);
  }

  get stats(): SessionStats {
    const now = seconds();
    const state = this.cache.state;
    return {
      tickRate: state && this.meter.ticks.at(now),
      updateRate: this.meter.updateRate(now),
      age: this.cache.age(now),
      bandwidth: this.meter.bytes.at(now),
      bandwidthByTrack: this.meter.bandwidthByTrack(now),
      tickMs: state?.tickMs,
      samples: state?.samples,
      delay: this.reading?.layers.delay,
      layers: this.reading?.layers.layers ?? 0,
      pending: this.cache.pending.length,
      dropped: this.meter.dropped,
    };
  }

  on<K extends keyof SessionEvents>(event: K, listener: (value: SessionEvents[K]) => void): () => void {
    return this.emitter.on(event, listener);
  }

  async edit(edit: Edit, { temporary = false }: EditOptions = {}): Promise<void> {
    checkEdit(edit, temporary);
    if (this.current.state === 'closed') throw new EditError('closed', this.current.reason);
    return this.outbox.edit(edit, temporary, seconds());
  }

  light(now: number = performance.now()): LightState {
    return this.cache.light(now / 1000);
  }

  sceneTime(now: number = performance.now(), delay: number = ANIMATION_DELAY): number | undefined {
    const time = this.cache.sceneTime(now / 1000);
    return time === undefined ? this.cache.standingTime : time - delay;
  }

  setCamera(position: Vec3): void {
    if (this.camera?.every((c, axis) => c === position[axis])) return;
    this.camera = [...position];
    this.reading?.setCamera(this.camera);
  }

  timings(): readonly Timing[] {
    return this.meter.timings((field, tick) => this.cache.clockOfTick(field, tick));
  }

  close(reason = 'the session was closed'): void {
    this.end(reason);
  }

  /** Ends the session for good. */
  private end(reason: string, problem?: Problem): void {
    if (this.ending.signal.aborted) return;
    this.ending.abort();
    this.link?.close();
    this.cache.close();
    this.outbox.close(reason);
    this.settleReady?.reject(problem ? new ConnectError(problem, reason) : new Error(reason));
    this.setStatus({ state: 'closed', reason, ...(problem && { problem }) });
  }
}

/** Waits for some seconds, or less when `signal` is aborted. */
function pause(time: number, signal: AbortSignal): Promise<void> {
  return new Promise((resolve) => {
    const end = () => {
      clearTimeout(timer);
      signal.removeEventListener('abort', end);
      resolve();
    };
    const timer = setTimeout(end, 1000 * time);
    signal.addEventListener('abort', end);
  });
}
