import type { Catalog, FieldInfo } from './codec/catalog.js';
import type { LightmapLayout } from './codec/layout.js';
import type { Edit, Vec3 } from './edit.js';

/** The light of one field at one moment; `kind` says which members it has. See `isVolume`, `isLightmap`. */
export type FieldLight = VolumeLight | LightmapLight;

/** How old the light of a field is, whatever its kind. */
export interface FieldAge {
  /**
   * Seconds since this light was computed, of its oldest region. This and the next two are `undefined`
   * for what is left from the time before a restart of the server.
   */
  readonly age: number | undefined;
  /** Version of the scene that the light was computed from, of its oldest region. */
  readonly sceneVersion: number | undefined;
  /** Server tick in which it was computed, of its oldest region. */
  readonly tick: number | undefined;
}

/**
 * The light of a volume at one moment.
 *
 * The arrays belong to the cache and change with the next call of `light`: read them, don't keep them.
 */
export interface VolumeLight extends FieldAge {
  readonly kind: 'volume';
  /** What the newest catalog says of the field: its use, its grid, its order. */
  readonly field: FieldInfo<'volume'>;
  /**
   * Coefficients of arriving radiance, cd/m²: `(order+1)²` times r, g, b a probe, probe by probe with
   * x fastest, then y, then z.
   */
  readonly coefficients: Float32Array;
  /** A power of two near the largest of these coefficients, by which halves are divided. */
  readonly scale: number;
  /** Grows whenever the coefficients changed: equal revisions need no new upload. */
  readonly revision: number;
  /** Regions that hold light, of all that the field has. */
  readonly regions: { readonly lit: number; readonly all: number };
}

/** The light of a lightmap at one moment: pictures of parts of its pages, and where surfaces lie on these. */
export interface LightmapLight extends FieldAge {
  readonly kind: 'lightmap';
  /** What the newest catalog says of the field: its use, its coding, its pages. */
  readonly field: FieldInfo<'lightmap'>;
  /**
   * Where surfaces lie on the pages; `undefined` until that has come. Another object when anything of it
   * has changed.
   */
  readonly layout: LightmapLayout | undefined;
  /** Regions that have light. */
  readonly regions: readonly LumelRegion[];
  /** The largest scale of regions of irradiance: a power of two, by which half floats are divided. */
  readonly scale: number;
}

/** A part of a page that is sent as one picture. */
export interface LumelRegion {
  readonly region: number;
  readonly page: number;
  /** Whether its picture tells slopes of the page (`slopeOf` tells what its values mean), not irradiance. */
  readonly slopes?: true;
  /** Its first lumel. */
  readonly min: readonly [number, number];
  /** Lumels along x and y. */
  readonly size: readonly [number, number];
  /** Grows with each new picture: an equal revision needs no new upload. */
  readonly revision: number;
  readonly picture: LumelPicture;
  /**
   * How far along the way from what was shown when the picture came to the picture itself, 0 to 1. It grows
   * until the revision does.
   */
  readonly shown: number;
}

export type LumelPicture = HalvesPicture | PlanesPicture;

/** Half floats, without loss. */
export interface HalvesPicture {
  readonly kind: 'halves';
  readonly scale: number;
  /**
   * r, g, b, 1 of each lumel as half floats, row after row: irradiance in lux over `scale`. They belong to
   * the cache, which writes over them once two newer pictures have come: read them, don't keep them.
   */
  readonly texels: Uint16Array<ArrayBuffer>;
}

/** A decoded video picture; `irradianceOf` tells what its codes mean. */
export interface PlanesPicture extends Planes {
  readonly kind: 'planes';
  readonly scale: number;
  /** log2 of what irradiance over `scale` is multiplied by before its logarithm is taken. */
  readonly toe: number;
  /** Powers of two that the codes 0 to 255 span. */
  readonly octaves: number;
}

/** The planes of a picture, codes of 8 bits in rows without gaps. */
export interface Planes {
  readonly y: Uint8Array<ArrayBuffer>;
  readonly co: Uint8Array<ArrayBuffer>;
  readonly cg: Uint8Array<ArrayBuffer>;
  /** Columns and rows of `y`. */
  readonly width: number;
  readonly height: number;
  /** Columns and rows of `co` and `cg`: half as many, rounded up, or as many. */
  readonly chromaWidth: number;
  readonly chromaHeight: number;
}

/** All light at one moment. */
export interface LightState {
  /** In the catalog's order; fields of which nothing has arrived yet are left out. */
  readonly fields: readonly FieldLight[];
  /**
   * Seconds since the newest light was computed; `undefined` when none came from a server. That of the
   * oldest region stands with each field.
   */
  readonly age: number | undefined;
}

/** What keeps a session from its light, as well as a browser lets a page know. */
export type Problem =
  /** Nobody answers, or a certificate is not trusted. */
  | 'unreachable'
  /** A server answers, but lets no page of this origin in. */
  | 'origin'
  /** What answers is no Lumencast server. */
  | 'stranger'
  /** The server runs and lets the page ask, but takes no session: a token is missing or bad, or it is full. */
  | 'refused'
  /** The server has no scene of this name. */
  | 'scene'
  /** The server has the scene, but sends nothing. */
  | 'silent'
  /** The server speaks another version of the wire format. */
  | 'version';

/** Why no connection came about: what happened, and what to do. */
export class ConnectError extends Error {
  override readonly name = 'ConnectError';
  constructor(
    readonly problem: Problem,
    message: string,
    options?: ErrorOptions,
  ) {
    super(message, options);
  }
}

/** How a session stands. */
export type Status =
  | {
      readonly state: 'connecting';
      /** 1 for the first attempt after the start or a loss. */
      readonly attempt: number;
    }
  | { readonly state: 'connected'; readonly transport: 'webtransport' | 'websocket' }
  | {
      /** Nothing is received; the light stays and the session tries again by itself. */
      readonly state: 'lost';
      readonly reason: string;
      /** Why no connection came about; absent when one that stood has ended. */
      readonly problem?: Problem;
      /** Seconds until the next attempt. */
      readonly retryIn: number;
    }
  | {
      /** Saved light, without any server: see `openLight`. */
      readonly state: 'saved';
    }
  | {
      /** For good: closed by the program, or the server speaks another wire version. */
      readonly state: 'closed';
      readonly reason: string;
      /** Absent when the program has closed it. */
      readonly problem?: Problem;
    };

/** An edit that the server has accepted, in the server's order. */
export interface AcceptedEdit {
  readonly edit: Edit;
  /** Who made it; absent for the server's own (a script's). */
  readonly client?: string;
  readonly seq?: number;
  /** Made by this session. */
  readonly own: boolean;
}

/** An edit of this session that the server has refused. */
export interface RefusedEdit {
  readonly seq: number;
  readonly edit: Edit;
  readonly reason: string;
}

/** Newer light of a region of a field. */
export interface LightNews {
  readonly field: number;
  readonly region: number;
  /** Server tick in which it was computed. */
  readonly tick: number;
}

/** What a session tells; the values are the listeners' argument. */
export interface SessionEvents {
  /** The server's fields are known, or have changed in more than their scales and layouts. */
  catalog: Catalog;
  /**
   * Edits that turn the scene as it stands in its file into the scene as it is now. Comes on joining,
   * after a loss and after a restart of the server: start again from the file's state.
   */
  snapshot: readonly Edit[];
  /** Another accepted edit, this session's own among them. */
  edit: AcceptedEdit;
  /** One of this session's edits was refused: undo what it showed. */
  refused: RefusedEdit;
  /** An update of a field arrived. */
  light: LightNews;
  status: Status;
}

/** How an edit is meant. */
export interface EditOptions {
  /**
   * The node that the edit adds goes by itself once every client that has sent edits of it has been
   * gone for ten seconds. Else it stays for as long as the server runs.
   */
  temporary?: boolean;
}

/** Figures for a panel or a log. */
export interface SessionStats {
  /** Server ticks a second, measured over the last seconds; `undefined` before two have come. */
  readonly tickRate: number | undefined;
  /** Updates of light a second that arrive, of the region that gets most. */
  readonly updateRate: number;
  /** Age of the light in seconds; see {@link LightState.age}. */
  readonly age: number | undefined;
  /** Received bytes a second over all tracks. */
  readonly bandwidth: number;
  /** Received bytes a second by track. */
  readonly bandwidthByTrack: ReadonlyMap<string, number>;
  /** How long the server's last tick took, milliseconds. */
  readonly tickMs: number | undefined;
  /** Samples a probe in the server's last tick. */
  readonly samples: number | undefined;
  /** Queueing delay of arriving light over the least one seen, seconds. */
  readonly delay: number | undefined;
  /** Temporal layers that are subscribed to, 1 to 3; fewer than there are when the link is too slow. */
  readonly layers: number;
  /** Edits that the server has not dealt with yet. */
  readonly pending: number;
  /** Frames that could not be used: malformed ones, and deltas whose base was lost. */
  readonly dropped: number;
}

/** When one update was computed and when it came; for measuring the way from the tick to the page. */
export interface Timing {
  readonly field: number;
  readonly region: number;
  readonly layer: number;
  readonly tick: number;
  /** The server's clock in seconds at the end of that tick, if its state frame has come. */
  readonly clock: number | undefined;
  /** `performance.timeOrigin + performance.now()` in milliseconds when the frame was handed over. */
  readonly arrived: number;
  /** The same after decoding; of a video after its unit was handed to a decoder. */
  readonly decoded: number;
  /** Bytes of the frame. */
  readonly bytes: number;
}

/** What a `.light` file keeps of its scene beside the light. */
export interface SavedScene {
  /** Edits that turn the scene as it stands in its file into the scene that the light is of. */
  readonly edits: readonly Edit[];
  /** Files of the scene's folder that the edits name, by their names. */
  readonly files: ReadonlyMap<string, Uint8Array>;
}

/** A connection to the light of one scene, or saved light that stands in for one. */
export interface Session {
  /** The server's address, without a path. */
  readonly origin: string;
  /** Address of the folder that the scene's files are in, with a slash at its end. */
  readonly files: string;
  /** Name of the scene. */
  readonly scene: string;
  /** This client's name in edits. */
  readonly client: string;
  readonly status: Status;
  /** Resolves once the server has said what it offers; rejects when the session is closed before. */
  readonly ready: Promise<void>;
  /** What the server offers, until it has said so what the saved light holds; else `undefined`. */
  readonly catalog: Catalog | undefined;
  /**
   * Fields of the catalog that this page cannot show: lightmaps that travel as video, where the browser
   * decodes none. `capabilities().notices` say why.
   */
  readonly unshown: readonly FieldInfo[];
  /** What the saved light that the session started from says of the scene. */
  readonly saved: SavedScene | undefined;
  readonly stats: SessionStats;

  /** Calls `listener` at each event of the kind; returns the function that ends this. */
  on<K extends keyof SessionEvents>(event: K, listener: (value: SessionEvents[K]) => void): () => void;
  /**
   * Sends an edit. Resolves once the server has accepted it; rejects with an {@link EditError} when
   * it refuses, gives no answer, has restarted, or the session is closed before. Without a connection
   * the edit waits for one.
   */
  edit(edit: Edit, options?: EditOptions): Promise<void>;
  /** Edits that the server has not dealt with yet, oldest first. */
  readonly pending: readonly Edit[];
  /** The newest light, blended to this moment. `now` is `performance.now()` in milliseconds. */
  light(now?: number): LightState;
  /**
   * Scene time in seconds at which animations stand on the server, estimated for `now`; less `delay`
   * seconds (0.1 unless given), so that it seldom runs ahead of what has arrived. It is that of saved
   * light until the server has said its own.
   */
  sceneTime(now?: number, delay?: number): number | undefined;
  /** Where the camera is, in world space: near regions come first. */
  setCamera(position: Vec3): void;
  /**
   * The last 1,000 arrivals, oldest first. On joining, the group under way is sent from its beginning:
   * its frames come late, and are no measure of the way.
   */
  timings(): readonly Timing[];
  /** Ends the session; pending edits reject, with the reason if there is one. The light stays. */
  close(reason?: string): void;
}

/** Why an edit came to nothing. */
export class EditError extends Error {
  override readonly name = 'EditError';
  constructor(
    /**
     * `refused` by the server, `unanswered` though it is connected, `restarted` server, `closed`
     * session, `full` list of pending edits, or `saved` light without a server.
     */
    readonly kind: 'refused' | 'unanswered' | 'restarted' | 'closed' | 'full' | 'saved',
    reason: string,
  ) {
    super(reason);
  }
}
