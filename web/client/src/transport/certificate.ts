/** Milliseconds to wait for the hash. */
const PATIENCE = 2000;

/**
 * The hash of a development certificate, which the server offers at `/certificate.sha256`. Asked for
 * only on this machine's own addresses: elsewhere an authority vouches for the certificate, and
 * browsers refuse long-lived certificates by hash.
 */
export async function offeredCertificateHash(url: URL, signal: AbortSignal): Promise<string | undefined> {
  if (!isLoopback(url.hostname)) return undefined;
  try {
    const limit = AbortSignal.any([signal, AbortSignal.timeout(PATIENCE)]);
    const response = await fetch(new URL('/certificate.sha256', url), { signal: limit });
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
