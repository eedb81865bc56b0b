/** Edits that add and remove, on scenes that GLTFLoader has read. */
import type { Edit } from '@lumencast/client';
import {
  type DataTexture,
  type Mesh,
  type MeshStandardMaterial,
  type Object3D,
  PointLight,
  Scene,
  type SkinnedMesh,
  SpotLight,
  Vector3,
} from 'three';
import { afterEach, beforeEach, describe, expect, it, vi } from 'vitest';
import { Replica } from '../src/replica.js';
import { glbUrl, JOINTS, load, POSITION, RAISED, TIMES, WAY, WEIGHTS } from './support/glb.js';

const TRIANGLE = { attributes: { POSITION } };
const SKINNED = { attributes: { POSITION, JOINTS_0: JOINTS, WEIGHTS_0: WEIGHTS } };
const LIGHTS = {
  extensionsUsed: ['KHR_lights_punctual'],
  extensions: { KHR_lights_punctual: { lights: [{ type: 'point', intensity: 8 }] } },
};
const LAMP = { extensions: { KHR_lights_punctual: { light: 0 } } };

/** Two meshes and a lamp: nodes 0 to 2, meshes 0 to 2, materials 0 and, by default, 1. */
const ROOM = {
  ...LIGHTS,
  scenes: [{ nodes: [0, 1, 2] }],
  nodes: [
    { name: 'wall', mesh: 0 },
    { name: 'bare', mesh: 1, translation: [0, 0, 5] },
    { name: 'lamp', ...LAMP },
  ],
  meshes: [
    { primitives: [{ ...TRIANGLE, material: 0 }] },
    { primitives: [TRIANGLE] },
    // No node shows it: one part of each material, of which the second morphs.
    {
      primitives: [
        { ...TRIANGLE, material: 0 },
        { ...TRIANGLE, targets: [{ POSITION: RAISED }] },
      ],
      weights: [0.25],
    },
  ],
  materials: [{ name: 'paint' }],
};

/** A file to be added: a branch (node 0) with a leaf (node 1) that rises, and a lamp (node 2). */
const TREE = {
  ...LIGHTS,
  scenes: [{ nodes: [0, 2] }],
  nodes: [
    { name: 'branch', children: [1] },
    { name: 'leaf', mesh: 0 },
    { name: 'firefly', ...LAMP },
  ],
  meshes: [{ primitives: [{ ...TRIANGLE, material: 0 }] }],
  materials: [{ name: 'green', pbrMetallicRoughness: { baseColorFactor: [0, 1, 0, 1] } }],
  animations: [
    {
      channels: [{ sampler: 0, target: { node: 1, path: 'translation' } }],
      samplers: [{ input: TIMES, output: WAY }],
    },
  ],
};
const FILES: Readonly<Record<string, () => string>> = { 'tree.glb': () => glbUrl(TREE) };

let events: string[];
const session = { edit: () => Promise.resolve(), sceneTime: () => 0 };

async function replicaOf(parts: object) {
  const gltf = await load(parts);
  const scene = new Scene().add(gltf.scene);
  const urlOf = (name: string) => FILES[name]?.() ?? 'data:text/plain,none';
  const replica = new Replica(scene, gltf, session, urlOf, {
    added: (object) => void events.push(`added ${object.type}`),
    removed: (object) => void events.push(`removed ${object.type}`),
    warning: (message) => void events.push(message),
  });
  return { gltf, scene, replica, accept: (...edits: Edit[]) => accept(replica, edits) };
}

function accept(replica: Replica, edits: readonly Edit[]): void {
  for (const edit of edits) replica.applyAccepted(edit, false);
}

/** Once what an instance shows has come. */
function shown(replica: Replica, node: number): Promise<Object3D> {
  return vi.waitFor(() => {
    const found = replica.content.object(node)?.children[0];
    if (!found) throw new Error(`nothing shows at node ${node}: ${events.join()}`);
    return found;
  });
}

const colorOf = (object: Object3D | undefined) =>
  ((object as Mesh).material as MeshStandardMaterial).color.toArray();
const red: Edit = { edit: 'set_material', material: 0, base_color: [1, 0, 0, 1] };

beforeEach(() => {
  events = [];
  vi.spyOn(console, 'warn').mockImplementation(() => {});
});

afterEach(() => {
  vi.unstubAllGlobals();
  vi.restoreAllMocks();
});

describe('add_instance of a mesh', () => {
  it('hangs a copy below the node it names, where it says', async () => {
    const { gltf, replica, accept } = await replicaOf(ROOM);
    const before = replica.revision;
    accept({
      edit: 'add_instance',
      node: 3,
      source: { mesh: 1 },
      parent: 0,
      transform: { translation: [1, 2, 3], scale: [2, 2, 2] },
    });
    const copy = (await shown(replica, 3)) as Mesh;
    const group = replica.content.object(3)!;
    expect(group.parent).toBe(replica.content.object(0));
    expect([group.position.toArray(), group.scale.x]).toEqual([[1, 2, 3], 2]);
    const original = gltf.scene.getObjectByName('bare') as Mesh;
    expect([copy.geometry, copy.material]).toEqual([original.geometry, original.material]);
    // Where the original stands is none of its business.
    expect(copy.position.toArray()).toEqual([0, 0, 0]);
    expect(replica.content.nodeOf(copy)).toBe(3);
    expect(replica.revision).toBeGreaterThan(before);
    accept({ edit: 'move_node', node: 3, translation: [4, 5, 6] });
    expect(group.position.toArray()).toEqual([4, 5, 6]);
    expect(original.position.z).toBe(5);
  });

  it('that no node shows has all its parts, materials as edits left them, and its own morph weights', async () => {
    const { replica, accept } = await replicaOf(ROOM);
    accept(red, { edit: 'set_material', material: 1, base_color: [0, 0, 1, 1] });
    accept({ edit: 'add_instance', node: 3, source: { mesh: 2 } });
    const parts = (await shown(replica, 3)).children as Mesh[];
    expect(parts.map(colorOf)).toEqual([
      [1, 0, 0],
      [0, 0, 1],
    ]);
    expect(parts.map(({ morphTargetInfluences }) => morphTargetInfluences)).toEqual([undefined, [0.25]]);
  });

  it('goes with remove_node, and with a snapshot that lacks it', async () => {
    const { gltf, replica, accept } = await replicaOf(ROOM);
    const add: Edit = { edit: 'add_instance', node: 3, source: { mesh: 0 } };
    accept(add);
    await shown(replica, 3);
    const group = replica.content.object(3)!;
    accept({ edit: 'remove_node', node: 3 });
    expect(group.parent).toBeNull();
    expect(replica.content.object(3)).toBeUndefined();
    expect(events.at(-1)).toBe('removed Group');

    replica.applySnapshot([add]);
    await shown(replica, 3);
    expect(gltf.scene.children.length).toBe(4);
    replica.applySnapshot([]);
    expect(gltf.scene.children.length).toBe(3);
  });

  it('says so where there is no such mesh', async () => {
    const { replica, accept } = await replicaOf(ROOM);
    accept({ edit: 'add_instance', node: 3, source: { mesh: 9 } });
    await vi.waitFor(() => expect(events.at(-1)).toMatch(/mesh 9 is not known/));
    expect(replica.content.object(3)!.children).toEqual([]);
  });
});

describe('add_instance of a mesh that a node skins', () => {
  const skin = {
    scenes: [{ nodes: [0, 1] }],
    nodes: [
      { mesh: 0, skin: 0 },
      { name: 'joint', translation: [0, 7, 0] },
    ],
    skins: [{ joints: [1] }],
    meshes: [{ primitives: [SKINNED] }],
  };

  it('is the mesh at rest, as on the server: the joints are the node’s', async () => {
    const { replica, accept } = await replicaOf(skin);
    accept({
      edit: 'add_instance',
      node: 2,
      source: { mesh: 0 },
      transform: { translation: [3, 0, 0] },
    });
    const copy = (await shown(replica, 2)) as SkinnedMesh;
    const original = replica.content.object(0) as SkinnedMesh;
    const corner = (mesh: Mesh) => {
      mesh.updateWorldMatrix(true, false);
      return mesh.getVertexPosition(0, new Vector3()).applyMatrix4(mesh.matrixWorld).toArray();
    };
    replica.content.object(1)!.updateMatrixWorld();
    // The skinned one is where its joint is; that makes sure that the file really skins.
    expect([original.isSkinnedMesh, copy.isSkinnedMesh]).toEqual([true, undefined]);
    expect(corner(original)).toEqual([0, 7, 0]);
    expect(corner(copy)).toEqual([3, 0, 0]);
  });
});

describe('add_instance of a file', () => {
  const add: Edit = { edit: 'add_instance', node: 3, source: { file: 'tree.glb' } };
  // Its material is number 2: the room has one, and the default.
  const paint: Edit = { edit: 'set_material', material: 2, base_color: [1, 0, 1, 1] };

  it('numbers its nodes, materials and animations on', async () => {
    const { replica, accept } = await replicaOf(ROOM);
    accept({ ...add, transform: { translation: [0, 0, 2] } });
    const tree = await shown(replica, 3);
    const { content } = replica;
    expect([4, 5, 6].map((node) => content.object(node)?.name)).toEqual(['branch', 'leaf', 'firefly']);
    expect(content.light(6)).toBeInstanceOf(PointLight);
    accept(
      paint,
      { edit: 'move_node', node: 4, translation: [0, 3, 0] },
      { edit: 'set_light', node: 6, intensity: 2 },
    );
    expect(colorOf(content.object(5))).toEqual([1, 0, 1]);
    expect(tree.getObjectByName('branch')!.position.y).toBe(3);
    expect(content.light(6)!.intensity).toBe(2);
    replica.update(1);
    expect(content.object(5)!.position.y).toBeCloseTo(2);
    accept({ edit: 'remove_light', node: 6 });
    expect(content.light(6)!.intensity).toBe(0);
  });

  it('shows edits that came before it was read', async () => {
    const { replica, accept } = await replicaOf(ROOM);
    accept(add, paint, { edit: 'move_node', node: 4, translation: [0, 3, 0] });
    await shown(replica, 3);
    expect(colorOf(replica.content.object(5))).toEqual([1, 0, 1]);
    expect(replica.content.object(4)!.position.y).toBe(3);
  });

  it('gives a second copy what edits have made of the material that they share', async () => {
    const { replica, accept } = await replicaOf(ROOM);
    accept(add, paint);
    await shown(replica, 3);
    accept({ ...add, node: 7 });
    await shown(replica, 7);
    expect(colorOf(replica.content.object(9))).toEqual([1, 0, 1]);
    accept({ ...paint, base_color: [0, 1, 1, 1] } as Edit);
    expect([5, 9].map((node) => colorOf(replica.content.object(node)))).toEqual([
      [0, 1, 1],
      [0, 1, 1],
    ]);
  });

  it('goes with all below it', async () => {
    const { replica, accept } = await replicaOf(ROOM);
    accept(add);
    await shown(replica, 3);
    accept({ edit: 'add_light', node: 7, parent: 4, light: { type: 'point' } });
    expect(replica.content.light(7)!.parent).toBe(replica.content.object(4));
    accept({ edit: 'remove_node', node: 3 });
    expect([3, 4, 5, 6, 7].map((node) => replica.content.object(node))).toEqual(new Array(5));
  });

  it('that was removed before it was read leaves nothing behind but its numbers', async () => {
    const { gltf, replica, accept } = await replicaOf(ROOM);
    accept(add, { edit: 'remove_node', node: 3 }, { ...add, node: 7 });
    await shown(replica, 7);
    expect([4, 5, 6].map((node) => replica.content.object(node))).toEqual(new Array(3));
    expect(replica.content.object(9)!.name).toBe('leaf');
    expect(gltf.scene.children.length).toBe(4);
  });

  it('comes back with a snapshot, and with what the snapshot says of it', async () => {
    const { replica, accept } = await replicaOf(ROOM);
    accept(add, paint);
    await shown(replica, 3);
    replica.applySnapshot([add, { ...paint, base_color: [1, 1, 0, 1] } as Edit]);
    await shown(replica, 3);
    expect(colorOf(replica.content.object(5))).toEqual([1, 1, 0]);
    replica.applySnapshot([add]);
    await shown(replica, 3);
    expect(colorOf(replica.content.object(5))).toEqual([0, 1, 0]);
  });

  it('that was still being read when a snapshot came is not mistaken for the snapshot’s', async () => {
    const { gltf, replica, accept } = await replicaOf(ROOM);
    accept(add);
    replica.applySnapshot([{ ...add, node: 10 }]);
    await shown(replica, 10);
    expect(replica.content.object(12)!.name).toBe('leaf');
    expect(replica.content.object(5)).toBeUndefined();
    expect(gltf.scene.children.length).toBe(4);
  });

  it('says so where it cannot be read', async () => {
    const { accept } = await replicaOf(ROOM);
    accept({ edit: 'add_instance', node: 3, source: { file: 'none.glb' } });
    await vi.waitFor(() => expect(events.at(-1)).toMatch(/cannot be shown/));
  });
});

describe('a file of several scenes', () => {
  it('has nodes by number all the same', async () => {
    const nodes = [{ name: 'elsewhere' }, { name: 'post', children: [2] }, { name: 'sign' }];
    const { gltf, replica, accept } = await replicaOf({
      scene: 1,
      scenes: [{ nodes: [0] }, { nodes: [1] }],
      nodes,
    });
    accept({ edit: 'move_node', node: 2, translation: [0, 3, 0] });
    expect(gltf.scene.getObjectByName('sign')!.position.y).toBe(3);
    expect(replica.content.object(1)).toBe(gltf.scene.getObjectByName('post'));
  });
});

describe('lights', () => {
  it('of all kinds come below the node that add_light names, as it says', async () => {
    const { scene, replica, accept } = await replicaOf(ROOM);
    const light = {
      type: 'spot',
      inner: 0.2,
      outer: 0.4,
      color: [1, 0.5, 0],
      intensity: 9,
      range: 6,
    } as const;
    accept({
      edit: 'add_light',
      node: 3,
      parent: 1,
      light: { ...light, color: [1, 0.5, 0] },
      transform: { translation: [1, 0, 0] },
    });
    const spot = replica.content.light(3) as SpotLight;
    expect(spot).toBeInstanceOf(SpotLight);
    expect([spot.intensity, spot.distance, spot.angle, spot.penumbra]).toEqual([9, 6, 0.4, 0.5]);
    expect(spot.color.toArray()).toEqual([1, 0.5, 0]);
    scene.updateMatrixWorld();
    expect(spot.getWorldPosition(new Vector3()).toArray()).toEqual([1, 0, 5]);
    // It shines along its −Z.
    expect(spot.target.getWorldPosition(new Vector3()).toArray()).toEqual([1, 0, 4]);
    accept({ edit: 'add_light', node: 4, light: { type: 'directional' } });
    expect([replica.content.light(4)!.type, replica.content.light(4)!.intensity]).toEqual([
      'DirectionalLight',
      1,
    ]);
  });

  it('go dark with remove_light, and their node stays', async () => {
    const { gltf, replica, accept } = await replicaOf(ROOM);
    const lamp = replica.content.light(2)!;
    accept({ edit: 'remove_light', node: 2 });
    expect(lamp.intensity).toBe(0);
    expect(replica.content.object(2)!.parent).toBe(gltf.scene);
    replica.applySnapshot([]);
    expect(lamp.intensity).toBe(8);
  });
});

describe('the environment', () => {
  const topOf = ({ background }: Scene) => {
    const { data } = (background as DataTexture).image as { data: Float32Array };
    return [...data.subarray(data.length - 4, data.length - 1)].map((value) => Number(value.toFixed(2)));
  };
  const sky: Edit = {
    edit: 'set_environment',
    environment: { type: 'sky', zenith: [1, 2, 3], horizon: [4, 4, 4], ground: [0, 0, 0] },
  };

  it('stands behind the scene and lights no material of it, until a snapshot has another', async () => {
    const { scene, replica, accept } = await replicaOf(ROOM);
    accept({ edit: 'set_environment', environment: { type: 'constant', radiance: [5, 6, 7] } }, sky);
    await vi.waitFor(() => expect(topOf(scene)).toEqual([1, 2, 3]));
    expect(scene.environment).toBeNull();
    expect(replica.environment).toEqual(sky.environment);
    replica.applySnapshot([]);
    await vi.waitFor(() => expect(topOf(scene)).toEqual([0, 0, 0]));
  });

  it('is at first what the file’s extras say', async () => {
    const extras = { lumencast: { environment: { type: 'constant', radiance: [0.5, 0.25, 1] } } };
    const { scene, replica, accept } = await replicaOf({ ...ROOM, scenes: [{ nodes: [0, 1, 2], extras }] });
    await vi.waitFor(() => expect(topOf(scene)).toEqual([0.5, 0.25, 1]));
    accept(sky);
    await vi.waitFor(() => expect(topOf(scene)).toEqual([1, 2, 3]));
    replica.applySnapshot([]);
    await vi.waitFor(() => expect(topOf(scene)).toEqual([0.5, 0.25, 1]));
  });
});
