import type { Planes } from '../api.js';
import type { PictureDecoder, VideoFormat } from '../cache/picture-decoder.js';
import { codecOf } from './access-unit.js';
import { planesOf, type RawPicture } from './planes.js';

/** Milliseconds without a picture after which a decoder is given up. */
const PATIENCE = 1000;
/** Units that wait at most: more than a group has. */
const MOST_WAITING = 64;

/** A unit of which the picture has not come. */
interface Waiting {
  readonly since: number;
  readonly resolve: (planes: Planes | undefined) => void;
}

/**
 * Decodes the pictures of one region by WebCodecs. A decoder that gives an error, or nothing for a second, is
 * replaced at the next keyframe: one of the machine's own by one in software, and the other way round.
 */
export class RegionDecoder implements PictureDecoder {
  private decoder: VideoDecoder | undefined;
  private codec: string | undefined;
  private inSoftware = false;
  /** By the number under which each was given to the decoder. */
  private readonly waiting = new Map<number, Waiting>();
  private given = 0;
  /** When the last picture came. */
  private heard = -Infinity;

  /** `now`: milliseconds on any clock. */
  constructor(
    private readonly format: VideoFormat,
    private readonly now: () => number = () => performance.now(),
  ) {}

  decode(unit: Uint8Array, keyframe: boolean): Promise<Planes | undefined> {
    if (this.isSilent()) this.giveUp();
    if (this.waiting.size >= MOST_WAITING) this.stop();
    if (keyframe) this.begin(codecOf(unit));
    const { decoder } = this;
    if (!decoder) return Promise.resolve(undefined);
    const timestamp = this.given++;
    return new Promise((resolve) => {
      this.waiting.set(timestamp, { since: this.now(), resolve });
      try {
        decoder.decode(new EncodedVideoChunk({ type: keyframe ? 'key' : 'delta', timestamp, data: unit }));
      } catch {
        this.giveUp();
      }
    });
  }

  close(): void {
    this.stop();
  }

  /** Whether units wait, and nothing comes. */
  private isSilent(): boolean {
    const [oldest] = this.waiting.values();
    return oldest !== undefined && this.now() - Math.max(oldest.since, this.heard) > PATIENCE;
  }

  /** Makes sure that there is a decoder of a keyframe's codec. */
  private begin(codec: string | undefined): void {
    if (this.decoder && codec === this.codec) return;
    this.stop();
    if (codec === undefined) return;
    const decoder = new VideoDecoder({
      output: (frame) => void this.came(decoder, frame),
      error: () => {
        if (decoder === this.decoder) this.giveUp();
      },
    });
    this.decoder = decoder;
    this.codec = codec;
    try {
      decoder.configure({
        codec,
        optimizeForLatency: true,
        hardwareAcceleration: this.inSoftware ? 'prefer-software' : 'no-preference',
      });
    } catch {
      this.giveUp();
    }
  }

  private async came(decoder: VideoDecoder, frame: VideoFrame): Promise<void> {
    this.heard = this.now();
    const waiting = this.waiting.get(frame.timestamp);
    this.waiting.delete(frame.timestamp);
    try {
      // One that nobody waits for is of a decoder that was given up.
      if (waiting) waiting.resolve(planesOf(await rawPicture(frame), this.format));
    } catch {
      waiting?.resolve(undefined);
      if (decoder === this.decoder) this.giveUp();
    } finally {
      frame.close();
    }
  }

  /** The decoder is of no use: the next keyframe has another kind. */
  private giveUp(): void {
    this.inSoftware = !this.inSoftware;
    this.stop();
  }

  /** Ends the decoder; nothing comes of what waits. */
  private stop(): void {
    const { decoder } = this;
    this.decoder = undefined;
    if (decoder && decoder.state !== 'closed') decoder.close();
    for (const { resolve } of this.waiting.values()) resolve(undefined);
    this.waiting.clear();
  }
}

/** Copies a picture out of the decoder's memory, as it is: codes are no colours. */
async function rawPicture(frame: VideoFrame): Promise<RawPicture> {
  const { format, visibleRect } = frame;
  if ((format !== 'I420' && format !== 'NV12') || !visibleRect) throw new TypeError(`a picture as ${format}`);
  const bytes = new Uint8Array(frame.allocationSize());
  const layout = await frame.copyTo(bytes);
  return { bytes, format, layout, width: visibleRect.width, height: visibleRect.height };
}
