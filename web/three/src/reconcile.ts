import type { Edit, LightSpec } from '@lumencast/client';
import { MATERIAL_PARTS } from './materials.js';

/** One value of the scene that edits set: `node/3/translation`, `light/5/intensity`, … */
export interface Assignment {
  readonly key: string;
  readonly value: unknown;
}

/** What of a light edits set. */
export const LIGHT_PARTS: readonly (keyof LightSpec)[] = [
  'color',
  'intensity',
  'range',
  'inner',
  'outer',
  'radius',
  'angle',
];

/** Where values live: the three.js scene, or a plain map in tests. */
export interface Values {
  /** `undefined` when there is no such thing, or nothing to go back to. */
  get(key: string): unknown;
  set(key: string, value: unknown): void;
}

/**
 * Keeps a page's view of a scene in step with the server's, while the page's own edits show at once.
 *
 * For every value there is what the server last said and what is shown. They differ only while an
 * own edit is under way, or while the page holds the value (somebody drags the object here): then the
 * own value is shown. When the server has dealt with the last own edit, its value counts.
 */
export class Reconciler {
  /** What stood in the file, for values that have changed since. */
  readonly #initial = new Map<string, unknown>();
  /** What the server last said. */
  readonly #accepted = new Map<string, unknown>();
  /** Own edits under way, counted by value. */
  readonly #pending = new Map<string, number>();
  readonly #held = new Map<string, number>();

  constructor(private readonly values: Values) {}

  /** The server has accepted an edit, own or another's. */
  accept(edit: Edit): void {
    for (const { key, value } of assignments(edit)) {
      this.#remember(key);
      this.#accepted.set(key, value);
      this.#show(key);
    }
  }

  /** Shows an own edit at once; `done` is to be called when the server has accepted or refused it. */
  begin(edit: Edit): { done: () => void } {
    const own = assignments(edit);
    for (const { key, value } of own) {
      this.#remember(key);
      count(this.#pending, key, 1);
      this.values.set(key, value);
    }
    return {
      done: () => {
        for (const { key } of own) {
          count(this.#pending, key, -1);
          this.#show(key);
        }
      },
    };
  }

  /** Lets the page own values until the returned function is called. */
  hold(keys: readonly string[]): () => void {
    for (const key of keys) {
      this.#remember(key);
      count(this.#held, key, 1);
    }
    return () => {
      for (const key of keys) {
        count(this.#held, key, -1);
        this.#show(key);
      }
    };
  }

  /** Starts again from the file's state, with a snapshot's edits; own pending values stay shown. */
  restart(edits: readonly Edit[]): void {
    for (const [key, value] of this.#initial) this.#accepted.set(key, value);
    // In the edits' order: a node is moved after the animation that stands has placed it.
    for (const { key, value } of edits.flatMap(assignments)) {
      this.#remember(key);
      this.#accepted.delete(key);
      this.#accepted.set(key, value);
    }
    for (const key of this.#accepted.keys()) this.#show(key);
  }

  /** Things have come that edits may have changed before they were here: an added file is loaded. */
  arrived(): void {
    for (const [key, known] of this.#initial) {
      if (known !== undefined) continue;
      const value = this.values.get(key);
      if (value === undefined) continue;
      this.#initial.set(key, value);
      if (this.#accepted.get(key) === undefined) this.#accepted.set(key, value);
      this.#show(key);
    }
  }

  /** Forgets what was known of a thing whose number will never be used again. */
  forget(prefix: string): void {
    for (const map of [this.#initial, this.#accepted, this.#pending, this.#held]) {
      for (const key of map.keys()) if (key.startsWith(prefix)) map.delete(key);
    }
  }

  #remember(key: string): void {
    if (this.#initial.has(key)) return;
    const value = this.values.get(key);
    this.#initial.set(key, value);
    this.#accepted.set(key, value);
  }

  #show(key: string): void {
    if (this.#pending.has(key) || this.#held.has(key)) return;
    const value = this.#accepted.get(key);
    if (value !== undefined) this.values.set(key, value);
  }
}

function count(counts: Map<string, number>, key: string, change: number): void {
  const next = (counts.get(key) ?? 0) + change;
  if (next > 0) counts.set(key, next);
  else counts.delete(key);
}

/** The values that an edit sets; none for edits that add or remove something. */
export function assignments(edit: Edit): Assignment[] {
  switch (edit.edit) {
    case 'move_node':
      return parts(`node/${edit.node}`, edit, ['translation', 'rotation', 'scale']);
    case 'set_light':
      return parts(`light/${edit.node}`, edit, LIGHT_PARTS);
    case 'remove_light':
      // Its node stays; and a light less would recompile every shader.
      return [{ key: `light/${edit.node}/intensity`, value: 0 }];
    case 'set_material':
      return parts(`material/${edit.material}`, edit, MATERIAL_PARTS);
    case 'set_animation':
      return parts(`animation/${edit.animation}`, edit, ['time', 'speed', 'playing']);
    case 'set_environment':
      return [{ key: 'environment', value: edit.environment }];
    default:
      return [];
  }
}

function parts<T extends object>(
  prefix: string,
  edit: T,
  names: readonly (keyof T & string)[],
): Assignment[] {
  return names
    .filter((name) => edit[name] !== undefined)
    .map((name) => ({ key: `${prefix}/${name}`, value: edit[name] }));
}
