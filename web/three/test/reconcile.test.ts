import type { Edit, Vec3 } from '@lumencast/client';
import { describe, expect, it } from 'vitest';
import { Reconciler } from '../src/reconcile.js';

const KEY = 'node/1/translation';
const move = (x: number, node = 1): Edit => ({ edit: 'move_node', node, translation: [x, 0, 0] });

function scene() {
  const values = new Map<string, unknown>([[KEY, [0, 0, 0]]]);
  const reconciler = new Reconciler({
    get: (key) => values.get(key),
    set: (key, value) => void values.set(key, value),
  });
  return { values, reconciler, shown: () => (values.get(KEY) as Vec3)[0] };
}

describe('Reconciler', () => {
  it('shows an own edit at once and the server’s order in the end', () => {
    const { reconciler, shown } = scene();
    const own = reconciler.begin(move(1));
    expect(shown()).toBe(1);
    reconciler.accept(move(5)); // another's, before ours in the server's order
    expect(shown()).toBe(1);
    reconciler.accept(move(1));
    own.done();
    expect(shown()).toBe(1);
    reconciler.accept(move(6));
    expect(shown()).toBe(6);
  });

  it('falls back to another’s edit that came after ours', () => {
    const { reconciler, shown } = scene();
    const own = reconciler.begin(move(1));
    reconciler.accept(move(1));
    reconciler.accept(move(7));
    expect(shown()).toBe(1);
    own.done();
    expect(shown()).toBe(7);
  });

  it('undoes a refused edit', () => {
    const { reconciler, shown } = scene();
    const refused = reconciler.begin(move(1));
    refused.done();
    expect(shown()).toBe(0);
  });

  it('waits for the last of several own edits', () => {
    const { reconciler, shown } = scene();
    const [first, second] = [reconciler.begin(move(1)), reconciler.begin(move(2))];
    reconciler.accept(move(1));
    first.done();
    expect(shown()).toBe(2);
    second.done(); // refused
    expect(shown()).toBe(1);
  });

  it('gives a thing that comes late what edits have made of it, and takes it back with them', () => {
    const values = new Map<string, unknown>();
    const reconciler = new Reconciler({
      get: (key) => values.get(key),
      set: (key, value) => void (values.has(key) && values.set(key, value)),
    });
    reconciler.accept(move(3));
    values.set(KEY, [1, 1, 1]); // the file is loaded
    reconciler.arrived();
    expect(values.get(KEY)).toEqual([3, 0, 0]);
    reconciler.accept(move(4));
    reconciler.arrived();
    expect(values.get(KEY)).toEqual([4, 0, 0]);
    reconciler.restart([]);
    expect(values.get(KEY)).toEqual([1, 1, 1]);
  });

  it('leaves held values to the page', () => {
    const { reconciler, shown, values } = scene();
    const release = reconciler.hold([KEY]);
    values.set(KEY, [3, 0, 0]); // the page drags
    reconciler.accept(move(9));
    expect(shown()).toBe(3);
    release();
    expect(shown()).toBe(9);
  });

  it('starts again from the file’s state with a snapshot', () => {
    const { reconciler, shown, values } = scene();
    reconciler.accept(move(4));
    reconciler.restart([]);
    expect(shown()).toBe(0);
    const own = reconciler.begin(move(2));
    reconciler.restart([move(8), { edit: 'set_light', node: 3, intensity: 5 }]);
    expect(shown()).toBe(2);
    expect(values.get('light/3/intensity')).toBe(5);
    own.done();
    expect(shown()).toBe(8);
  });
});
