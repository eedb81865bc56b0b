import { ConnectError } from '../api.js';
import type { Target } from '../transport.js';
import { isLoopback } from './loopback.js';

/** Milliseconds that a question may take. */
const PATIENCE = 3000;

/**
 * Why no connection came about. Browsers do not tell a page: a refused WebSocket looks to it like one
 * that nobody answers. Plain requests know more, as `/lumencast.json` may be read by pages that may
 * connect.
 */
export async function diagnose(target: Target, base: URL, error: unknown): Promise<ConnectError> {
  const { scene, token } = target;
  const options = { cause: error };
  const answer = await ask(base);
  if (answer === undefined) {
    return (await isSomebodyThere(base))
      ? new ConnectError('origin', foreignPage(base), options)
      : new ConnectError('unreachable', nobodyThere(base), options);
  }
  const { status, casts } = answer;
  if (casts === undefined && status >= 500) {
    const reason = `${base} answers with an error (${status}): does the server behind it run?`;
    return new ConnectError('unreachable', reason, options);
  }
  if (casts === undefined) {
    const reason = `what answers at ${base} is no Lumencast server (${status}): is the port right?`;
    return new ConnectError('stranger', reason, options);
  }
  if (casts !== scene) {
    const reason = `${base} has no scene named ${scene}; it casts ${casts}: connect to ${base}${casts}`;
    return new ConnectError('scene', reason, options);
  }
  const tokens = token
    ? 'the token may be wrong or have expired'
    : 'it may take sessions with a token only (--token-to-read)';
  const reason = `the server at ${base} runs, but takes no session: ${tokens}, or it has all the clients that it takes (--clients), or something on the way lets no WebSocket through (${describe(error)})`;
  return new ConnectError('refused', reason, options);
}

/** Name of the scene that a server says it casts; `undefined` when it says nothing. */
export async function castScene(base: URL): Promise<string | undefined> {
  return (await ask(base))?.casts;
}

/** What is answered to a request that a page may read; `undefined` when there is nothing to be read. */
async function ask(base: URL): Promise<{ status: number; casts: string | undefined } | undefined> {
  let response: Response;
  try {
    response = await fetch(new URL('lumencast.json', base), { signal: AbortSignal.timeout(PATIENCE) });
  } catch {
    return undefined;
  }
  const said: unknown = await response.json().catch(() => undefined);
  const { broadcast } = (said ?? {}) as { broadcast?: unknown };
  return { status: response.status, casts: typeof broadcast === 'string' ? broadcast : undefined };
}

/** Whether anybody answers; what, a page may not know. */
async function isSomebodyThere(base: URL): Promise<boolean> {
  try {
    await fetch(new URL('healthz', base), { mode: 'no-cors', signal: AbortSignal.timeout(PATIENCE) });
    return true;
  } catch {
    return false;
  }
}

function foreignPage(base: URL): string {
  const origin = globalThis.location?.origin ?? 'this program';
  const isName = !isLoopback(base.hostname) && !/^[\d.]+$|^\[/.test(base.hostname);
  const host = isName ? ` and --allow-host ${base.hostname}` : '';
  return `${base} answers, but lets no page of ${origin} in: start the server with --allow-origin ${origin}${host}; or another program answers there`;
}

function nobodyThere(base: URL): string {
  const isLocal = isLoopback(base.hostname);
  const insecure = globalThis.location?.protocol === 'https:' && base.protocol === 'http:' && !isLocal;
  const hints = [
    'does the server run (lumencast serve), and is the port right?',
    ...(base.protocol === 'https:' && !isLocal ? ['Does the browser trust its certificate?'] : []),
    ...(insecure ? ['A page loaded by https may connect by https only.'] : []),
  ];
  return `nobody answers at ${base}: ${hints.join(' ')}`;
}

/** An error in words; those of several attempts one after the other, each once. */
function describe(error: unknown): string {
  if (error instanceof AggregateError) return [...new Set(error.errors.map(describe))].join('; ');
  const message = error instanceof Error ? error.message : String(error);
  return message.replace(/\.$/, '') || 'no reason given';
}
