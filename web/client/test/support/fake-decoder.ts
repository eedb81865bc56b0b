import type { Planes } from '../../src/api.js';
import type { OpenDecoder, PictureDecoder, VideoFormat } from '../../src/cache/picture-decoder.js';

/** A unit that a decoder was given. */
export interface GivenUnit {
  readonly region: number;
  readonly unit: Uint8Array;
  readonly keyframe: boolean;
  readonly answer: (planes: Planes | undefined) => Promise<void>;
}

/** Decoders of which a test holds the other end. */
export class FakeDecoders {
  readonly formats: VideoFormat[] = [];
  readonly closed: number[] = [];
  /** Units that no answer has come to, oldest first. */
  readonly given: GivenUnit[] = [];

  readonly open: OpenDecoder = (format): PictureDecoder => {
    const region = this.formats.push(format) - 1;
    return {
      decode: (unit, keyframe) =>
        new Promise((resolve) => {
          const answer = async (planes: Planes | undefined) => {
            resolve(planes);
            // Whoever waits for it hears of it.
            await Promise.resolve();
          };
          this.given.push({ region, unit: unit.slice(), keyframe, answer });
        }),
      close: () => this.closed.push(region),
    };
  };

  /** Answers the oldest unit: by a picture that is its last byte everywhere, or by nothing. */
  async answer(isPicture = true): Promise<void> {
    const { unit, region, answer } = this.given.shift()!;
    await answer(isPicture ? grey(this.formats[region].pageSize, unit[unit.length - 1]) : undefined);
  }
}

/** A picture without colour. */
export function grey(side: number, code: number): Planes {
  const plane = (value: number) => new Uint8Array(side * side).fill(value);
  const sizes = { width: side, height: side, chromaWidth: side, chromaHeight: side };
  return { y: plane(code), co: plane(128), cg: plane(128), ...sizes };
}
