/** What the cache needs of a decoder of video; `videoDecoders` has the real one, tests bring their own. */
import type { Planes } from '../api.js';
import type { VideoCoding } from '../codec/lightmap-shape.js';

/** Decodes the pictures of one region, in order. */
export interface PictureDecoder {
  /**
   * Decodes an access unit that follows the one before; a keyframe begins anew. Resolves with its picture,
   * or with nothing where none comes of it: then nothing comes of what follows either, up to the next
   * keyframe. Never rejects.
   */
  decode(unit: Uint8Array, keyframe: boolean): Promise<Planes | undefined>;
  close(): void;
}

/** How pages lie in the pictures of a video. */
export interface VideoFormat {
  readonly coding: VideoCoding;
  /** Lumels along both sides of a page; pictures are as large or larger. */
  readonly pageSize: number;
}

/** Opens a decoder of a region. */
export type OpenDecoder = (format: VideoFormat) => PictureDecoder;
