import { isLoopback } from './loopback.js';

/** Milliseconds to wait for the hash. */
const PATIENCE = 2000;

/** A server that made its certificate itself. */
export interface DevelopmentServer {
  /** SHA-256 of the certificate in hexadecimal. */
  readonly hash: string;
  /** Where it answers plain requests: not by HTTPS, as no browser would trust the certificate there. */
  readonly base: URL;
}

/**
 * The development server at an address: it offers its certificate's hash at `certificate.sha256`. Asked
 * at https only on this machine's own addresses: elsewhere an authority vouches for the certificate, and
 * browsers refuse long-lived certificates by hash. A server with such a certificate speaks plain HTTP
 * on the same port, so that is tried too. Under a path a proxy stands before the server, which
 * WebTransport does not pass.
 */
export async function developmentServer(
  base: URL,
  signal: AbortSignal,
): Promise<DevelopmentServer | undefined> {
  const limit = AbortSignal.any([signal, AbortSignal.timeout(PATIENCE)]);
  if (base.protocol === 'http:') return base.pathname === '/' ? ask(base, limit) : undefined;
  if (!isLoopback(base.hostname)) return undefined;
  const plain = new URL(base);
  plain.protocol = 'http:';
  return (await ask(base, limit)) ?? (await ask(plain, limit));
}

async function ask(base: URL, signal: AbortSignal): Promise<DevelopmentServer | undefined> {
  try {
    const response = await fetch(new URL('certificate.sha256', base), { signal });
    const hash = (await response.text()).trim();
    return response.ok && /^[0-9a-f]{64}$/i.test(hash) ? { hash, base } : undefined;
  } catch {
    // Not offered, then.
    return undefined;
  }
}
