import type { Connector, Link, ReadOptions, Target, TrackReader } from '../../src/transport.js';
import type { FakeServer, SentFrame } from './fake-server.js';

/** One subscription of a fake connection. */
export interface FakeReader extends ReadOptions {
  readonly onFrame: (frame: Uint8Array) => void;
}

/** A connection of which a test holds the other end. */
export class FakeLink implements Link {
  readonly kind = 'webtransport';
  readonly readers = new Map<string, FakeReader>();
  readonly edits: { seq: number; edit: unknown; temporary?: boolean }[] = [];
  readonly ended: Promise<string>;
  private end: (reason: string) => void = () => {};
  closed = false;
  bitsPerSecond: number | undefined;
  /** The scene that the server says it casts. */
  scene: string | undefined;

  constructor(readonly target: Target) {
    this.ended = new Promise((resolve) => (this.end = resolve));
  }

  subscribe(track: string, options: ReadOptions, onFrame: (frame: Uint8Array) => void): TrackReader {
    if (this.readers.has(track)) throw new Error(`${track} is read twice`);
    const reader = { ...options, onFrame };
    this.readers.set(track, reader);
    return {
      setPriority: (priority) => Object.assign(reader, { priority }),
      close: () => {
        if (this.readers.get(track) === reader) this.readers.delete(track);
      },
    };
  }

  sendEdit(frame: Uint8Array): void {
    this.edits.push(JSON.parse(new TextDecoder().decode(frame)));
  }

  casts(): Promise<string | undefined> {
    return Promise.resolve(this.scene);
  }

  bandwidth(): number | undefined {
    return this.bitsPerSecond;
  }

  close(): void {
    this.closed = true;
    this.end('closed here');
  }

  break(reason: string): void {
    this.end(reason);
  }

  /** Hands a frame over, if its track is read. */
  deliver(track: string, bytes: Uint8Array): void {
    if (!this.closed) this.readers.get(track)?.onFrame(bytes);
  }

  deliverAll(frames: readonly SentFrame[]): void {
    for (const { track, bytes } of frames) this.deliver(track, bytes);
  }

  /** One tick of a server, delivered at once. */
  tick(server: FakeServer): void {
    const { state, probes } = server.step();
    this.deliver('state', state);
    this.deliverAll(probes);
  }
}

/** A connector whose connections a test answers. */
export class FakeNet {
  readonly links: FakeLink[] = [];
  refuse: string | Error | undefined;

  readonly connector: Connector = async (target) => {
    if (this.refuse !== undefined) throw this.refuse instanceof Error ? this.refuse : new Error(this.refuse);
    const link = new FakeLink(target);
    this.links.push(link);
    return link;
  };

  get link(): FakeLink {
    const link = this.links.at(-1);
    if (!link) throw new Error('nothing has connected');
    return link;
  }
}
