import type { AcceptedEdit, FieldLight, LightNews, LightState, RefusedEdit, SavedScene } from './api.js';
import { ServerClock } from './cache/clock.js';
import type { FieldCache, Received } from './cache/field.js';
import { createFieldCache } from './cache/kinds.js';
import { type PendingEdit, PendingEdits } from './cache/pending.js';
import type { OpenDecoder } from './cache/picture-decoder.js';
import { Resources } from './cache/resources.js';
import {
  type Catalog,
  epochOf,
  type FieldInfo,
  hasMorePages,
  isCodedAlike,
  isLightmap,
  offersSame,
  parseCatalog,
} from './codec/catalog.js';
import { type LightFile, readLightFile } from './codec/file.js';
import type { LightHead } from './codec/frame-head.js';
import { isVideo } from './codec/lightmap-shape.js';
import { parseState, type StateFrame } from './codec/state.js';
import type { Edit } from './edit.js';
import { WireError } from './wire-error.js';

/** What happened in the cache, in order. */
export type CacheEvent =
  | { readonly kind: 'catalog'; readonly catalog: Catalog; readonly restarted: boolean }
  | { readonly kind: 'snapshot'; readonly edits: readonly Edit[] }
  | { readonly kind: 'edit'; readonly accepted: AcceptedEdit }
  /** Newer light of a region can be shown. */
  | { readonly kind: 'light'; readonly light: LightNews }
  /** One of our edits is dealt with, and the scene shows what came of it. */
  | { readonly kind: 'acknowledged'; readonly seq: number }
  | { readonly kind: 'refused'; readonly refused: RefusedEdit }
  /** One of our edits was on its way to a server that has restarted since. */
  | { readonly kind: 'lost'; readonly seq: number };

/** What a cache is given besides bytes. */
export interface CacheOptions {
  /** Opens decoders of video; without them lightmaps that travel as video are not shown. */
  openDecoder?: OpenDecoder | undefined;
  /** Told when something has happened outside of a call, as when a decoder has taken its time. */
  onLate?: () => void;
}

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
  /** Fields of before whose light fits none of now; shown until there is new light. */
  private leftover: FieldCache[] = [];
  private resources = new Resources();
  private clock = new ServerClock(1);
  private newest: StateFrame | undefined;
  /** Whether no tick is missing since the last snapshot that was passed on. */
  private following = false;
  /** Whether the catalog is that of a file. */
  private saved = false;
  /** Scene time that the file's light is of, seconds. */
  private savedTime = 0;
  private readonly edits = new PendingEdits();
  private happened: CacheEvent[] = [];

  /** `client` is the name under which this client's edits come back. */
  constructor(
    readonly client: string,
    private readonly options: CacheOptions = {},
  ) {}

  get catalog(): Catalog | undefined {
    return this.current;
  }

  /** Fields of the catalog that are not shown: lightmaps that travel as video, where nobody decodes that. */
  get unshown(): readonly FieldInfo[] {
    if (this.options.openDecoder) return [];
    return this.current?.fields.filter(isLightmap).filter(({ shape }) => isVideo(shape.coding)) ?? [];
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

  /** Takes in a frame of the catalog track. Returns whether it tells more than scales and layouts. */
  addCatalog(bytes: Uint8Array, _now: number): boolean {
    const catalog = parseCatalog(bytes);
    for (const cache of this.fields.values()) cache.keepResources();
    if (this.saved || !this.current || !offersSame(this.current, catalog)) {
      this.setCatalog(catalog);
      return true;
    }
    for (const field of catalog.fields) this.fields.get(field.id)!.field = field;
    this.resources.follow(catalog);
    this.current = catalog;
    return false;
  }

  /**
   * Starts from saved light, the bytes of a `.light` file; a server's light takes its place when it comes.
   * Returns what the file says of the scene.
   * @throws WireError when the bytes are none, Error once a server has been heard of; nothing has changed
   * then.
   */
  load(file: Uint8Array, now: number): SavedScene {
    if (this.current && !this.saved) throw new Error('light of a server is there already');
    const read = readLightFile(file);
    const { catalog, edits, files, frames } = read;
    const resources = savedResources(read);
    const fields = new Map(catalog.fields.map((field) => [field.id, this.fieldCache(field, resources)]));
    let savedTime = 0;
    for (const { field, region, frame } of frames) {
      const cache = fields.get(field);
      // Keyframes are of layer 0.
      if (cache?.has(region)) savedTime = cache.add(region, 0, frame, now, catalog.tickSeconds).head.time;
    }
    this.close();
    this.current = catalog;
    this.fields = fields;
    this.leftover = [];
    this.resources = resources;
    this.savedTime = savedTime;
    this.saved = true;
    this.happened.push({ kind: 'catalog', catalog, restarted: false });
    return { edits, files };
  }

  private setCatalog(catalog: Catalog): void {
    const before = this.current;
    const restarted = before !== undefined && (this.saved || before.epoch !== catalog.epoch);
    const old = this.fields;
    this.fields = new Map();
    for (const field of catalog.fields) {
      const same = old.get(field.id);
      // Each field's updates are numbered by its own server's run.
      const anew = this.saved || (before && same && epochOf(before, same.field) !== epochOf(catalog, field));
      const keeps = same && (isCodedAlike(same.field, field) || hasMorePages(field, same.field));
      if (same && (anew || !keeps)) same.forgetUpdates();
      if (keeps) {
        same.field = field;
        this.fields.set(field.id, same);
        old.delete(field.id);
      } else {
        if (same) this.leave(same);
        this.fields.set(field.id, this.fieldCache(field, this.resources));
      }
    }
    for (const cache of old.values()) cache.close();
    const gone = [...old.values()].filter(({ field }) => !this.fields.has(field.id));
    if (restarted) {
      for (const cache of gone) {
        cache.forgetUpdates();
        this.leave(cache);
      }
      this.restart();
    } else {
      const ids = new Set(gone.map(({ field }) => field.id));
      this.leftover = this.leftover.filter(({ field }) => !ids.has(field.id));
    }
    if (!before || restarted) this.clock = new ServerClock(catalog.tickSeconds);
    this.resources.follow(catalog);
    this.saved = false;
    this.current = catalog;
    this.happened.push({ kind: 'catalog', catalog, restarted });
  }

  /** Keeps showing a field's light; one field has one, however often its shape changes. */
  private leave(cache: FieldCache): void {
    if (!cache.lit) return;
    this.leftover = this.leftover.filter(({ field }) => field.id !== cache.field.id);
    this.leftover.push(cache);
  }

  /** Forgets what the catalog's old epoch numbered, but for the light. */
  private restart(): void {
    this.newest = undefined;
    this.following = false;
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
   * Takes in a frame of the track of a layer of a region. Returns at once what the frame says of itself and
   * whether it is newer than what the region had; `undefined` when the catalog has no such field or region.
   *
   * That the light can be shown is told by an event of kind `light`. Of volumes it stands in {@link events}
   * when this returns; of a kind whose decoder takes its time, later.
   */
  addLight(
    field: number,
    region: number,
    layer: number,
    bytes: Uint8Array,
    now: number,
  ): Received | undefined {
    const cache = this.fields.get(field);
    if (!this.current || !cache?.has(region)) return undefined;
    return cache.add(region, layer, bytes, now, this.current.tickSeconds);
  }

  /** Names of resources to be asked for: layouts that the catalog names, and charts that layouts name. */
  get wantedResources(): readonly string[] {
    return this.resources.wanted();
  }

  /**
   * Takes in a resource; returns whether it was wanted. Lightmaps show its surfaces from the next call of
   * {@link light} on; those whose charts have not come yet are left out.
   * @throws WireError where it was wanted, and cannot be read or is too much; it is then wanted no longer.
   */
  addResource(bytes: Uint8Array): boolean {
    return this.resources.add(bytes);
  }

  private fieldCache(field: FieldInfo, resources: Resources): FieldCache {
    const onLight = (region: number, { tick }: LightHead) => {
      // That of a file is not announced, nor that of a field that is no more.
      if (this.fields.get(field.id) !== cache) return;
      // It takes the place of its field's old light, and of that of fields that are gone.
      this.leftover = this.leftover.filter(
        (left) => left.field.id !== field.id && this.fields.has(left.field.id),
      );
      this.happened.push({ kind: 'light', light: { field: field.id, region, tick } });
    };
    const cache = createFieldCache(field, {
      onLight,
      onLate: () => this.options.onLate?.(),
      layoutOf: (shape) => resources.layoutOf(shape),
      openDecoder: this.options.openDecoder,
    });
    return cache;
  }

  /** Gives back what decoders hold. The light stays, and none comes any more. */
  close(): void {
    for (const cache of this.fields.values()) cache.close();
  }

  /** All light, blended to `now`. */
  light(now: number): LightState {
    const fields: FieldLight[] = [];
    for (const cache of [...this.fields.values(), ...this.leftover]) {
      const light = cache.light(now, (tick, arrived) => this.ageOf(cache.field.id, tick, arrived, now));
      if (light) fields.push(light);
    }
    return { fields, age: this.age(now) };
  }

  /** Seconds since the newest light was computed; `undefined` when none came from a server. */
  age(now: number): number | undefined {
    const ages = [...this.fields.values()]
      .map((cache) => {
        const newest = cache.span()?.newest;
        return newest && this.ageOf(cache.field.id, newest.head.tick, newest.arrived, now);
      })
      .filter((age) => age !== undefined);
    return ages.length > 0 ? Math.min(...ages) : undefined;
  }

  /** Whether a field comes from the server whose clock and ticks the state track tells. */
  private isOwn(id: number): boolean {
    const field = this.fields.get(id)?.field;
    return this.current && field ? epochOf(this.current, field) === this.current.epoch : false;
  }

  /** Seconds since a tick's light was computed; since it came, where its server's clock is unknown. */
  private ageOf(field: number, tick: number, arrived: number, now: number): number | undefined {
    if (this.saved) return undefined;
    const time = this.clock.at(now);
    const computed = this.isOwn(field) ? this.clock.of(tick) : undefined;
    return Math.max(0, time === undefined || computed === undefined ? now - arrived : time - computed);
  }

  /** The server's clock at `now`, seconds. */
  serverTime(now: number): number | undefined {
    return this.clock.at(now);
  }

  /** The server's clock at the end of a tick of a field, if its state frame has come. */
  clockOfTick(field: number, tick: number): number | undefined {
    return this.isOwn(field) ? this.clock.sent(tick) : undefined;
  }

  /**
   * Seconds from the end of a tick of a field to `now`, up to a constant; for its changes. `undefined`
   * where its server's clock is unknown.
   */
  delayOf(field: number, tick: number, now: number): number | undefined {
    const clock = this.isOwn(field) ? this.clock.of(tick) : undefined;
    return clock === undefined ? undefined : now - clock;
  }

  /** Scene time that stands still, while there is only a file's light; seconds. */
  get standingTime(): number | undefined {
    return this.saved ? this.savedTime : undefined;
  }

  /** Scene time at `now`, seconds; stands still when the server has been silent for a second. */
  sceneTime(now: number): number | undefined {
    const time = this.clock.at(now);
    if (time === undefined || !this.newest) return undefined;
    return this.newest.time + Math.min(time - this.newest.clock, LONGEST_RUN);
  }

  /**
   * Puts an edit on the list of those that wait for the server. What a `temporary` one adds goes when
   * those who edit it have gone.
   * @throws EditError when too many wait, WireError when it is too long to be sent.
   */
  edit(edit: Edit, temporary = false): PendingEdit {
    return this.edits.add(edit, temporary);
  }

  /** Takes an edit off that list to which no answer came. */
  abandon(seq: number): void {
    this.edits.settle(seq);
  }
}

/**
 * The resources of a file.
 * @throws WireError where one cannot be read, or a lightmap that has light lacks one.
 */
function savedResources({ catalog, resources: records, frames }: LightFile): Resources {
  const resources = new Resources();
  resources.follow(catalog);
  // Twice, since layouts tell which charts are wanted.
  for (const bytes of [...records, ...records]) resources.add(bytes);
  const lit = new Set(frames.map(({ field }) => field));
  for (const { id, shape } of catalog.fields.filter(isLightmap)) {
    if (lit.has(id) && !resources.hasAllOf(shape)) {
      throw new WireError('malformed', `a resource of field ${id} is missing`);
    }
  }
  return resources;
}
