/** `vectors/frames.json`, which Rust reads too: of frames with members that cannot be used, what is kept. */
import { describe, expect, it } from 'vitest';
import { parseCatalog } from '../src/codec/catalog.js';
import { parseState, type StateFrame } from '../src/codec/state.js';
import { readVectors } from './support/vectors.js';

interface Case {
  readonly name: string;
  readonly track: 'state' | 'catalog';
  readonly frame: unknown;
  /** What the frame comes to, written as a frame; absent where it is refused. */
  readonly kept?: unknown;
}

const { frames } = readVectors<{ frames: readonly Case[] }>('frames');
const utf8 = new TextEncoder();

function read({ track }: Case, frame: unknown) {
  const bytes = utf8.encode(JSON.stringify(frame));
  // Whether `unknown` tells of what is not kept is for catalog.test.ts to say.
  return track === 'catalog' ? { ...parseCatalog(bytes), unknown: [] } : known(parseState(bytes));
}

/** Without the edits that this client does not know, which Rust leaves out of the frame. */
function known(frame: StateFrame): StateFrame {
  return { ...frame, accepted: frame.accepted.filter(({ edit }) => edit) };
}

describe('vectors/frames.json', () => {
  it.each(frames.map((frame) => [frame.name, frame] as const))('%s', (_, wanted) => {
    if (wanted.kept === undefined) {
      expect(() => read(wanted, wanted.frame)).toThrow(expect.objectContaining({ name: 'WireError' }));
    } else {
      expect(read(wanted, wanted.frame)).toEqual(read(wanted, wanted.kept));
    }
  });
});
