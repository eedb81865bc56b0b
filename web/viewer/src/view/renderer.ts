import {
  ACESFilmicToneMapping,
  AgXToneMapping,
  NeutralToneMapping,
  PCFShadowMap,
  type ToneMapping,
  WebGLRenderer,
} from 'three';
import type { WebGPURenderer } from 'three/webgpu';
import { Failure } from '../words.js';

export type AnyRenderer = WebGLRenderer | WebGPURenderer;

export const TONE_MAPPINGS: Readonly<Record<string, ToneMapping>> = {
  AgX: AgXToneMapping,
  ACES: ACESFilmicToneMapping,
  Neutral: NeutralToneMapping,
};

/**
 * Makes the renderer. WebGPU's half of three.js is loaded only where it is asked for.
 * @throws Error in words when the browser has no such API
 */
export async function createRenderer(
  kind: 'webgl' | 'webgpu',
  canvas: HTMLCanvasElement,
): Promise<AnyRenderer> {
  const renderer = kind === 'webgpu' ? await createWebGPU(canvas) : createWebGL(canvas);
  renderer.shadowMap.enabled = true;
  renderer.shadowMap.type = PCFShadowMap;
  renderer.toneMapping = AgXToneMapping;
  return renderer;
}

function createWebGL(canvas: HTMLCanvasElement): WebGLRenderer {
  try {
    return new WebGLRenderer({ canvas, antialias: true, powerPreference: 'high-performance' });
  } catch {
    throw new Failure(
      'This browser offers no WebGL 2, which the picture is drawn with.',
      'Is hardware acceleration off?',
    );
  }
}

async function createWebGPU(canvas: HTMLCanvasElement): Promise<WebGPURenderer> {
  const { WebGPURenderer } = await import('three/webgpu');
  const renderer = new WebGPURenderer({ canvas, antialias: true });
  await renderer.init();
  return renderer;
}

export function isWebGPU(renderer: AnyRenderer): renderer is WebGPURenderer {
  return 'isWebGPURenderer' in renderer;
}

/** Keeps the picture fluent on slow devices: lowers the resolution while frames take long. */
export class Resolution {
  #scale = 1;
  #slow = 0;
  #fast = 0;
  /** Of the drawn picture, in CSS pixels, and pixels a CSS pixel. */
  #drawn = { width: 0, height: 0, ratio: 0 };

  constructor(
    private readonly renderer: AnyRenderer,
    private readonly canvas: HTMLCanvasElement,
    /** Pixels a CSS pixel that never change, or `undefined` to adapt. */
    private readonly fixed: number | undefined,
  ) {
    this.fit();
  }

  /** Gives the picture the room that the canvas has on the page; to be called before each picture. */
  fit(): void {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    const ratio = this.fixed ?? Math.min(devicePixelRatio, 2) * this.#scale;
    const drawn = this.#drawn;
    if (width === drawn.width && height === drawn.height && ratio === drawn.ratio) return;
    this.#drawn = { width, height, ratio };
    this.renderer.setPixelRatio(ratio);
    this.renderer.setSize(width, height, false);
  }

  /** To be called each frame with its length in milliseconds. */
  frame(milliseconds: number): void {
    if (this.fixed !== undefined || document.hidden) return;
    this.#slow = milliseconds > 42 ? this.#slow + 1 : 0;
    this.#fast = milliseconds < 14 ? this.#fast + 1 : 0;
    if (this.#slow > 20 && this.#scale > 0.5) this.#set(Math.max(0.5, this.#scale * 0.8));
    else if (this.#fast > 240 && this.#scale < 1) this.#set(Math.min(1, this.#scale * 1.25));
  }

  #set(scale: number): void {
    this.#scale = scale;
    this.#slow = this.#fast = 0;
  }
}
