import { Broadcast, Connection, Group, Path, Time, type Track } from '@moq/net';

import { LIMITS } from '../codec/limits.js';
import { EDITS_TRACK } from '../codec/tracks.js';
import type { Connector, Link, ReadOptions, Target, TrackReader } from '../transport.js';
import { developmentServer } from './certificate.js';
import { castScene, diagnose } from './diagnosis.js';

/**
 * Milliseconds before a WebSocket is tried beside WebTransport. Long, because a page that is busy
 * loading would else end up with the lesser transport, and the library keeps to what won once.
 */
const WEBSOCKET_DELAY = 2000;
/** Milliseconds before a track that could not be had is asked for again. */
const RETRY = 250;
/** Frames of a group of edits: a reader that falls behind by more loses some. */
const GROUP_FRAMES = 512;

/** Connects by Media over QUIC, over WebTransport or, where that fails, a WebSocket. */
export const moqConnector: Connector = async (target, signal) => {
  const { base, transport, certificateHash } = target;
  const found = certificateHash ? undefined : await developmentServer(base, signal);
  const hash = certificateHash ?? found?.hash;
  // Without TLS, and without a certificate of the server's own, there is no WebTransport.
  const isPlain = base.protocol === 'http:' && !hash && transport === 'auto';
  try {
    const connection = await Connection.connect(dialled(base, target, isPlain ? 'websocket' : transport), {
      signal,
      webtransport: hash ? { serverCertificateHashes: [{ value: hash }] } : {},
      websocket: {
        enabled: transport !== 'webtransport',
        delay: transport === 'websocket' || isPlain ? 0 : WEBSOCKET_DELAY,
        url: dialled(found?.base ?? base, target, 'websocket'),
      },
    });
    return new MoqLink(connection, target, found?.base ?? base);
  } catch (error) {
    throw await diagnose(target, found?.base ?? base, error);
  }
};

/** The base is dialled and not the scene, so that names mean the same through any relay. */
function dialled(base: URL, { token }: Target, transport: Target['transport']): URL {
  const url = new URL(base);
  if (token) url.searchParams.set('jwt', token);
  // WebTransport refuses these schemes, which leaves the WebSocket; at http it asks for a hash itself.
  if (transport === 'websocket') url.protocol = url.protocol === 'https:' ? 'wss:' : 'ws:';
  else url.protocol = 'https:';
  return url;
}

class MoqLink implements Link {
  readonly kind: 'webtransport' | 'websocket';
  readonly ended: Promise<string>;
  private readonly scene: Path.Valid;
  private readonly edits: EditTrack;

  constructor(
    private readonly connection: Connection.Established,
    target: Target,
    readonly base: URL,
  ) {
    this.kind = connection.transport;
    this.scene = Path.from(target.scene);
    this.edits = new EditTrack();
    connection.publish(
      Path.from(target.scene, 'edits', `${target.client}.${target.key}`),
      this.edits.broadcast,
    );
    this.ended = connection.closed.then(
      () => 'the server closed the connection',
      (error: unknown) => `the connection broke: ${(error as Error)?.message || 'no reason given'}`,
    );
  }

  casts(): Promise<string | undefined> {
    return castScene(this.base);
  }

  subscribe(track: string, options: ReadOptions, onFrame: (frame: Uint8Array) => void): TrackReader {
    return new MoqReader(() => this.connection.consume(this.scene), track, options, onFrame);
  }

  sendEdit(frame: Uint8Array): void {
    this.edits.send(frame);
  }

  bandwidth(): number | undefined {
    return this.connection.probe.peek().estimatedRecvRate;
  }

  close(): void {
    this.edits.broadcast.close();
    this.connection.close();
  }
}

/** Reads one track for as long as it is wanted, through stale groups and failed subscriptions. */
export class MoqReader implements TrackReader {
  private subscriber: Track.Subscriber | undefined;
  private closed = false;

  constructor(
    private readonly consume: () => Broadcast.Consumer,
    private readonly track: string,
    private options: ReadOptions,
    private readonly onFrame: (frame: Uint8Array) => void,
  ) {
    void this.run();
  }

  private async run(): Promise<void> {
    while (!this.closed) {
      const scene = this.consume();
      try {
        this.subscriber = scene.subscribe(this.track, this.subscription());
        await this.read(this.subscriber);
      } catch {
        // Not there (yet), or its origin died: ask again.
      }
      this.subscriber?.close();
      scene.close();
      if (!this.closed) await new Promise((resolve) => setTimeout(resolve, RETRY));
    }
  }

  /**
   * Groups are read one after the other. But a link that is too slow may hold one up, even for good,
   * and bring newer ones meanwhile: those wait for it no longer than `maxAge`.
   */
  private async read(subscriber: Track.Subscriber): Promise<void> {
    let newest = -1;
    let before: Promise<void> = Promise.resolve();
    for (;;) {
      const group = await subscriber.nextGroup();
      if (!group) return before;
      const former = before;
      const waited = this.waitedFor(group).then((long) => (long ? undefined : former));
      before = Promise.race([former, waited]).then(() => {
        if (group.sequence < newest) return;
        newest = group.sequence;
        return this.readGroup(group, () => group.sequence === newest);
      });
    }
  }

  /** Resolves once a group has had a frame for `maxAge`, or has ended; tells whether it has one. */
  private async waitedFor(group: Group.Consumer): Promise<boolean> {
    await group.readable();
    if (group.done) return false;
    const { maxAge } = this.options;
    if (maxAge > 0) await new Promise((resolve) => setTimeout(resolve, maxAge));
    return true;
  }

  private async readGroup(group: Group.Consumer, isNewest: () => boolean): Promise<void> {
    for (;;) {
      let frame: Group.Frame | undefined;
      try {
        frame = await group.readFrame();
      } catch {
        // The group went stale before it was all sent (52, `Old`): the next one has what is newer.
        return;
      }
      if (!frame || this.closed || !isNewest()) return;
      if (frame.payload.length <= LIMITS.frameBytes) this.onFrame(frame.payload);
    }
  }

  setPriority(priority: number): void {
    if (priority === this.options.priority) return;
    this.options = { ...this.options, priority };
    this.subscriber?.update(this.subscription());
  }

  private subscription(): Track.Subscription {
    return { priority: this.options.priority, latencyMax: this.options.maxAge };
  }

  close(): void {
    this.closed = true;
    this.subscriber?.close();
  }
}

/** The broadcast by which a client sends its edits. */
export class EditTrack {
  readonly broadcast = new Broadcast.Producer();
  private readonly track = this.broadcast.createTrack(EDITS_TRACK);
  private group: Group.Producer | undefined;
  private frames = 0;
  /** Groups are numbered on from the clock, so that none of a former connection is newer. */
  private sequence = Date.now();

  send(frame: Uint8Array): void {
    if (!this.group || this.frames === GROUP_FRAMES) {
      this.group?.close();
      this.group = new Group.Producer(this.sequence++);
      this.frames = 0;
      this.track.writeGroup(this.group);
    }
    this.group.writeFrame({ payload: frame, timestamp: Time.Timestamp.now() });
    this.frames++;
  }
}
