import type { VideoFormat } from '../../src/cache/picture-decoder.js';

/** How a picture lies in memory: where planes begin, and the bytes from row to row. */
export interface RawVideo {
  readonly format: string | null;
  readonly bytes: Uint8Array;
  readonly layout: { offset: number; stride: number }[];
  readonly width: number;
  readonly height: number;
}

/** A chunk as WebCodecs takes it. */
export class FakeChunk {
  readonly type: string;
  readonly timestamp: number;
  readonly data: Uint8Array;

  constructor({ type, timestamp, data }: { type: string; timestamp: number; data: Uint8Array }) {
    [this.type, this.timestamp, this.data] = [type, timestamp, data];
  }

  get byteLength(): number {
    return this.data.length;
  }
}

/** A decoder of WebCodecs of which a test holds the other end. */
export class FakeVideoDecoder {
  static made: FakeVideoDecoder[] = [];
  /** Whether a call fails, of decoders with this `hardwareAcceleration`. */
  static fails: (call: 'configure' | 'decode', kind: string) => boolean = () => false;
  state: 'unconfigured' | 'configured' | 'closed' = 'unconfigured';
  config: { codec: string; hardwareAcceleration: string; optimizeForLatency: boolean } | undefined;
  readonly chunks: FakeChunk[] = [];
  /** Frames given out that nobody has closed. */
  static open = 0;

  constructor(private readonly init: { output: (frame: unknown) => void; error: (error: Error) => void }) {
    FakeVideoDecoder.made.push(this);
  }

  configure(config: NonNullable<FakeVideoDecoder['config']>): void {
    if (FakeVideoDecoder.fails('configure', config.hardwareAcceleration))
      throw new TypeError('no such codec');
    this.config = config;
    this.state = 'configured';
  }

  decode(chunk: FakeChunk): void {
    if (this.state !== 'configured' || !this.config) throw new TypeError(`a decoder that is ${this.state}`);
    if (FakeVideoDecoder.fails('decode', this.config.hardwareAcceleration))
      throw new TypeError('no such chunk');
    this.chunks.push(chunk);
  }

  close(): void {
    if (this.state === 'closed') throw new TypeError('closed twice');
    this.state = 'closed';
  }

  /** The picture of a chunk comes. */
  output(chunk: FakeChunk, picture: RawVideo): void {
    FakeVideoDecoder.open++;
    this.init.output({
      timestamp: chunk.timestamp,
      format: picture.format,
      visibleRect: { x: 0, y: 0, width: picture.width, height: picture.height },
      allocationSize: () => picture.bytes.length,
      copyTo: async (target: Uint8Array) => {
        target.set(picture.bytes);
        return picture.layout;
      },
      close: () => FakeVideoDecoder.open--,
    });
  }

  fail(): void {
    this.state = 'closed';
    this.init.error(new Error('cannot be decoded'));
  }
}

/** An access unit that begins with sequence parameters, or a slice alone; `mark` is its last byte. */
export function accessUnit(keyframe: boolean, mark: number, profile = [0x42, 0xc0, 0x1f]): Uint8Array {
  const parameters = [0, 0, 0, 1, 0x67, ...profile, 0x8c, 0, 0, 0, 1, 0x68, 0xce];
  return Uint8Array.from([...(keyframe ? parameters : []), 0, 0, 1, keyframe ? 0x65 : 0x41, mark]);
}

/**
 * A page's picture as decoders give it, larger than the page: what lies beyond is 255. Each plane counts up
 * from its number.
 */
export function rawPage(format: 'I420' | 'NV12', { coding, pageSize }: VideoFormat): RawVideo {
  const side = 16 * Math.ceil(pageSize / 16);
  const height = coding === 'h264' ? side : 3 * side;
  const stride = side + 8;
  const half = { width: side / 2, height: height / 2, stride: side / 2 + 4 };
  const luma = stride * height;
  const chroma = half.stride * half.height;
  const bytes = new Uint8Array(luma + 2 * chroma).fill(255);
  const put = (plane: number, offset: number, row: number, step: number, count: number) => {
    for (let y = 0; y < count; y++) {
      for (let x = 0; x < count; x++) bytes[offset + y * row + step * x] = sampleOf(plane, x, y);
    }
  };
  const chromaSide = Math.ceil(pageSize / 2);
  if (coding === 'h264_stacked') {
    for (let plane = 0; plane < 3; plane++) put(plane, plane * side * stride, stride, 1, pageSize);
  } else if (format === 'I420') {
    put(0, 0, stride, 1, pageSize);
    for (let plane = 1; plane < 3; plane++)
      put(plane, luma + (plane - 1) * chroma, half.stride, 1, chromaSide);
  } else {
    put(0, 0, stride, 1, pageSize);
    for (let plane = 1; plane < 3; plane++) put(plane, luma + plane - 1, 2 * half.stride, 2, chromaSide);
  }
  const layout =
    format === 'I420'
      ? [
          { offset: 0, stride },
          { offset: luma, stride: half.stride },
          { offset: luma + chroma, stride: half.stride },
        ]
      : [
          { offset: 0, stride },
          { offset: luma, stride: 2 * half.stride },
        ];
  return { format, bytes, layout, width: side, height };
}

/** What {@link rawPage} has of plane 0, 1 or 2 at a place. */
export function sampleOf(plane: number, x: number, y: number): number {
  return (100 * plane + 7 * y + x) % 251;
}
