/**
 * What the session needs of a transport. `moqConnector` is the real one; tests bring their own.
 */

/** One connection to a server; it is not made again once it is lost. */
export interface Link {
  readonly kind: 'webtransport' | 'websocket';
  /** Where the server answers plain requests, if otherwise than {@link Target.base} says. */
  readonly base?: URL;
  /** Name of the scene that the server says it casts, if it says so. */
  casts?(): Promise<string | undefined>;
  /** Reads a track of the scene's broadcast, frame by frame, through stale groups, until closed. */
  subscribe(track: string, options: ReadOptions, onFrame: (frame: Uint8Array) => void): TrackReader;
  /** Sends a frame on this client's `edits` track. */
  sendEdit(frame: Uint8Array): void;
  /** Bits a second that the way from the server carries, as the server's end estimates; often unknown. */
  bandwidth(): number | undefined;
  /** Settles when the connection has ended, with the reason. */
  readonly ended: Promise<string>;
  close(): void;
}

export interface ReadOptions {
  /** 0 to 255: where a link is too slow for all, tracks of higher priority go first. */
  readonly priority: number;
  /** Milliseconds that an unfinished group may fall behind the newest before it is given up. */
  readonly maxAge: number;
}

/** A subscription to a track. */
export interface TrackReader {
  setPriority(priority: number): void;
  close(): void;
}

/**
 * Makes connections. Rejects when none comes about, or `signal` is aborted; with a `ConnectError` where
 * it knows why.
 */
export type Connector = (target: Target, signal: AbortSignal) => Promise<Link>;

/** What to connect to. */
export interface Target {
  /** The server's address; its path ends in a slash, and is longer behind a reverse proxy. */
  readonly base: URL;
  /** The scene's broadcast. */
  readonly scene: string;
  /** This client's name: 1 to 64 characters of A–Z a–z 0–9 - _. */
  readonly client: string;
  /** What proves that a connection is this client's, where others know its name; of the same form. */
  readonly key: string;
  /** A token that allows edits. */
  readonly token: string | undefined;
  /** Which transport to use; `auto` tries WebTransport first. */
  readonly transport: 'auto' | 'webtransport' | 'websocket';
  /** SHA-256 of the server's certificate in hexadecimal, where no authority vouches for it. */
  readonly certificateHash: string | undefined;
}
