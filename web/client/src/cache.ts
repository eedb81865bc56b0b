import type { AcceptedEdit, FieldLight, LightState, RefusedEdit } from './api.js';
import { ServerClock } from './cache/clock.js';
import { FieldCache } from './cache/field.js';
import { type PendingEdit, PendingEdits } from './cache/pending.js';
import { type Catalog, parseCatalog } from './codec/catalog.js';
import { readLightFile } from './codec/file.js';
import type { ProbeHeader } from './codec/probe-header.js';
import { parseState, type StateFrame } from './codec/state.js';
import type { Edit } from './edit.js';
import type { WireError } from './wire-error.js';

/** What happened in the cache, in order. */
export type CacheEvent =
  | { readonly kind: 'catalog'; readonly catalog: Catalog; readonly restarted: boolean }
  | { readonly kind: 'snapshot'; readonly edits: readonly Edit[] }
  | { readonly kind: 'edit'; readonly accepted: AcceptedEdit }
  /** One of our edits is dealt with, and the scene shows what came of it. */
  | { readonly kind: 'acknowledged'; readonly seq: number }
  | { readonly kind: 'refused'; readonly refused: RefusedEdit }
  /** One of our edits was on its way to a server that has restarted since. */
  | { readonly kind: 'lost'; readonly seq: number };

/** Seconds that the scene's time may run on past the newest state frame. */
const LONGEST_RUN = 1;

/**
 * What a client knows: the server's fields, their light, its clock, and the edits on their way. It owns
 * no socket and no clock: the caller passes bytes in and, with every call, the time `now` in seconds.
 * Frames may be late, lost, doubled and out of order. Bytes that are wrong throw a {@link WireError}
 * and change nothing. The twin of the Rust crate `lumencast-cache`.
 */
export class Cache {
  private current: Catalog | undefined;
  private fields = new Map<number, FieldCache>();
  /** Fields of the time before a restart that the new catalog lacks, shown until there is new light. */
  private leftover: FieldCache[] = [];
  private clock = new ServerClock(1);
  private newest: StateFrame | undefined;
  /** Whether no tick is missing since the last snapshot that was passed on. */
  private following = false;
  /** Whether the catalog is that of a file. */
  private saved = false;
  private readonly edits = new PendingEdits();
  private happened: CacheEvent[] = [];

  /** `client` is the name under which this client's edits come back. */
  constructor(readonly client: string) {}

  get catalog(): Catalog | undefined {
    return this.current;
  }

  /** The newest state frame. */
  get state(): StateFrame | undefined {
    return this.newest;
  }

  /** Edits that the server has not dealt with yet, oldest first. */
  get pending(): readonly PendingEdit[] {
    return this.edits.list;
  }

  /** What has happened since the last call. */
  events(): CacheEvent[] {
    const events = this.happened;
    this.happened = [];
    return events;
  }

  /** Takes in a frame of the catalog track. */
  addCatalog(bytes: Uint8Array): void {
    this.setCatalog(parseCatalog(bytes));
  }

  /** Starts from a saved light field; a server's light takes its place when it comes. */
  load(file: Uint8Array, now: number): void {
    const { catalog, frames } = readLightFile(file);
    this.setCatalog(catalog);
    this.saved = true;
    for (const { field, region, frame } of frames) this.addProbes(field, region, frame, now);
  }

  private setCatalog(catalog: Catalog): void {
    const before = this.current;
    const restarted = before !== undefined && (this.saved || before.epoch !== catalog.epoch);
    if (restarted) this.restart();
    this.saved = false;
    if (!before || restarted) this.clock = new ServerClock(catalog.tickSeconds);
    const old = this.fields;
    this.fields = new Map();
    for (const field of catalog.fields) {
      const same = old.get(field.id);
      const kept = same?.sameShape(field) ? same : undefined;
      if (kept) old.delete(field.id);
      this.fields.set(field.id, kept ?? new FieldCache(field, catalog.tickSeconds));
    }
    if (restarted) this.leftover.push(...old.values());
    this.current = catalog;
    this.happened.push({ kind: 'catalog', catalog, restarted });
  }

  /** Forgets what the old epoch numbered; the light stays. */
  private restart(): void {
    this.newest = undefined;
    this.following = false;
    for (const field of this.fields.values()) field.forgetUpdates();
    // A file has no server that could have had them.
    if (this.saved) return;
    for (const { seq } of this.edits.restart()) this.happened.push({ kind: 'lost', seq });
  }

  /** Takes in a frame of the state track. Frames that are older than the newest are passed over. */
  addState(bytes: Uint8Array, now: number): void {
    const frame = parseState(bytes);
    if (this.newest && frame.tick <= this.newest.tick) return;
    this.clock.sample(frame.tick, frame.clock, now);
    const inOrder = this.following && frame.tick === (this.newest?.tick ?? NaN) + 1;
    this.newest = frame;
    this.following = inOrder || frame.kind === 'snapshot';
    if (inOrder) this.follow(frame);
    else if (frame.kind === 'snapshot') this.happened.push({ kind: 'snapshot', edits: frame.edits });
    this.acknowledge(frame);
  }

  /** Passes on the edits of a tick that follows the one before. */
  private follow(frame: StateFrame): void {
    for (const { client, seq, edit } of frame.accepted) {
      if (!edit) continue;
      const own = client === this.client;
      const by = client === undefined ? {} : { client };
      this.happened.push({
        kind: 'edit',
        accepted: { edit, own, ...by, ...(seq === undefined ? {} : { seq }) },
      });
    }
  }

  private acknowledge(frame: StateFrame): void {
    for (const { client, seq } of frame.accepted) {
      if (client === this.client && seq !== undefined && this.edits.settle(seq)) {
        this.happened.push({ kind: 'acknowledged', seq });
      }
    }
    for (const { client, seq, reason } of frame.refused) {
      const edit = client === this.client ? this.edits.settle(seq) : undefined;
      if (edit) this.happened.push({ kind: 'refused', refused: { seq, edit: edit.edit, reason } });
    }
    if (frame.kind === 'snapshot') {
      for (const { seq } of this.edits.settleUpTo(frame.acks.get(this.client) ?? 0)) {
        this.happened.push({ kind: 'acknowledged', seq });
      }
    }
  }

  /**
   * Takes in a probe frame. Returns its head and whether it is newer than what the region had;
   * `undefined` when the catalog has no such field or region.
   */
  addProbes(
    field: number,
    region: number,
    bytes: Uint8Array,
    now: number,
  ): { header: ProbeHeader; news: boolean } | undefined {
    const cache = this.fields.get(field);
    if (!cache?.has(region)) return undefined;
    const added = cache.add(region, bytes, now);
    if (added.news) this.leftover = [];
    return added;
  }

  /** All light, blended to `now`. */
  light(now: number): LightState {
    const fields: FieldLight[] = [];
    for (const cache of [...this.fields.values(), ...this.leftover]) {
      const light = cache.light(now, (tick, arrived) => this.ageOf(tick, arrived, now));
      if (light) fields.push(light);
    }
    return { fields, age: this.age(now) };
  }

  /** Seconds since the newest light was computed; `undefined` when none came from a server. */
  age(now: number): number | undefined {
    const ages = [...this.fields.values()]
      .map((cache) => cache.span()?.newest)
      .map((newest) => newest && this.ageOf(newest.header.tick, newest.arrived, now))
      .filter((age) => age !== undefined);
    return ages.length > 0 ? Math.min(...ages) : undefined;
  }

  /** Seconds since a tick's light was computed; since it came, where the server's clock is unknown. */
  private ageOf(tick: number, arrived: number, now: number): number | undefined {
    if (this.saved) return undefined;
    const time = this.clock.at(now);
    const computed = this.clock.of(tick);
    return Math.max(0, time === undefined || computed === undefined ? now - arrived : time - computed);
  }

  /** The server's clock at `now`, seconds. */
  serverTime(now: number): number | undefined {
    return this.clock.at(now);
  }

  /** The server's clock at the end of a tick, if its state frame has come. */
  clockOfTick(tick: number): number | undefined {
    return this.clock.sent(tick);
  }

  /** Seconds from the end of a tick on the server's clock to `now`, up to a constant; for its changes. */
  delayOf(tick: number, now: number): number | undefined {
    const clock = this.clock.of(tick);
    return clock === undefined ? undefined : now - clock;
  }

  /** Scene time at `now`, seconds; stands still when the server has been silent for a second. */
  sceneTime(now: number): number | undefined {
    const time = this.clock.at(now);
    if (time === undefined || !this.newest) return undefined;
    return this.newest.time + Math.min(time - this.newest.clock, LONGEST_RUN);
  }

  /**
   * Puts an edit on the list of those that wait for the server.
   * @throws EditError when too many wait, WireError when it is too long to be sent.
   */
  edit(edit: Edit): PendingEdit {
    return this.edits.add(edit);
  }

  /** Takes an edit off that list to which no answer came. */
  abandon(seq: number): void {
    this.edits.settle(seq);
  }
}
