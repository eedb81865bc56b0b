import { LIMITS } from '../codec/limits.js';

/** Resources that are fetched at once. */
const AT_ONCE = 6;
/** Seconds before one that could not be had is asked for again: at first, and at most. */
const AGAIN = { first: 1, most: 16 } as const;

/** Who wants resources. */
export interface Seeker {
  /** Where the server answers plain requests. */
  readonly base: URL;
  readonly wantedResources: readonly string[];
  takeResource(bytes: Uint8Array): void;
}

/**
 * Fetches what is wanted from the server's HTTP address. What cannot be had, or is not what it should be, is
 * asked for again after a while, ever more seldom.
 */
export class ResourceFetcher {
  private readonly underWay = new Set<string>();
  /** Those that could not be had, and what ends their rest. */
  private readonly resting = new Map<string, ReturnType<typeof setTimeout>>();
  /** How often each could not be had. */
  private readonly failures = new Map<string, number>();

  constructor(
    private readonly seeker: Seeker,
    private readonly signal: AbortSignal,
  ) {
    signal.addEventListener('abort', () => this.resting.forEach((timer) => clearTimeout(timer)));
  }

  /** To be called when something new may be wanted. */
  look(): void {
    for (const hash of this.seeker.wantedResources) {
      if (this.underWay.size >= AT_ONCE) return;
      if (!this.underWay.has(hash) && !this.resting.has(hash)) void this.fetch(hash);
    }
  }

  private async fetch(hash: string): Promise<void> {
    this.underWay.add(hash);
    const { signal } = this;
    try {
      const response = await fetch(new URL(`resources/${hash}`, this.seeker.base), { signal });
      if (response.ok) this.seeker.takeResource(await bytesOf(response, LIMITS.resourceBytes));
    } catch {
      // Nobody answers, or what is answered has no end.
    }
    this.underWay.delete(hash);
    if (signal.aborted) return;
    if (this.seeker.wantedResources.includes(hash)) this.rest(hash);
    else this.failures.delete(hash);
    this.look();
  }

  /** One that could not be had waits. */
  private rest(hash: string): void {
    const failures = this.failures.get(hash) ?? 0;
    this.failures.set(hash, failures + 1);
    const seconds = Math.min(AGAIN.first * 2 ** failures, AGAIN.most);
    const end = () => {
      this.resting.delete(hash);
      this.look();
    };
    this.resting.set(hash, setTimeout(end, 1000 * seconds));
  }
}

/** What a response holds. Throws where that is more than `most` bytes. */
async function bytesOf(response: Response, most: number): Promise<Uint8Array> {
  const parts: Uint8Array[] = [];
  let length = 0;
  const reader = response.body!.getReader();
  for (;;) {
    const { done, value } = await reader.read();
    if (done) break;
    parts.push(value);
    length += value.length;
    if (length > most) {
      await reader.cancel();
      throw new RangeError(`a resource of more than ${most} bytes`);
    }
  }
  const bytes = new Uint8Array(length);
  let at = 0;
  for (const part of parts) {
    bytes.set(part, at);
    at += part.length;
  }
  return bytes;
}
