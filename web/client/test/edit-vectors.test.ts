import { describe, expect, it } from 'vitest';

import { parseEdit } from '../src/codec/edits.js';
import { checkEdit } from '../src/codec/state.js';
import type { Edit } from '../src/edit.js';
import { readVectors } from './support/vectors.js';

interface Case {
  name: string;
  json: unknown;
  /** What Rust writes, where that is more than `json`: with the defaults of what was left out. */
  full?: unknown;
}

const vectors = readVectors<{ edits: Case[]; refused: Case[] }>('edits');

describe('vectors/edits.json', () => {
  for (const { name, json, full } of vectors.edits) {
    it(`reads ${name}`, () => {
      expect(parseEdit(json)).toEqual(json);
      if (full !== undefined) expect(parseEdit(full)).toEqual(full);
      expect(() => checkEdit(json as Edit)).not.toThrow();
    });
  }

  for (const { name, json } of vectors.refused) {
    it(`refuses ${name}`, () => {
      expect(parseEdit(json)).toBeUndefined();
      expect(() => checkEdit(json as Edit)).toThrow(TypeError);
    });
  }

  it('refuses a name that is half a pair of surrogates', () => {
    expect(parseEdit({ edit: 'add_light', name: '\ud800', light: { type: 'point' } })).toBeUndefined();
  });

  it('passes over what is nested deeper than a stack', () => {
    const deep: unknown = JSON.parse('['.repeat(1e5) + ']'.repeat(1e5));
    expect(parseEdit({ edit: 'add_light', light: { type: deep } })).toBeUndefined();
    expect(parseEdit({ edit: 'set_environment', environment: { type: deep } })).toBeUndefined();
  });

  it('leaves out members that it does not know', () => {
    const edit = { edit: 'remove_node', node: 3, later: true };
    expect(parseEdit(edit)).toEqual({ edit: 'remove_node', node: 3 });
  });
});
