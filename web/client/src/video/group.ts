/** Units that a group keeps at most. One whose pictures keep coming has about 64, a still one fewer. */
export const MOST_KEPT = 128;
/** Bytes that a group keeps at most, for each region that is decoded. */
export const MOST_BYTES = 2 << 20;

/** Keeps a keyframe and the units that follow it, so that another decoder can begin with them. */
export class Group {
  /** `undefined` where they were too many, or have been taken. */
  private chunks: EncodedVideoChunk[] | undefined = [];
  private bytes = 0;

  constructor(readonly codec: string) {}

  add(chunk: EncodedVideoChunk): void {
    if (!this.chunks) return;
    this.chunks.push(chunk);
    this.bytes += chunk.byteLength;
    if (this.chunks.length > MOST_KEPT || this.bytes > MOST_BYTES) this.chunks = undefined;
  }

  /** Hands all units over, once and in order; `undefined` where they are not kept. */
  take(): readonly EncodedVideoChunk[] | undefined {
    const { chunks } = this;
    this.chunks = undefined;
    return chunks;
  }
}
