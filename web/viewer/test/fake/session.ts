import type {
  Catalog,
  Edit,
  FieldInfo,
  LightState,
  Session,
  SessionEvents,
  SessionStats,
  Status,
  Vec3,
  Vec4,
} from '@lumencast/client';

export interface FakeLight {
  readonly center: Vec3;
  readonly size: Vec3;
  readonly rotation: Vec4;
  /** Mean radiance, cd/m². */
  readonly radiance: number;
}

const RESOLUTION: Vec3 = [8, 6, 8];

/** A session without a server, for looking at the page: light that glows warm on one side and cool on the other. */
export class FakeSession implements Session {
  readonly origin = location.origin;
  readonly files = `${location.origin}/scene/`;
  readonly scene = 'fake';
  readonly client = 'fake';
  readonly ready = Promise.resolve();
  readonly pending = [];
  readonly unshown = [];
  readonly saved = undefined;
  readonly catalog: Catalog;
  status: Status = { state: 'connected', transport: 'websocket' };
  readonly #listeners = new Map<string, Set<(value: never) => void>>();
  readonly #field: FieldInfo<'volume'>;
  readonly #coefficients: Float32Array;
  #revision = 0;
  #seq = 0;

  constructor(private readonly light_: FakeLight) {
    const { center, size, rotation } = light_;
    this.#field = {
      id: 0,
      use: 'all',
      kind: 'volume',
      shape: {
        basis: 'sh',
        order: 2,
        grid: { center, size, rotation, resolution: RESOLUTION },
        offset: { cells: 0.5 },
        cellsMin: [0, 0, 0],
        regions: [{ id: 0, min: [0, 0, 0], size: RESOLUTION }],
        layers: 3,
      },
    };
    this.catalog = {
      epoch: '0123456789abcdef',
      scene: { name: 'fake', root: 'fake.glb' },
      tickSeconds: 0.04,
      fields: [this.#field],
      unknown: [],
    };
    this.#coefficients = this.#glow();
    setInterval(() => this.#revision++, 200);
  }

  get stats(): SessionStats {
    return {
      tickRate: 25,
      updateRate: 25,
      age: 0.04,
      bandwidth: 41_000,
      bandwidthByTrack: new Map(),
      tickMs: 33,
      samples: 16,
      delay: 0.002,
      layers: 3,
      pending: 0,
      dropped: 0,
    };
  }

  on<K extends keyof SessionEvents>(event: K, listener: (value: SessionEvents[K]) => void): () => void {
    const listeners = this.#listeners.get(event) ?? new Set();
    this.#listeners.set(event, listeners.add(listener));
    return () => listeners.delete(listener);
  }

  #emit<K extends keyof SessionEvents>(event: K, value: SessionEvents[K]): void {
    for (const listener of this.#listeners.get(event) ?? []) listener(value as never);
  }

  async edit(edit: Edit): Promise<void> {
    await new Promise((resolve) => setTimeout(resolve, 40));
    const seq = ++this.#seq;
    const creates = edit.edit === 'add_light' || edit.edit === 'add_instance';
    this.#emit('edit', {
      edit: creates ? { ...edit, node: 1000 + seq } : edit,
      client: 'fake',
      seq,
      own: true,
    });
  }

  /** Pretends that the server has gone, or is back. */
  set lost(lost: boolean) {
    this.status = lost
      ? { state: 'lost', reason: 'the server has gone', retryIn: 1 }
      : { state: 'connected', transport: 'websocket' };
    this.#emit('status', this.status);
  }

  light(): LightState {
    const lit = {
      kind: 'volume' as const,
      field: this.#field,
      coefficients: this.#coefficients,
      scale: 4,
      revision: this.#revision,
      age: 0.04,
      sceneVersion: 1,
      tick: this.#revision,
      regions: { lit: 1, all: 1 },
    };
    return { fields: [lit], age: 0.04 };
  }

  sceneTime(): number {
    return performance.now() / 1000;
  }

  setCamera(): void {}

  timings(): [] {
    return [];
  }

  close(): void {}

  #glow(): Float32Array {
    const [nx, ny, nz] = RESOLUTION;
    const out = new Float32Array(nx * ny * nz * 27);
    const c0 = this.light_.radiance / 0.282095;
    for (let i = 0; i < nx * ny * nz; i++) {
      const x = ((i % nx) + 0.5) / nx;
      const warm = [1, 0.85 - 0.25 * x, 0.65 - 0.3 * x];
      const cool = [0.55, 0.75, 1];
      for (let c = 0; c < 3; c++) {
        out[i * 27 + c] = c0 * (warm[c] * x + cool[c] * (1 - x));
        // A little more from above.
        out[i * 27 + 3 + c] = 0.35 * c0;
      }
    }
    return out;
  }
}
