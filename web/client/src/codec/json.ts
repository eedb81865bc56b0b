import type { Vec3, Vec4 } from '../edit.js';
import { WireError } from '../wire-error.js';
import { LIMITS } from './limits.js';

/** A JSON object of which nothing is known yet. */
export type Json = { readonly [member: string]: unknown };

const utf8 = new TextDecoder('utf-8', { fatal: true });

/** Parses a frame that must hold one JSON object. */
export function parseObject(bytes: Uint8Array, what: string): Json {
  if (bytes.length > LIMITS.frameBytes) throw new WireError('limit', `${what} of ${bytes.length} bytes`);
  let value: unknown;
  try {
    value = JSON.parse(utf8.decode(bytes));
  } catch (error) {
    throw new WireError('json', `${what} is not JSON: ${(error as Error).message}`);
  }
  if (!isObject(value)) throw new WireError('malformed', `${what} is not a JSON object`);
  return value;
}

/** How a message shows a value of any kind, which may be long, or deeper than a stack is. */
export function shown(value: unknown): string {
  if (typeof value === 'object' && value !== null) return Array.isArray(value) ? 'a list' : 'an object';
  return typeof value === 'string' ? JSON.stringify(value.slice(0, 64)) : String(value);
}

export function isObject(value: unknown): value is Json {
  return typeof value === 'object' && value !== null && !Array.isArray(value);
}

/** What `read` makes of a value; `undefined` where it is nothing that can be used. */
export function usable<T>(read: () => T): T | undefined {
  try {
    return read();
  } catch (error) {
    if (error instanceof WireError) return undefined;
    throw error;
  }
}

/** A finite number within a range. */
export function number(value: unknown, what: string, min = -Infinity, max = Infinity): number {
  if (typeof value !== 'number' || !Number.isFinite(value)) {
    throw new WireError('malformed', `${what} is not a number`);
  }
  if (value < min || value > max) throw new WireError('malformed', `${what} is ${value}`);
  return value;
}

/** The largest number of 32 bits. */
const LARGEST_SINGLE = 3.4028234663852886e38;

/** A number that 32 bits can hold. */
export function single(value: unknown, what: string, min = -LARGEST_SINGLE): number {
  return number(value, what, min, LARGEST_SINGLE);
}

/** A whole number from 0 to `max`. */
export function whole(value: unknown, what: string, max = Number.MAX_SAFE_INTEGER, min = 0): number {
  const n = number(value, what, min, max);
  if (!Number.isInteger(n)) throw new WireError('malformed', `${what} is ${n}`);
  return n;
}

export function text(value: unknown, what: string): string {
  if (typeof value !== 'string') throw new WireError('malformed', `${what} is not a string`);
  return value;
}

/** Text for people: at most `limit` bytes of UTF-8, without control characters. */
export function label(value: unknown, what: string, limit: number): string {
  const label = text(value, what);
  const bytes = new TextEncoder().encode(label).length;
  if (bytes > limit) throw new WireError('limit', `${what} has ${bytes} bytes`);
  // Halves of surrogate pairs are no UTF-8.
  if (/[\p{Cc}\p{Cs}]/u.test(label)) throw new WireError('malformed', `control characters in ${what}`);
  return label;
}

export function object(value: unknown, what: string): Json {
  if (!isObject(value)) throw new WireError('malformed', `${what} is not an object`);
  return value;
}

export function list(value: unknown, what: string, limit: number): readonly unknown[] {
  if (!Array.isArray(value)) throw new WireError('malformed', `${what} is not a list`);
  if (value.length > limit) throw new WireError('limit', `${what} has ${value.length} entries`);
  return value;
}

/** Three numbers, each checked by `check`. */
export function vec3(value: unknown, what: string, check: (value: unknown, what: string) => number): Vec3 {
  const v = list(value, what, 3);
  if (v.length !== 3) throw new WireError('malformed', `${what} has ${v.length} entries`);
  return [check(v[0], what), check(v[1], what), check(v[2], what)];
}

/** Four numbers that 32 bits can hold. */
export function vec4(value: unknown, what: string): Vec4 {
  const v = list(value, what, 4);
  if (v.length !== 4) throw new WireError('malformed', `${what} has ${v.length} entries`);
  return [single(v[0], what), single(v[1], what), single(v[2], what), single(v[3], what)];
}
