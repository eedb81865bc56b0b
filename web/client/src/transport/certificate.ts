/** Milliseconds to wait for the hash. */
const PATIENCE = 2000;

/**
 * The hash of a development certificate, which the server offers at `/certificate.sha256`. Asked for
 * only on this machine's own addresses: elsewhere an authority vouches for the certificate, and
 * browsers refuse long-lived certificates by hash. A server with such a certificate speaks plain HTTP
 * on the same port, so that is tried too.
 */
export async function offeredCertificateHash(url: URL, signal: AbortSignal): Promise<string | undefined> {
  if (!isLoopback(url.hostname)) return undefined;
  const limit = AbortSignal.any([signal, AbortSignal.timeout(PATIENCE)]);
  return (await ask(`https://${url.host}`, limit)) ?? (await ask(`http://${url.host}`, limit));
}

async function ask(origin: string, signal: AbortSignal): Promise<string | undefined> {
  try {
    const response = await fetch(`${origin}/certificate.sha256`, { signal });
    const hash = (await response.text()).trim();
    return response.ok && /^[0-9a-f]{64}$/i.test(hash) ? hash : undefined;
  } catch {
    // Not offered, then.
    return undefined;
  }
}

function isLoopback(host: string): boolean {
  return (
    host === 'localhost' || host.endsWith('.localhost') || host === '[::1]' || /^127(\.\d+){3}$/.test(host)
  );
}
