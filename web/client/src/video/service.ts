/** Decoders behind messages, so that a worker may have them. */
import type { Planes } from '../api.js';
import type { PictureDecoder, VideoFormat } from '../cache/picture-decoder.js';

/** What a page asks; `region` numbers the decoders that it has opened. */
export type Question =
  | { readonly kind: 'open'; readonly region: number; readonly format: VideoFormat }
  | {
      readonly kind: 'decode';
      readonly region: number;
      /** Comes back with the answer. */
      readonly number: number;
      readonly unit: Uint8Array;
      readonly keyframe: boolean;
    }
  | { readonly kind: 'close'; readonly region: number };

/** What came of a unit. */
export interface Answer {
  readonly number: number;
  readonly planes: Planes | undefined;
}

/** Answers questions; `post` passes answers on, with the buffers that go along. */
export class DecoderService {
  private readonly decoders = new Map<number, PictureDecoder>();

  constructor(
    private readonly open: (format: VideoFormat) => PictureDecoder,
    private readonly post: (answer: Answer, buffers: ArrayBuffer[]) => void,
  ) {}

  take(question: Question): void {
    const { kind, region } = question;
    const decoder = this.decoders.get(region);
    switch (kind) {
      case 'open':
        this.decoders.set(region, this.open(question.format));
        break;
      case 'decode':
        void decoder?.decode(question.unit, question.keyframe).then((planes) => {
          const buffers = planes ? [planes.y.buffer, planes.co.buffer, planes.cg.buffer] : [];
          this.post({ number: question.number, planes }, buffers);
        });
        break;
      case 'close':
        decoder?.close();
        this.decoders.delete(region);
    }
  }
}
