import {
  EditError,
  type LightState,
  type SavedScene,
  type Session,
  type SessionEvents,
  type SessionStats,
  type Status,
} from './api.js';
import { Cache } from './cache.js';
import type { OpenDecoder } from './cache/picture-decoder.js';
import type { Catalog, FieldInfo } from './codec/catalog.js';
import { Emitter } from './session/emitter.js';
import { videoDecoders } from './video/decoders.js';

/** What of saved light's surroundings its file does not say. */
export interface SavedOptions {
  /** Address of a file of the scene, or of their folder with a slash at its end; the page's folder unless given. */
  files?: string | URL;
  /** Opens decoders of video; those of the browser unless given, where it has any. */
  openDecoder?: OpenDecoder;
}

/**
 * Opens saved light, the bytes of a `.light` file, as a session that no server stands behind: it
 * connects to nothing, its light stands still, and edits reject.
 * @throws WireError when the bytes are no light file
 */
export function openLight(bytes: Uint8Array, options: SavedOptions = {}): Session {
  return new SavedSession(bytes, options);
}

/**
 * Fetches a `.light` file.
 * @param address relative to the page
 * @throws Error, with the address and what was answered, when there is none
 */
export async function fetchLight(address: string | URL, signal?: AbortSignal): Promise<Uint8Array> {
  const url = new URL(address, pageAddress());
  const response = await fetch(url, signal ? { signal } : {}).catch((error: unknown) => {
    throw new Error(`${url} cannot be read: ${(error as Error).message}`, { cause: error });
  });
  if (!response.ok) {
    const what = response.status === 404 ? 'is missing' : 'cannot be read';
    throw new Error(`${url} ${what} (HTTP ${response.status})`);
  }
  // Development servers answer with their page where a file is missing.
  if (response.headers.get('content-type')?.startsWith('text/html')) {
    throw new Error(`${url} is missing (a web page was answered)`);
  }
  return new Uint8Array(await response.arrayBuffer());
}

/** What addresses of a page are relative to; of a program, the root of its files. */
function pageAddress(): string {
  return globalThis.document?.baseURI ?? 'file:///';
}

const NO_STATS: SessionStats = {
  tickRate: undefined,
  updateRate: 0,
  age: undefined,
  bandwidth: 0,
  bandwidthByTrack: new Map(),
  tickMs: undefined,
  samples: undefined,
  delay: undefined,
  layers: 0,
  pending: 0,
  dropped: 0,
};

class SavedSession implements Session {
  readonly origin: string;
  readonly files: string;
  readonly client = '';
  readonly ready = Promise.resolve();
  readonly stats = NO_STATS;
  readonly pending = [];
  readonly saved: SavedScene;
  status: Status = { state: 'saved' };
  private readonly cache: Cache;
  private readonly emitter = new Emitter<SessionEvents>();

  constructor(bytes: Uint8Array, { files = '.', openDecoder = videoDecoders() }: SavedOptions) {
    const folder = new URL(files, pageAddress());
    // Blobs and data lie in no folder.
    this.files = URL.canParse('.', folder) ? new URL('.', folder).href : pageAddress();
    this.origin = folder.origin;
    this.cache = new Cache('', { openDecoder });
    this.saved = this.cache.load(bytes, performance.now() / 1000);
  }

  get scene(): string {
    return this.catalog.scene.name;
  }

  get catalog(): Catalog {
    return this.cache.catalog!;
  }

  get unshown(): readonly FieldInfo[] {
    return this.cache.unshown;
  }

  on<K extends keyof SessionEvents>(event: K, listener: (value: SessionEvents[K]) => void): () => void {
    return this.emitter.on(event, listener);
  }

  edit(): Promise<void> {
    return Promise.reject(new EditError('saved', 'this light is saved: there is no server to change it'));
  }

  light(now: number = performance.now()): LightState {
    return this.cache.light(now / 1000);
  }

  sceneTime(): number | undefined {
    return this.cache.standingTime;
  }

  setCamera(): void {}

  timings(): readonly [] {
    return [];
  }

  close(reason = 'the session was closed'): void {
    if (this.status.state === 'closed') return;
    this.cache.close();
    this.status = { state: 'closed', reason };
    this.emitter.emit('status', this.status);
  }
}
