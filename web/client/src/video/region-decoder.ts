import type { Planes } from '../api.js';
import type { PictureDecoder, VideoFormat } from '../cache/picture-decoder.js';
import { codecOf } from './access-unit.js';
import { Group } from './group.js';
import { planesOf, type RawPicture } from './planes.js';

/** Milliseconds without a picture after which a decoder is given up. */
const PATIENCE = 1000;
/** Units that wait at most: more than a group has while pictures come. */
const MOST_WAITING = 64;

/**
 * Decodes the pictures of one region by WebCodecs. A decoder that gives an error, or nothing for a second, is
 * replaced at once: one of the machine's own by one in software, and the other way round. The new one begins
 * with the keyframe of the group that is under way. Where it fails too, nothing comes until the next one.
 */
export class RegionDecoder implements PictureDecoder {
  private decoder: VideoDecoder | undefined;
  /** The group that is under way; `undefined` where a keyframe is needed. */
  private group: Group | undefined;
  private inSoftware = false;
  /** Takes what comes of a unit, by the timestamp of its chunk. */
  private readonly waiting = new Map<number, (planes: Planes | undefined) => void>();
  /** Chunks are numbered in place of times. */
  private nextTimestamp = 0;
  /** Ends the patience; runs while units wait. */
  private timer: ReturnType<typeof setTimeout> | undefined;

  constructor(private readonly format: VideoFormat) {}

  decode(unit: Uint8Array, keyframe: boolean): Promise<Planes | undefined> {
    if (this.waiting.size >= MOST_WAITING) this.stop();
    if (keyframe) this.beginGroup(codecOf(unit));
    const { group } = this;
    if (!group) return Promise.resolve(undefined);
    const timestamp = this.nextTimestamp++;
    const chunk = new EncodedVideoChunk({ type: keyframe ? 'key' : 'delta', timestamp, data: unit });
    group.add(chunk);
    return new Promise((resolve) => {
      this.waiting.set(timestamp, resolve);
      if (this.waiting.size === 1) this.restartTimer();
      this.feed(group, [chunk]);
    });
  }

  close(): void {
    this.stop();
  }

  /** A decoder goes on with a group of its codec. */
  private beginGroup(codec: string | undefined): void {
    if (codec !== this.group?.codec) this.stop();
    this.group = codec === undefined ? undefined : new Group(codec);
  }

  /** Gives chunks of a group to the decoder, which is opened where there is none. */
  private feed({ codec }: Group, chunks: readonly EncodedVideoChunk[]): void {
    try {
      const decoder = this.decoder ?? this.open(codec);
      for (const chunk of chunks) decoder.decode(chunk);
    } catch {
      this.replace();
    }
  }

  private open(codec: string): VideoDecoder {
    const decoder = new VideoDecoder({
      output: (frame) => void this.came(decoder, frame),
      error: () => {
        if (decoder === this.decoder) this.replace();
      },
    });
    this.decoder = decoder;
    decoder.configure({
      codec,
      optimizeForLatency: true,
      hardwareAcceleration: this.inSoftware ? 'prefer-software' : 'no-preference',
    });
    return decoder;
  }

  private async came(decoder: VideoDecoder, frame: VideoFrame): Promise<void> {
    this.restartTimer();
    const { timestamp } = frame;
    try {
      // Nobody waits for a picture that the decoder before gave already.
      const resolve = this.waiting.get(timestamp);
      if (resolve) {
        resolve(planesOf(await rawPicture(frame), this.format));
        this.waiting.delete(timestamp);
        this.restartTimer();
      }
    } catch {
      if (decoder === this.decoder) this.replace();
    } finally {
      frame.close();
    }
  }

  /** The decoder is of no use: another kind begins with the group, or with the next one. */
  private replace(): void {
    this.inSoftware = !this.inSoftware;
    const { group } = this;
    const chunks = group?.take();
    if (!group || !chunks) {
      this.stop();
      return;
    }
    this.closeDecoder();
    this.abandonBefore(chunks[0].timestamp);
    this.restartTimer();
    this.feed(group, chunks);
  }

  /** Ends the decoder; nothing comes of what waits. */
  private stop(): void {
    this.closeDecoder();
    this.group = undefined;
    this.abandonBefore(Infinity);
    this.restartTimer();
  }

  private closeDecoder(): void {
    const { decoder } = this;
    this.decoder = undefined;
    if (decoder && decoder.state !== 'closed') decoder.close();
  }

  /** Nothing comes of the units that wait and are older. */
  private abandonBefore(end: number): void {
    for (const [timestamp, resolve] of this.waiting) {
      if (timestamp >= end) continue;
      this.waiting.delete(timestamp);
      resolve(undefined);
    }
  }

  /** The patience begins anew while units wait. */
  private restartTimer(): void {
    clearTimeout(this.timer);
    this.timer = this.waiting.size > 0 ? setTimeout(() => this.replace(), PATIENCE) : undefined;
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
