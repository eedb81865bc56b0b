import { vi } from 'vitest';

const KINDS = [
  'Uint8Array',
  'Int16Array',
  'Uint16Array',
  'Int32Array',
  'Uint32Array',
  'Float32Array',
  'Float64Array',
] as const;

/** Counts the bytes of the typed arrays that are made, until `vi.unstubAllGlobals` is called. */
export function countMemory(): { asked: number } {
  const count = { asked: 0 };
  for (const kind of KINDS) {
    const counting = new Proxy(globalThis[kind], {
      construct(target, args: unknown[]) {
        const made = Reflect.construct(target, args) as InstanceType<typeof target>;
        // Views of a buffer that is there take none.
        if (!(args[0] instanceof ArrayBuffer)) count.asked += made.byteLength;
        return made;
      },
    });
    vi.stubGlobal(kind, counting);
  }
  return count;
}
