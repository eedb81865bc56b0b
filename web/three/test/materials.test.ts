/** What `set_material` changes, on files that GLTFLoader has read. */
import type { Edit } from '@lumencast/client';
import { type Mesh, MeshPhysicalMaterial, MeshStandardMaterial, Scene } from 'three';
import { afterEach, beforeEach, describe, expect, it, vi } from 'vitest';
import { Replica } from '../src/replica.js';
import { load, POSITION } from './support/glb.js';

const session = { edit: () => Promise.resolve(), sceneTime: () => 0 };

let warnings: string[];

async function replicaOf(parts: object) {
  const gltf = await load(parts);
  const ignore = () => {};
  const warning = (message: string) => void warnings.push(message);
  const events = { added: ignore, removed: ignore, warning };
  const replica = new Replica(new Scene().add(gltf.scene), gltf, session, (name) => name, events);
  const mesh = (name: string) => gltf.scene.getObjectByName(name) as Mesh<never, MeshStandardMaterial>;
  return { replica, mesh };
}

/** A triangle of this material. */
const swatch = (material: object, extensions: string[] = []) =>
  replicaOf({
    extensionsUsed: extensions,
    scenes: [{ nodes: [0] }],
    nodes: [{ name: 'swatch', mesh: 0 }],
    meshes: [{ primitives: [{ attributes: { POSITION }, material: 0 }] }],
    materials: [material],
  });

const paint = (change: object): Edit => ({ edit: 'set_material', material: 0, ...change });

beforeEach(() => {
  warnings = [];
  vi.spyOn(console, 'warn').mockImplementation(() => {});
});

afterEach(() => {
  vi.unstubAllGlobals();
  vi.restoreAllMocks();
});

describe('glTF’s default material', () => {
  const triangle = { attributes: { POSITION } };
  const nodes = [
    { name: 'wall', mesh: 0 },
    { name: 'bare', mesh: 1 },
    { name: 'bare2', mesh: 2 },
  ];

  it.each([0, 1, 3])('has the number after %i of the file’s own', async (own) => {
    const meshes = [{ primitives: [own > 0 ? { ...triangle, material: own - 1 } : triangle] }];
    const bare = { primitives: [triangle] };
    const materials = Array.from({ length: own }, () => ({}));
    const { replica, mesh } = await replicaOf({
      scenes: [{ nodes: [0, 1, 2] }],
      nodes,
      meshes: [...meshes, bare, bare],
      ...(own > 0 ? { materials } : {}),
    });
    replica.applyAccepted(
      { edit: 'set_material', material: own, base_color: [0, 0, 1, 1], metallic: 0.5, emissive: [1, 2, 3] },
      false,
    );
    for (const name of ['bare', 'bare2']) {
      const { color, metalness, emissive } = mesh(name).material;
      expect([color.toArray(), metalness, emissive.toArray()]).toEqual([[0, 0, 1], 0.5, [1, 2, 3]]);
    }
    if (own > 0) expect(mesh('wall').material.color.toArray()).toEqual([1, 1, 1]);
    replica.applySnapshot([]);
    const { color, metalness } = mesh('bare').material;
    expect([color.toArray(), metalness]).toEqual([[1, 1, 1], 1]);
  });
});

describe('a material without light', () => {
  it('gets its colour back with a snapshot', async () => {
    const { replica, mesh } = await replicaOf({
      extensionsUsed: ['KHR_materials_unlit'],
      scenes: [{ nodes: [0] }],
      nodes: [{ name: 'sign', mesh: 0 }],
      meshes: [{ primitives: [{ attributes: { POSITION }, material: 0 }] }],
      materials: [{ extensions: { KHR_materials_unlit: {} } }],
    });
    replica.applyAccepted(
      { edit: 'set_material', material: 0, base_color: [0, 1, 0, 1], metallic: 1 },
      false,
    );
    expect(mesh('sign').material.color.toArray()).toEqual([0, 1, 0]);
    replica.applySnapshot([]);
    expect(mesh('sign').material.color.toArray()).toEqual([1, 1, 1]);
  });
});

describe('a physical material', () => {
  const glass = {
    extensions: {
      KHR_materials_transmission: { transmissionFactor: 0.5 },
      KHR_materials_ior: { ior: 1.25 },
      KHR_materials_specular: { specularFactor: 0.75, specularColorFactor: [1, 0.5, 0] },
    },
  };

  it('is transmissive, refracts and shines as edits say, and as in its file after a snapshot', async () => {
    const { replica, mesh } = await swatch(glass, Object.keys(glass.extensions));
    const material = mesh('swatch').material as unknown as MeshPhysicalMaterial;
    expect(material).toBeInstanceOf(MeshPhysicalMaterial);
    const shown = () => {
      const { transmission, ior, specularIntensity, specularColor } = material;
      return [transmission, ior, specularIntensity, specularColor.toArray()];
    };
    const edit = paint({ transmission: 1, ior: 1.75, specular: 0.25, specular_color: [0, 1, 2] });
    replica.applyAccepted(edit, false);
    expect(shown()).toEqual([1, 1.75, 0.25, [0, 1, 2]]);
    replica.applyAccepted(paint({ transmission: 0 }), false);
    expect(shown()).toEqual([0, 1.75, 0.25, [0, 1, 2]]);
    replica.applySnapshot([]);
    expect(shown()).toEqual([0.5, 1.25, 0.75, [1, 0.5, 0]]);
    expect(warnings).toEqual([]);
  });

  it('takes an index of refraction of 0 as GLTFLoader does', async () => {
    const zero = { extensions: { KHR_materials_ior: { ior: 0 } } };
    const read = await swatch(zero, ['KHR_materials_ior']);
    const { replica, mesh } = await swatch(glass, Object.keys(glass.extensions));
    replica.applyAccepted(paint({ ior: 0 }), false);
    const ior = ({ material }: Mesh<never, MeshStandardMaterial>) => (material as MeshPhysicalMaterial).ior;
    expect(ior(mesh('swatch'))).toBe(ior(read.mesh('swatch')));
  });
});

describe('a standard material', () => {
  it('stays one, and it is said once that it cannot show what only physical ones have', async () => {
    const { replica, mesh } = await swatch({});
    const { material } = mesh('swatch');
    const before = JSON.stringify(material.toJSON());
    for (const change of [{ transmission: 1 }, { ior: 2 }, { specular: 0 }, { specular_color: [0, 0, 0] }])
      replica.applyAccepted(paint(change), false);
    replica.applySnapshot([]);
    expect(mesh('swatch').material).toBe(material);
    expect(JSON.stringify(material.toJSON())).toBe(before);
    expect(warnings).toEqual([
      'material 0 cannot show transmission: it was not loaded as a MeshPhysicalMaterial',
    ]);
    replica.applyAccepted(paint({ transmission: 1, roughness: 0.5 }), false);
    expect(material.roughness).toBe(0.5);
  });
});

describe('the scale of a normal map', () => {
  const primitive = (attributes: object) => ({
    primitives: [{ attributes: { POSITION, NORMAL: POSITION, ...attributes }, material: 0 }],
  });
  const parts = {
    scenes: [{ nodes: [0, 1] }],
    nodes: [
      { name: 'derived', mesh: 0 },
      { name: 'given', mesh: 1 },
    ],
    meshes: [primitive({}), primitive({ TANGENT: POSITION })],
    materials: [{}],
  };

  it.each([1, 0.5, -0.5, 0])('keeps y as GLTFLoader turns it without tangents, from %f', async (initial) => {
    const { replica, mesh } = await replicaOf(parts);
    const scales = [mesh('derived'), mesh('given')].map(({ material }) => material.normalScale);
    expect(scales.map((scale) => scale.toArray())).toEqual([
      [1, -1],
      [1, 1],
    ]);
    // Images cannot be read here: the scale that a file would have given, zeros with their signs.
    for (const scale of scales) scale.multiplyScalar(initial);
    const expectScale = (value: number) =>
      expect(scales.map(({ x, y }) => [x, y])).toEqual([
        [value, -value],
        [value, value],
      ]);
    for (const value of [2, 0, -1.5]) {
      replica.applyAccepted(paint({ normal_scale: value }), false);
      expectScale(value);
    }
    replica.applySnapshot([]);
    expectScale(initial);
  });
});

describe('the cutoff of a mask', () => {
  it('is three.js’ alphaTest, of unlit materials too', async () => {
    for (const extensions of [{}, { KHR_materials_unlit: {} }]) {
      const file = { alphaMode: 'MASK', alphaCutoff: 0.25, extensions };
      const { replica, mesh } = await swatch(file, Object.keys(extensions));
      const { material } = mesh('swatch');
      const first = material.version;
      replica.applyAccepted(paint({ alpha_cutoff: 0.75 }), false);
      expect([material.alphaTest, material.version]).toEqual([0.75, first]);
      replica.applyAccepted(paint({ alpha_cutoff: 0 }), false);
      // Its shader is another one.
      expect([material.alphaTest, material.version > first]).toEqual([0, true]);
      replica.applySnapshot([]);
      expect(material.alphaTest).toBe(0.25);
    }
  });
});
