import type { LumencastLight } from '@lumencast/three';
import type { Object3D } from 'three';

/** How long an object stays this page's own after the last change, milliseconds. */
const LINGER = 400;

/** Lets the page own an object while a hand is on it, and a moment longer. */
export class Touch {
  readonly #held = new Map<Object3D, { release: () => void; until: number }>();

  constructor(private readonly light: LumencastLight) {}

  /** The page is about to change the object: what it is before is known, what it is then is sent. */
  touch(object: Object3D, now: number = performance.now()): void {
    const held = this.#held.get(object);
    if (held) held.until = now + LINGER;
    else this.#held.set(object, { release: this.light.follow(object), until: now + LINGER });
  }

  /** The page is done with the object at once. */
  release(object: Object3D): void {
    this.#held.get(object)?.release();
    this.#held.delete(object);
  }

  update(now: number): void {
    for (const [object, { until }] of this.#held) if (now >= until) this.release(object);
  }
}
