import type { Target } from '../transport.js';

/** What of {@link Target} a program may say besides the address. */
export interface TargetOptions {
  scene?: string;
  token?: string;
  transport?: Target['transport'];
  certificateHash?: string;
}

/**
 * What an address means: `https://host[:port][/base]/scene`. Names of scenes have one part, so the last
 * part of the path is the scene, and what stands before it is where a reverse proxy has the server.
 * With `scene` given, the path is all base, but for the scene's name at its end.
 * @throws TypeError when the address is none, or names no scene
 */
export function parseTarget(url: URL, options: TargetOptions): Target {
  if (url.protocol !== 'https:' && url.protocol !== 'http:') {
    throw new TypeError(`${url.href} does not begin with https:// or http://`);
  }
  const parts = url.pathname.split('/').filter((part) => part !== '');
  const named = options.scene?.split('/') ?? parts.slice(-1).map(decoded);
  const scene = named.join('/');
  if (scene === '') throw new TypeError(`${url.href} names no scene; it should end in /scene`);
  const end = parts.slice(-named.length).map(decoded).join('/');
  const above = end === scene ? parts.slice(0, -named.length) : parts;
  return {
    base: new URL(above.map((part) => `/${part}`).join('') + '/', url.origin),
    scene,
    client: randomName(),
    key: randomName(),
    token: options.token ?? url.searchParams.get('jwt') ?? undefined,
    transport: options.transport ?? 'auto',
    certificateHash: options.certificateHash,
  };
}

/** A part of an address as text. */
function decoded(part: string): string {
  try {
    return decodeURIComponent(part);
  } catch {
    throw new TypeError(`${part} in the address is not UTF-8 once decoded; a % is written %25`);
  }
}

/** 128 random bits in hexadecimal. */
function randomName(): string {
  const bytes = crypto.getRandomValues(new Uint8Array(16));
  return Array.from(bytes, (byte) => byte.toString(16).padStart(2, '0')).join('');
}
