import type { LumelPicture } from '@lumencast/client';
import {
  DataTexture,
  HalfFloatType,
  LinearFilter,
  NearestFilter,
  RedFormat,
  RGBAFormat,
  UnsignedByteType,
} from 'three';
import type { Paint } from './platform.js';

/** One channel or several, in rows without gaps. */
interface Plane {
  readonly data: Uint8Array<ArrayBuffer> | Uint16Array<ArrayBuffer>;
  readonly width: number;
  readonly height: number;
}

/** The planes of a picture that has so many columns and rows. */
function planesOf(picture: LumelPicture, [width, height]: readonly [number, number]): readonly Plane[] {
  if (picture.kind === 'halves') return [{ data: picture.texels, width, height }];
  const chroma = { width: picture.chromaWidth, height: picture.chromaHeight };
  return [
    { data: picture.y, width: picture.width, height: picture.height },
    { data: picture.co, ...chroma },
    { data: picture.cg, ...chroma },
  ];
}

/** Bytes that a picture takes on its way to the device. */
export function bytesOf(picture: LumelPicture): number {
  if (picture.kind === 'halves') return picture.texels.byteLength;
  return picture.y.byteLength + picture.co.byteLength + picture.cg.byteLength;
}

/** The textures that one picture after another of a kind and size is loaded into. */
class PictureTextures {
  readonly #textures: readonly DataTexture[];

  constructor(
    readonly shape: string,
    kind: LumelPicture['kind'],
    planes: readonly Plane[],
  ) {
    this.#textures = planes.map(({ width, height }, channel) =>
      kind === 'halves' ? halvesTexture(width, height) : codesTexture(width, height, channel > 0),
    );
  }

  load(planes: readonly Plane[]): void {
    this.#textures.forEach((texture, i) => {
      texture.image.data = planes[i].data;
      texture.needsUpdate = true;
    });
  }

  /** What paints the picture, which is one of those loaded, for pages of a scale. */
  paint(picture: LumelPicture, scale: number): Paint {
    const [first, co, cg] = this.#textures;
    const factor = picture.scale / scale;
    if (picture.kind === 'halves') return { kind: 'halves', factor, texels: first };
    const { toe, octaves } = picture;
    return { kind: 'planes', factor, toe, octaves, y: first, co, cg };
  }

  dispose(): void {
    for (const texture of this.#textures) texture.dispose();
  }
}

/** Textures for as many pictures as are under way at a time. */
export class PicturePool {
  readonly #all = new Set<PictureTextures>();
  readonly #free = new Map<string, PictureTextures[]>();

  /** Loads a picture: into the textures that held the one before, where these fit. */
  load(
    picture: LumelPicture,
    size: readonly [number, number],
    before: PictureTextures | undefined,
  ): PictureTextures {
    const planes = planesOf(picture, size);
    const shape = `${picture.kind} ${planes.map(({ width, height }) => `${width}x${height}`).join()}`;
    if (before && before.shape !== shape) this.release(before);
    const fitting = before?.shape === shape ? before : this.#free.get(shape)?.pop();
    const textures = fitting ?? new PictureTextures(shape, picture.kind, planes);
    this.#all.add(textures);
    textures.load(planes);
    return textures;
  }

  release(textures: PictureTextures): void {
    const free = this.#free.get(textures.shape);
    if (free) free.push(textures);
    else this.#free.set(textures.shape, [textures]);
  }

  dispose(): void {
    for (const textures of this.#all) textures.dispose();
    this.#all.clear();
    this.#free.clear();
  }
}

export type { PictureTextures };

function halvesTexture(width: number, height: number): DataTexture {
  const texture = new DataTexture(null, width, height, RGBAFormat, HalfFloatType);
  texture.minFilter = texture.magFilter = NearestFilter;
  return texture;
}

/** Codes as they are: a colour space would change them. Chroma is read between its samples. */
function codesTexture(width: number, height: number, isChroma: boolean): DataTexture {
  const texture = new DataTexture(null, width, height, RedFormat, UnsignedByteType);
  texture.minFilter = texture.magFilter = isChroma ? LinearFilter : NearestFilter;
  return texture;
}
