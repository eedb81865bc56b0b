import { readFileSync } from 'node:fs';

/** Where one of the repository's test vectors lies. */
export function vectorsFile(name: string): URL {
  return new URL(`../../../../vectors/${name}.json`, import.meta.url);
}

/** One of the repository's test vectors, which Rust reads too. */
export function readVectors<T>(name: string): T {
  return JSON.parse(readFileSync(vectorsFile(name), 'utf8')) as T;
}

export function bytesOf(base64: string): Uint8Array {
  return Uint8Array.from(Buffer.from(base64, 'base64'));
}
