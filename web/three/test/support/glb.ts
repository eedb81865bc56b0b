/** glTF files for tests, as GLTFLoader really reads them. */
import type { GLTF } from 'three/addons/loaders/GLTFLoader.js';
import { vi } from 'vitest';
import { loadGltf } from '../../src/content.js';

/** Numbers of accessors: of a triangle, of joints and weights that hold it to joint 0, of a morph target. */
export const [POSITION, JOINTS, WEIGHTS, RAISED, TIMES, WAY] = [0, 1, 2, 3, 4, 5];

const FLOAT = 5126;
const BYTE = 5121;
const ACCESSORS: readonly { type: string; values: readonly number[]; bytes?: true }[] = [
  { type: 'VEC3', values: [0, 0, 0, 1, 0, 0, 0, 1, 0] },
  { type: 'VEC4', values: new Array<number>(12).fill(0), bytes: true },
  { type: 'VEC4', values: [1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0] },
  { type: 'VEC3', values: [0, 0, 1, 0, 0, 1, 0, 0, 1] },
  { type: 'SCALAR', values: [0, 2] },
  { type: 'VEC3', values: [0, 0, 0, 0, 4, 0] },
];

/** The address of a binary glTF of these parts, with the accessors above. */
export function glbUrl(parts: object): string {
  // Data URLs are read in pieces, of which the reader tells; Node has no such event.
  vi.stubGlobal('ProgressEvent', class {});
  const blocks = ACCESSORS.map(({ values, bytes }) => (bytes ? Uint8Array : Float32Array).from(values));
  let byteOffset = 0;
  const bufferViews = blocks.map(({ byteLength }) => {
    const view = { buffer: 0, byteOffset, byteLength };
    byteOffset += byteLength;
    return view;
  });
  const accessors = ACCESSORS.map(({ type, values, bytes }, bufferView) => ({
    bufferView,
    type,
    componentType: bytes ? BYTE : FLOAT,
    count: values.length / ({ SCALAR: 1, VEC3: 3, VEC4: 4 }[type] ?? 1),
    ...(type === 'SCALAR' ? { min: [0], max: [2] } : {}),
    ...(type === 'VEC3' ? { min: [0, 0, 0], max: [1, 4, 1] } : {}),
  }));
  const json = {
    asset: { version: '2.0' },
    scene: 0,
    buffers: [{ byteLength: byteOffset }],
    bufferViews,
    accessors,
    ...parts,
  };
  const text = JSON.stringify(json);
  const head = Buffer.from(text.padEnd(Math.ceil(text.length / 4) * 4));
  const body = Buffer.concat(blocks.map(({ buffer }) => Buffer.from(buffer as ArrayBuffer)));
  const words = (...values: number[]) => Buffer.from(Uint32Array.from(values).buffer);
  const file = Buffer.concat([
    words(0x46546c67, 2, 12 + 8 + head.length + 8 + body.length),
    words(head.length, 0x4e4f534a),
    head,
    words(body.length, 0x004e4942),
    body,
  ]);
  return `data:model/gltf-binary;base64,${file.toString('base64')}`;
}

export function load(parts: object): Promise<GLTF> {
  return loadGltf(glbUrl(parts));
}
