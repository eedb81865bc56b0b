import { EditError } from '../api.js';
import { encodeClientEdit } from '../codec/state.js';
import type { Edit } from '../edit.js';

/** Edits that may wait for the server at once. */
const MOST = 4096;

/** An edit on its way to the server. */
export interface PendingEdit {
  readonly seq: number;
  readonly edit: Edit;
  /** The frame that sends it. */
  readonly bytes: Uint8Array;
}

/** The edits that the server has not dealt with yet, oldest first. */
export class PendingEdits {
  private edits: PendingEdit[] = [];
  private next = 1;

  get list(): readonly PendingEdit[] {
    return this.edits;
  }

  /** @throws EditError when too many wait already. */
  add(edit: Edit, temporary: boolean): PendingEdit {
    if (this.edits.length >= MOST) throw new EditError('full', `${MOST} edits wait for the server already`);
    const pending = { seq: this.next, edit, bytes: encodeClientEdit(this.next, edit, temporary) };
    this.next++;
    this.edits.push(pending);
    return pending;
  }

  /** Takes out the one of a number. */
  settle(seq: number): PendingEdit | undefined {
    const index = this.edits.findIndex((edit) => edit.seq === seq);
    return index < 0 ? undefined : this.edits.splice(index, 1)[0];
  }

  /** Takes out all up to a number. */
  settleUpTo(seq: number): PendingEdit[] {
    const settled = this.edits.filter((edit) => edit.seq <= seq);
    this.edits = this.edits.filter((edit) => edit.seq > seq);
    return settled;
  }

  /** Takes out all and numbers from 1 again, for a server that knows nothing of this client. */
  restart(): PendingEdit[] {
    const lost = this.edits;
    this.edits = [];
    this.next = 1;
    return lost;
  }
}
