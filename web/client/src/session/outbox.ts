import { EditError } from '../api.js';
import type { Cache, CacheEvent } from '../cache.js';
import type { Edit } from '../edit.js';

/** Seconds without an answer after which pending edits are sent again. */
const RESEND = 3;
/** Seconds without an answer after which an edit is given up. */
const GIVE_UP = 10;
/** The same while the server may be reading a file that an edit names; later edits wait with it. */
const GIVE_UP_READING = 120;

interface Waiting {
  readonly resolve: () => void;
  readonly reject: (error: Error) => void;
  /** When it was first sent on a connection; `undefined` before. */
  sent: number | undefined;
}

/** The promises of edits, and their sending: in order, again after a loss, until answered. */
export class Outbox {
  private readonly waiting = new Map<number, Waiting>();
  private send: ((frame: Uint8Array) => void) | undefined;
  private lastSent = -Infinity;

  constructor(private readonly cache: Cache) {}

  edit(edit: Edit, temporary: boolean, now: number): Promise<void> {
    return new Promise((resolve, reject) => {
      const { seq, bytes } = this.cache.edit(edit, temporary);
      const waiting: Waiting = { resolve, reject, sent: undefined };
      this.waiting.set(seq, waiting);
      if (!this.send) return;
      waiting.sent = now;
      this.lastSent = now;
      this.send(bytes);
    });
  }

  /** A connection is there: sends all that waits. The server passes over what it has had. */
  connected(send: (frame: Uint8Array) => void, now: number): void {
    this.send = send;
    this.sendAll(now);
  }

  /** The connection is gone: what waits goes on waiting. */
  disconnected(): void {
    this.send = undefined;
    for (const waiting of this.waiting.values()) waiting.sent = undefined;
  }

  /** To be called now and then while the server's ticks arrive. */
  check(now: number): void {
    if (!this.send || this.waiting.size === 0) return;
    const reading = this.cache.pending.find(({ edit }) => namesFile(edit));
    for (const [seq, { sent }] of this.waiting) {
      const limit = reading && seq >= reading.seq ? GIVE_UP_READING : GIVE_UP;
      if (sent === undefined || now - sent < limit) continue;
      this.cache.abandon(seq);
      const reason = `the server gave no answer for ${limit} s; it may need a token for edits, or too many clients edit`;
      this.settle(seq, (waiting) => waiting.reject(new EditError('unanswered', reason)));
    }
    if (now - this.lastSent >= RESEND) this.sendAll(now);
  }

  private sendAll(now: number): void {
    this.lastSent = now;
    for (const { seq, bytes } of this.cache.pending) {
      const waiting = this.waiting.get(seq);
      if (waiting) waiting.sent ??= now;
      this.send?.(bytes);
    }
  }

  /** Takes in what the cache has learnt of an edit. */
  settled(event: CacheEvent): void {
    switch (event.kind) {
      case 'acknowledged':
        return this.settle(event.seq, (waiting) => waiting.resolve());
      case 'refused':
        return this.settle(event.refused.seq, (waiting) =>
          waiting.reject(new EditError('refused', event.refused.reason)),
        );
      case 'lost':
        return this.settle(event.seq, (waiting) =>
          waiting.reject(new EditError('restarted', 'the server has restarted since')),
        );
    }
  }

  /** The session is over. */
  close(reason: string): void {
    this.send = undefined;
    for (const seq of [...this.waiting.keys()]) {
      this.settle(seq, (waiting) => waiting.reject(new EditError('closed', reason)));
    }
  }

  private settle(seq: number, how: (waiting: Waiting) => void): void {
    const waiting = this.waiting.get(seq);
    if (!waiting) return;
    this.waiting.delete(seq);
    how(waiting);
  }
}

function namesFile(edit: Edit): boolean {
  if (edit.edit === 'add_instance') return 'file' in edit.source;
  return edit.edit === 'set_environment' && edit.environment.type === 'image';
}
