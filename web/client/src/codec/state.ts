import type { Edit } from '../edit.js';
import { WireError } from '../wire-error.js';
import { parseEdit } from './edits.js';
import { isObject, list, number, object, parseObject, text, usable, whole } from './json.js';
import { LIMITS } from './limits.js';

/** What every frame of the state track tells. */
export interface TickState {
  /** Number of the tick. */
  readonly tick: number;
  /** Scene time in seconds, at which animations stand. */
  readonly time: number;
  /** The server's monotonic clock in seconds at sending. */
  readonly clock: number;
  /** Scene version after this tick's edits and animation. */
  readonly version: number;
  /** How long the last tick took. */
  readonly tickMs: number;
  /** Samples a probe in the last tick. */
  readonly samples: number;
}

/** A frame of the state track: what happened in a tick, and, in a snapshot, what it all comes to. */
export type StateFrame = TickState & {
  /** What was accepted this tick, in the server's order. */
  readonly accepted: readonly StateEdit[];
  readonly refused: readonly Refusal[];
} & ({ readonly kind: 'delta' } | Snapshot);

export interface Snapshot {
  readonly kind: 'snapshot';
  /** Edits that turn the scene as it stands in its file into the scene as it is now. */
  readonly edits: readonly Edit[];
  /** The last sequence number dealt with, by client. */
  readonly acks: ReadonlyMap<string, number>;
}

/** An accepted edit; without client it is the server's own. */
export interface StateEdit {
  readonly client: string | undefined;
  readonly seq: number | undefined;
  /** `undefined` when this client does not know the edit. */
  readonly edit: Edit | undefined;
}

export interface Refusal {
  readonly client: string;
  readonly seq: number;
  readonly reason: string;
}

/**
 * Reads a frame of the state track. Edits that this client does not know are left out, and so are
 * acknowledgements, refusals and senders that are none.
 */
export function parseState(bytes: Uint8Array): StateFrame {
  const json = parseObject(bytes, 'a state frame');
  const tick: TickState = {
    tick: whole(json.tick, 'tick'),
    time: number(json.time, 'time'),
    clock: number(json.clock, 'clock'),
    version: whole(json.version, 'version'),
    tickMs: usable(() => number(json.tick_ms, 'tick_ms', 0)) ?? 0,
    samples: usable(() => number(json.samples, 'samples', 0)) ?? 0,
  };
  const happened = { ...tick, accepted: parseAccepted(json.edits), refused: parseRefused(json.refused) };
  if (absent(json.snapshot)) return { ...happened, kind: 'delta' };
  return { ...happened, kind: 'snapshot', edits: parseSnapshot(json.snapshot), acks: parseAcks(json.acks) };
}

function parseSnapshot(json: unknown): Edit[] {
  return list(json, 'snapshot', LIMITS.snapshotEdits)
    .map(parseEdit)
    .filter((edit) => edit !== undefined);
}

function parseAcks(json: unknown): Map<string, number> {
  const acks = new Map<string, number>();
  for (const [client, value] of isObject(json) ? Object.entries(json) : []) {
    const seq = usable(() => whole(value, 'acks'));
    if (seq !== undefined) acks.set(client, seq);
  }
  return acks;
}

function parseAccepted(json: unknown): StateEdit[] {
  return list(json ?? [], 'edits', LIMITS.deltaEdits)
    .filter(isObject)
    .map((entry) => {
      const source = usable(() => ({ client: text(entry.client, 'client'), seq: whole(entry.seq, 'seq') }));
      return { client: source?.client, seq: source?.seq, edit: parseEdit(entry.edit) };
    });
}

function parseRefused(json: unknown): Refusal[] {
  const read = (value: unknown): Refusal => {
    const { client, seq, reason } = object(value, 'an entry of refused');
    return { client: text(client, 'client'), seq: whole(seq, 'seq'), reason: text(reason, 'reason') };
  };
  return list(json ?? [], 'refused', LIMITS.deltaEdits)
    .map((value) => usable(() => read(value)))
    .filter((refusal) => refusal !== undefined);
}

function absent(value: unknown): boolean {
  return value === undefined || value === null;
}

const utf8 = new TextEncoder();

/** The frame by which a client sends an edit; what a `temporary` one adds goes when its editors have gone. */
export function encodeClientEdit(seq: number, edit: Edit, temporary = false): Uint8Array {
  const bytes = utf8.encode(JSON.stringify({ seq, edit, ...(temporary && { temporary }) }));
  if (bytes.length > LIMITS.editBytes) throw new WireError('limit', `an edit of ${bytes.length} bytes`);
  return bytes;
}

/** Whether a value could be an edit at all, so that a slip in a program fails where it was made. */
export function checkEdit(edit: Edit, temporary = false): void {
  if (!isObject(edit as unknown) || parseEdit(JSON.parse(JSON.stringify(edit))) === undefined) {
    throw new TypeError(`not an edit: ${JSON.stringify(edit)}`);
  }
  const adds = edit.edit === 'add_light' || edit.edit === 'add_instance';
  if (temporary && !adds) throw new TypeError(`${edit.edit} adds nothing that could be temporary`);
}
