import type { Edit, EditOptions, Session } from '@lumencast/client';
import type { PunctualLight } from './lights.js';

interface Addition {
  /** The program's own light; none where one is still to be made. */
  readonly object: PunctualLight | undefined;
  /** Its number, once the server has said it. */
  node: number | undefined;
}

/** Lights that this page adds, in the order of their edits: the server says their nodes in the same order. */
export class Additions {
  readonly #underWay: Addition[] = [];

  constructor(private readonly session: Pick<Session, 'edit'>) {}

  /** Sends an edit that adds a light. Resolves with its node; with `undefined` where a snapshot told it. */
  async send(
    edit: Edit & { edit: 'add_light' },
    options: EditOptions | undefined,
    object?: PunctualLight,
  ): Promise<number | undefined> {
    const addition: Addition = { object, node: undefined };
    this.#underWay.push(addition);
    try {
      await this.session.edit(edit, options);
    } finally {
      // It is there still where no accepted edit has told its node.
      const at = this.#underWay.indexOf(addition);
      if (at >= 0) this.#underWay.splice(at, 1);
    }
    return addition.node;
  }

  /** The server has accepted the oldest; returns the program's own light that it was sent for. */
  accepted(node: number | undefined): PunctualLight | undefined {
    const addition = this.#underWay.shift();
    if (addition) addition.node = node;
    return addition?.object;
  }
}
