/** What `set_material` changes, on files that GLTFLoader has read. */
import { type Mesh, type MeshStandardMaterial, Scene } from 'three';
import { afterEach, beforeEach, describe, expect, it, vi } from 'vitest';
import { Replica } from '../src/replica.js';
import { load, POSITION } from './support/glb.js';

const session = { edit: () => Promise.resolve(), sceneTime: () => 0 };

async function replicaOf(parts: object) {
  const gltf = await load(parts);
  const ignore = () => {};
  const events = { added: ignore, removed: ignore, warning: ignore };
  const replica = new Replica(new Scene().add(gltf.scene), gltf, session, (name) => name, events);
  const mesh = (name: string) => gltf.scene.getObjectByName(name) as Mesh<never, MeshStandardMaterial>;
  return { replica, mesh };
}

beforeEach(() => void vi.spyOn(console, 'warn').mockImplementation(() => {}));

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
