/** What exporters write besides plain glTF, as GLTFLoader reads it: numbers that edits know, and what is hidden. */
import {
  type InstancedMesh,
  Matrix4,
  type Mesh,
  type MeshPhysicalMaterial,
  Scene,
  type SkinnedMesh,
  Vector3,
} from 'three';
import { afterEach, describe, expect, it, vi } from 'vitest';
import { blankPadding, isHidden } from '../src/exported.js';
import { loadGltf } from '../src/content.js';
import { roughen } from '../src/glossiness.js';
import { Replica } from '../src/replica.js';
import { nameOf, sceneFile } from '../src/files.js';
import { glbUrl, JOINTS, load, POSITION, WEIGHTS } from './support/glb.js';

const session = { edit: () => Promise.resolve(), sceneTime: () => 0 };

async function replicaOf(parts: object) {
  const gltf = await load(parts);
  const scene = new Scene().add(gltf.scene);
  const events = { added: () => {}, removed: () => {}, warning: () => {} };
  return { gltf, replica: new Replica(scene, gltf, session, (name) => name, events) };
}

const TRIANGLE = { primitives: [{ attributes: { POSITION } }] };
/** Its positions serve as places: (0, 0, 0), (1, 0, 0) and (0, 1, 0). */
const INSTANCES = { EXT_mesh_gpu_instancing: { attributes: { TRANSLATION: POSITION } } };
const LAMP = { KHR_lights_punctual: { light: 0 } };
const LAMPS = { KHR_lights_punctual: { lights: [{ type: 'point', intensity: 8 }] } };
const EXTENSIONS = ['EXT_mesh_gpu_instancing', 'KHR_node_visibility', 'KHR_lights_punctual'];

afterEach(() => void vi.unstubAllGlobals());

describe('a node with instances', () => {
  const FILE = {
    extensionsUsed: EXTENSIONS,
    extensions: LAMPS,
    scenes: [{ nodes: [0, 2] }],
    nodes: [
      { mesh: 0, children: [1], extensions: INSTANCES },
      { mesh: 1, translation: [0, 0, 7], children: [3] },
      // Of two primitives, with a lamp.
      { mesh: 1, extensions: { ...INSTANCES, ...LAMP } },
      { mesh: 0, extensions: INSTANCES },
    ],
    meshes: [
      { primitives: [{ ...TRIANGLE.primitives[0], material: 0 }] },
      { primitives: [...TRIANGLE.primitives, ...TRIANGLE.primitives] },
    ],
    materials: [{ name: 'paint' }],
  };

  it('is one node, which edits move and remove with all its instances', async () => {
    const { gltf, replica } = await replicaOf(FILE);
    const mesh = replica.content.object(0) as InstancedMesh;
    expect([mesh.isInstancedMesh, mesh.count]).toEqual([true, 3]);
    expect(replica.content.object(1)!.parent).toBe(mesh);
    replica.applyAccepted({ edit: 'move_node', node: 0, translation: [0, 0, 5] }, false);
    gltf.scene.updateMatrixWorld();
    const second = new Matrix4();
    mesh.getMatrixAt(1, second);
    const place = new Vector3().setFromMatrixPosition(second.premultiply(mesh.matrixWorld));
    expect(place.toArray()).toEqual([1, 0, 5]);
    replica.applyAccepted({ edit: 'remove_node', node: 0 }, false);
    expect(mesh.parent).toBeNull();
  });

  it('shows its materials by their numbers', async () => {
    const { replica } = await replicaOf(FILE);
    const parts: InstancedMesh[] = [];
    replica.content.object(2)!.traverse((part) => {
      if ('isInstancedMesh' in part) parts.push(part as InstancedMesh);
    });
    expect(parts.length).toBe(2);
    // After the file's one material comes glTF's default.
    for (const { material } of parts) expect(replica.content.materials(1)).toContain(material);
    const below = (replica.content.object(3) as Mesh).material;
    expect(replica.content.materials(0)).toContain(below);
    expect(replica.content.materials(1)).not.toContain(below);
    for (const part of parts) expect(replica.content.nodeOf(part)).toBe(2);
  });
});

describe('a hidden node', () => {
  it('hides what is below it, and only that', async () => {
    const visibility = (visible?: boolean) => ({ KHR_node_visibility: { visible } });
    const { gltf, replica } = await replicaOf({
      extensionsUsed: EXTENSIONS,
      extensions: LAMPS,
      scenes: [{ nodes: [0, 3, 4] }],
      nodes: [
        { children: [1, 2], extensions: visibility(false) },
        { mesh: 0 },
        { extensions: LAMP },
        { mesh: 0, extensions: visibility(true) },
        { mesh: 0, extensions: visibility() },
      ],
      meshes: [TRIANGLE],
    });
    const nodes = [0, 1, 2, 3, 4].map((node) => replica.content.object(node)!);
    expect(nodes.map(isHidden)).toEqual([true, true, true, false, false]);
    const shown: unknown[] = [];
    gltf.scene.traverseVisible((object) => void shown.push(object));
    expect(shown).toEqual([gltf.scene, nodes[3], nodes[4]]);
  });
});

describe('a skin of more than four joints a vertex', () => {
  it('keeps to the four of most weight', async () => {
    const attributes = {
      POSITION,
      JOINTS_0: JOINTS,
      WEIGHTS_0: WEIGHTS,
      JOINTS_1: JOINTS,
      WEIGHTS_1: WEIGHTS,
    };
    const { gltf } = await replicaOf({
      scenes: [{ nodes: [0, 1] }],
      nodes: [{ mesh: 0, skin: 0 }, {}],
      meshes: [{ primitives: [{ attributes }] }],
      skins: [{ joints: [1] }],
    });
    let found: SkinnedMesh | undefined;
    gltf.scene.traverse((object) => {
      if ('isSkinnedMesh' in object) found = object as SkinnedMesh;
    });
    const { skinWeight, joints_1 } = found!.geometry.attributes;
    // One whole weight in either set: half of each.
    expect([0, 1, 2, 3].map((i) => skinWeight.getComponent(0, i))).toEqual([0.5, 0.5, 0, 0]);
    expect(joints_1).toBeUndefined();
  });
});

describe('specular-glossiness', () => {
  it('is a dielectric of a coloured reflection', async () => {
    const gloss = {
      diffuseFactor: [1, 0, 0.5, 0.25],
      specularFactor: [0, 0.5, 1],
      glossinessFactor: 0.25,
    };
    const { replica } = await replicaOf({
      extensionsUsed: ['KHR_materials_pbrSpecularGlossiness'],
      scenes: [{ nodes: [0] }],
      nodes: [{ mesh: 0 }],
      meshes: [{ primitives: [{ attributes: { POSITION }, material: 0 }] }],
      materials: [
        {
          alphaMode: 'BLEND',
          pbrMetallicRoughness: { baseColorFactor: [0, 1, 0, 1] },
          extensions: { KHR_materials_pbrSpecularGlossiness: gloss },
        },
        { pbrMetallicRoughness: { metallicFactor: 0.5 } },
      ],
    });
    const material = replica.content.materials(0)[0] as MeshPhysicalMaterial;
    expect(material.isMeshPhysicalMaterial).toBe(true);
    expect([...material.color.toArray(), material.opacity]).toEqual(gloss.diffuseFactor);
    expect(material.specularColor.toArray()).toEqual(gloss.specularFactor);
    expect([material.metalness, material.roughness, material.specularIntensity]).toEqual([0, 0.75, 1]);
    // Reflection at normal incidence is the colour itself.
    expect(((material.ior - 1) / (material.ior + 1)) ** 2).toBeGreaterThan(0.99);
  });

  it('has the server’s roughness', () => {
    const texels = Uint8ClampedArray.from([200, 100, 50, 102, 9, 9, 9, 255]);
    expect(roughen(texels, 0.5)).toBe(true);
    expect([...texels]).toEqual([0, 204, 0, 255, 0, 128, 0, 255]);
    expect(roughen(Uint8ClampedArray.from([1, 2, 3, 255]), 1)).toBe(false);
  });
});

describe('padding', () => {
  it('with NULs after the JSON is passed over', async () => {
    const url = glbUrl({ scenes: [{ nodes: [0] }], nodes: [{ mesh: 0 }], meshes: [TRIANGLE] });
    const bytes = Buffer.from(url.split(',')[1], 'base64');
    const end = 20 + bytes.readUInt32LE(12);
    const blanks =
      bytes.subarray(0, end).toString().length - bytes.subarray(0, end).toString().trimEnd().length;
    const json = bytes.subarray(20, end - blanks);
    const padding = Buffer.alloc(4 - (json.length % 4));
    const head = Buffer.from(
      Uint32Array.from([0x46546c67, 2, 0, json.length + padding.length, 0x4e4f534a]).buffer,
    );
    const file = Buffer.concat([head, json, padding, bytes.subarray(end)]);
    file.writeUInt32LE(file.length, 8);
    const gltf = await loadGltf(`data:model/gltf-binary;base64,${file.toString('base64')}`);
    expect((gltf.scene.children[0] as Mesh).isMesh).toBe(true);
  });

  it('is all that is changed', () => {
    const text = (value: string) => Uint8Array.from(Buffer.from(value)).buffer;
    expect(Buffer.from(blankPadding(text('{"a": 1}\n\0\0'))).toString()).toBe('{"a": 1}   ');
    expect(Buffer.from(blankPadding(text('{}'))).toString()).toBe('{}');
    expect(blankPadding(new ArrayBuffer(0)).byteLength).toBe(0);
  });
});

describe('the address of a file', () => {
  it('is that of its name', () => {
    const files = 'http://a/b/scene/';
    expect(sceneFile({ files }, 'the data/50%.bin')).toBe('http://a/b/scene/the%20data/50%25.bin');
    for (const uri of ['caf%C3%A9 50%.bin', 'caf%c3%a9%2050%25.bin', 'café 50%.bin'])
      expect(nameOf(uri)).toBe('café 50%.bin');
    expect(nameOf('caf%E9.bin')).toBe('caf%E9.bin');
  });
});
