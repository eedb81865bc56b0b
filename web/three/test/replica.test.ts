import type { Edit } from '@lumencast/client';
import {
  AnimationClip,
  Group,
  Mesh,
  MeshStandardMaterial,
  NumberKeyframeTrack,
  PointLight,
  Scene,
} from 'three';
import type { GLTF } from 'three/addons/loaders/GLTFLoader.js';
import { beforeEach, describe, expect, it } from 'vitest';
import { timeAt, wrap } from '../src/animations.js';
import { lightSpec } from '../src/lights.js';
import { Replica } from '../src/replica.js';

/** A file with a mesh (node 0) that carries a lamp (node 1), and an animation of the mesh's height. */
function file() {
  const mesh = new Mesh(undefined, new MeshStandardMaterial());
  const lamp = new PointLight(0xffffff, 8);
  mesh.name = 'mesh';
  mesh.add(lamp);
  const scene = new Group().add(mesh);
  const clip = new AnimationClip('rise', 2, [new NumberKeyframeTrack('mesh.position[y]', [0, 2], [0, 4])]);
  const associations = new Map<object, object>([
    [mesh, { nodes: 0, meshes: 0 }],
    [lamp, { nodes: 1 }],
    [mesh.material, { materials: 0 }],
  ]);
  const gltf = {
    scene,
    cameras: [],
    animations: [clip],
    parser: { associations, json: { materials: [{}] } },
  } as unknown as GLTF;
  return { gltf, mesh, lamp };
}

let now = 0;
let sent: { edit: Edit; accept: () => void; refuse: (reason: Error) => void }[];
let events: string[];
const session = {
  edit: (edit: Edit) =>
    new Promise<void>((accept, refuse) => {
      sent.push({ edit, accept, refuse });
    }),
  sceneTime: () => now,
};

function replicaOf(gltf: GLTF) {
  const scene = new Scene().add(gltf.scene);
  return new Replica(scene, gltf, session, (name) => name, {
    added: (object) => void events.push(`added ${object.type}`),
    removed: (object) => void events.push(`removed ${object.type}`),
    warning: (message) => void events.push(message),
  });
}

beforeEach(() => {
  now = 0;
  sent = [];
  events = [];
});

describe('Replica', () => {
  it('applies edits to the nodes of the glTF file', () => {
    const { gltf, mesh, lamp } = file();
    const replica = replicaOf(gltf);
    const edits: Edit[] = [
      { edit: 'move_node', node: 0, translation: [1, 2, 3], rotation: [0, 2, 0, 0], scale: [1, 1, -1] },
      { edit: 'set_light', node: 1, color: [1, 0.5, 0], intensity: 3, range: 7 },
      {
        edit: 'set_material',
        material: 0,
        base_color: [0.2, 0.4, 0.6, 0.5],
        roughness: 0.25,
        emissive: [4, 5, 6],
      },
    ];
    for (const edit of edits) replica.applyAccepted(edit, false);
    expect(mesh.position.toArray()).toEqual([1, 2, 3]);
    expect(mesh.quaternion.toArray()).toEqual([0, 1, 0, 0]);
    expect(mesh.scale.z).toBe(-1);
    expect(lamp.color.toArray()).toEqual([1, 0.5, 0]);
    expect([lamp.intensity, lamp.distance]).toEqual([3, 7]);
    expect(mesh.material.color.toArray()).toEqual([0.2, 0.4, 0.6]);
    expect([mesh.material.opacity, mesh.material.roughness]).toEqual([0.5, 0.25]);
    expect(mesh.material.emissive.toArray()).toEqual([4, 5, 6]);
  });

  it('adds lights and removes nodes, and takes both back with a snapshot', () => {
    const { gltf, mesh } = file();
    const replica = replicaOf(gltf);
    const add: Edit = {
      edit: 'add_light',
      node: 2,
      light: { type: 'spot', inner: 0.1, outer: 0.4, intensity: 9 },
    };
    replica.applyAccepted(add, false);
    const light = replica.content.light(2)!;
    expect(light.parent).toBe(gltf.scene);
    replica.applyAccepted({ edit: 'set_light', node: 2, intensity: 4 }, false);
    replica.applyAccepted({ edit: 'remove_node', node: 0 }, false);
    expect(mesh.parent).toBeNull();

    replica.applySnapshot([]);
    expect(mesh.parent).toBe(gltf.scene);
    expect(light.parent).toBeNull();
    expect(replica.content.light(2)).toBeUndefined();

    replica.applySnapshot([add]);
    expect(replica.content.light(2)!.intensity).toBe(9);
  });

  it('keeps the sizes of lights, which three.js does not know', () => {
    const { gltf, lamp } = file();
    lamp.userData.lumencast = { radius: 0.5 };
    const replica = replicaOf(gltf);
    expect(lightSpec(lamp).radius).toBe(0.5);
    replica.applyAccepted({ edit: 'set_light', node: 1, radius: 0.25 }, false);
    expect(lightSpec(lamp).radius).toBe(0.25);
    const sun: Edit = { edit: 'add_light', node: 2, light: { type: 'directional', angle: 0.01 } };
    replica.applyAccepted(sun, false);
    expect(lightSpec(replica.content.light(2)!)).toMatchObject({ angle: 0.01 });
    expect(lightSpec(new PointLight()).radius).toBe(0);
  });

  it('undoes an own edit that is refused', async () => {
    const { gltf, lamp } = file();
    const replica = replicaOf(gltf);
    const done = replica.edit({ edit: 'set_light', node: 1, intensity: 100 });
    expect(lamp.intensity).toBe(100);
    sent[0].refuse(new Error('too bright'));
    await expect(done).rejects.toThrow('too bright');
    expect(lamp.intensity).toBe(8);
  });

  it('makes an own light the node that the server says', async () => {
    const { gltf } = file();
    const replica = replicaOf(gltf);
    const own = new PointLight();
    const edited = replica.edit({ edit: 'add_light', light: { type: 'point' } });
    const adopted = replica.adoptLight(own, {});
    for (const [node, isOwn] of [
      [4, true],
      [5, false],
      [6, true],
    ] as const)
      replica.applyAccepted({ edit: 'add_light', node, light: { type: 'point' } }, isOwn);
    for (const { accept } of sent) accept();
    await edited;
    expect(await adopted).toBe(6);
    expect(replica.content.object(4)).not.toBe(own);
    expect(replica.content.object(6)).toBe(own);
    expect(replica.content.object(5)).not.toBe(own);
    // It outlives a snapshot that knows it, and is forgotten by one that does not.
    replica.applySnapshot([{ edit: 'add_light', node: 6, light: { type: 'point' } }]);
    expect(replica.content.object(6)).toBe(own);
    replica.applySnapshot([]);
    expect(replica.content.object(6)).toBeUndefined();
  });

  it('plays animations at the server’s time', () => {
    const { gltf, mesh } = file();
    const replica = replicaOf(gltf);
    const heightAt = (time: number) => {
      replica.update((now = time));
      return mesh.position.y;
    };
    expect(heightAt(0.5)).toBeCloseTo(1);
    expect(heightAt(2.5)).toBeCloseTo(1);
    replica.applyAccepted({ edit: 'set_animation', animation: 0, playing: false }, false);
    expect(heightAt(3.25)).toBeCloseTo(1);
    replica.applyAccepted(
      { edit: 'set_animation', animation: 0, playing: true, time: 1.5, speed: -1 },
      false,
    );
    expect(heightAt(3.75)).toBeCloseTo(2);
    replica.applySnapshot([]);
    expect(heightAt(4.25)).toBeCloseTo(0.5);
  });
});

describe('a node that an edit moves after its animation was stopped', () => {
  const edits: Edit[] = [
    { edit: 'set_animation', animation: 0, playing: false, time: 1 },
    { edit: 'move_node', node: 0, translation: [5, 6, 7] },
  ];

  it('stays there, with no picture drawn in between', () => {
    const { gltf, mesh } = file();
    const replica = replicaOf(gltf);
    replica.update(0.5);
    for (const edit of edits) replica.applyAccepted(edit, false);
    replica.update(0.6);
    expect(mesh.position.toArray()).toEqual([5, 6, 7]);
  });

  it('stays there after a snapshot, whatever was known of the node before', () => {
    const { gltf, mesh } = file();
    const replica = replicaOf(gltf);
    replica.applyAccepted({ edit: 'move_node', node: 0, translation: [9, 9, 9] }, false);
    replica.applySnapshot(edits);
    replica.update(0.6);
    expect(mesh.position.toArray()).toEqual([5, 6, 7]);
  });
});

describe('the time of an animation', () => {
  it('runs, stands and goes backwards', () => {
    expect(timeAt({ playing: true, time: 1, speed: 2, since: 10 }, 11)).toBe(3);
    expect(timeAt({ playing: false, time: 1, speed: 2, since: 10 }, 11)).toBe(1);
    expect(wrap(-0.5, 2)).toBe(1.5);
    expect(wrap(4.5, 2)).toBe(0.5);
    expect(wrap(3, 0)).toBe(0);
  });
});
