import type { Planes } from '../api.js';
import type { OpenDecoder, PictureDecoder, VideoFormat } from '../cache/picture-decoder.js';
import { RegionDecoder } from './region-decoder.js';
import type { Answer, Question } from './service.js';

/** What is needed of a worker. */
export type DecoderWorker = Pick<Worker, 'postMessage' | 'onmessage' | 'onerror' | 'terminate'>;

/**
 * Opens decoders that work in a worker; `undefined` where there are none. Browsers offer WebCodecs to secure
 * pages alone.
 */
export function videoDecoders(environment: object = globalThis): OpenDecoder | undefined {
  const { VideoDecoder, Worker } = environment as { VideoDecoder?: unknown; Worker?: unknown };
  if (VideoDecoder === undefined || Worker === undefined) return undefined;
  const pool = new DecoderPool(startWorker, (format) => new RegionDecoder(format));
  return (format) => pool.open(format);
}

/** Bundlers look for just these words. */
function startWorker(): DecoderWorker {
  return new Worker(new URL('./worker.js', import.meta.url), { type: 'module' });
}

/** The decoders of a session, which share a worker. It is there while any of them is. */
export class DecoderPool {
  private worker: DecoderWorker | undefined;
  private readonly regions = new Set<number>();
  private readonly asked = new Map<number, { region: number; resolve: (planes?: Planes) => void }>();
  private opened = 0;
  private count = 0;
  /** Whether there is no worker to be had, as where a page's rules forbid it. */
  private broken = false;

  /** `openHere` opens a decoder in the page itself, where workers fail. */
  constructor(
    private readonly start: () => DecoderWorker,
    private readonly openHere: OpenDecoder,
  ) {}

  open(format: VideoFormat): PictureDecoder {
    const region = this.opened++;
    this.regions.add(region);
    this.post({ kind: 'open', region, format });
    let here: PictureDecoder | undefined;
    return {
      decode: (unit, keyframe) => {
        if (this.broken) here ??= this.openHere(format);
        return here?.decode(unit, keyframe) ?? this.decode(region, unit, keyframe);
      },
      close: () => {
        here?.close();
        this.close(region);
      },
    };
  }

  private decode(region: number, unit: Uint8Array, keyframe: boolean): Promise<Planes | undefined> {
    if (!this.regions.has(region)) return Promise.resolve(undefined);
    const number = this.count++;
    return new Promise((resolve) => {
      this.asked.set(number, { region, resolve });
      // A copy, as the frame that it is a part of is not ours.
      const copy = unit.slice();
      this.post({ kind: 'decode', region, number, unit: copy, keyframe }, [copy.buffer]);
    });
  }

  private close(region: number): void {
    if (!this.regions.delete(region)) return;
    for (const [number, asked] of this.asked) {
      if (asked.region === region) this.answer({ number, planes: undefined });
    }
    this.post({ kind: 'close', region });
    if (this.regions.size === 0) this.stop();
  }

  private post(question: Question, transfer: Transferable[] = []): void {
    if (this.broken) return;
    try {
      this.worker ??= this.started();
      this.worker.postMessage(question, transfer);
    } catch {
      this.fail();
    }
  }

  private started(): DecoderWorker {
    const worker = this.start();
    worker.onmessage = ({ data }: MessageEvent<Answer>) => this.answer(data);
    worker.onerror = (event) => {
      event.preventDefault();
      this.fail();
    };
    return worker;
  }

  private answer({ number, planes }: Answer): void {
    this.asked.get(number)?.resolve(planes);
    this.asked.delete(number);
  }

  private fail(): void {
    this.broken = true;
    this.stop();
    for (const number of [...this.asked.keys()]) this.answer({ number, planes: undefined });
  }

  private stop(): void {
    this.worker?.terminate();
    this.worker = undefined;
  }
}
