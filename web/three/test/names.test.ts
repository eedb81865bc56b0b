/** A page's own scene and the file that a server has of it, exported and loaded by three.js itself. */
import { createServer } from 'node:http';
import type { AddressInfo } from 'node:net';
import { Group, type Object3D, PointLight, Scene } from 'three';
import { GLTFExporter } from 'three/addons/exporters/GLTFExporter.js';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
import { describe, expect, it } from 'vitest';
import { matchNames, namesOf, readNames } from '../src/names.js';

function named<T extends Object3D>(object: T, name: string): T {
  object.name = name;
  return object;
}

/** Two chairs of one name, one below the other's neighbour, a lamp whose name is no track's, and no names. */
function room(): Scene {
  const chairs = [named(new Group(), 'chair'), named(new Group(), 'chair')];
  const table = named(new Group(), 'table');
  table.add(chairs[0], new Group().add(named(new PointLight(), 'hall lamp.1')));
  return new Scene().add(table, chairs[1]);
}

const exported = (scene: Scene) => new GLTFExporter().parseAsync(scene, { binary: false }) as Promise<object>;

/** Objects with a name, above before below. */
function objects(scene: Object3D): Object3D[] {
  const all: Object3D[] = [];
  scene.traverse((object) => object.name && object.parent && all.push(object));
  return all;
}

describe('a scene', () => {
  it('matches its own export', async () => {
    const scene = room();
    const nodes = namesOf(await exported(scene));
    expect(nodes.map(({ name }) => name)).toEqual(['table', 'chair', 'hall lamp.1', 'chair']);
    const { pairs, ambiguous } = matchNames(nodes, scene);
    expect(ambiguous).toEqual([]);
    const found = new Map(pairs.map(([object, node]) => [node, object]));
    expect(nodes.map(({ node }) => found.get(node))).toEqual(objects(scene));
  });

  it('matches its file as GLTFLoader names it, and an export of that', async () => {
    const file = await exported(room());
    const loaded = (await new GLTFLoader().parseAsync(JSON.stringify(file), '')).scene;
    const lamp = objects(loaded).find((object) => 'isLight' in object)!;
    expect(lamp.name).not.toBe('hall lamp.1');
    for (const json of [file, await exported(new Scene().add(...loaded.clone().children))]) {
      const nodes = namesOf(json);
      const { pairs, ambiguous } = matchNames(nodes, loaded);
      expect(ambiguous).toEqual([]);
      const found = new Map(pairs.map(([object, node]) => [node, object]));
      expect(nodes.map(({ node }) => found.get(node))).toEqual(objects(loaded));
    }
  });

  it('matches by the name that GLTFLoader makes where only that is left', async () => {
    const lamp = named(new PointLight(), 'hall_lamp1');
    expect(matchNames([{ node: 4, name: 'hall lamp.1' }], lamp).pairs).toEqual([[lamp, 4]]);
  });

  it('leaves what cannot be told apart, and says its name', () => {
    const scene = room();
    const { pairs, ambiguous } = matchNames(
      [
        { node: 0, name: 'chair' },
        { node: 1, name: 'sofa' },
      ],
      scene,
    );
    expect(pairs).toEqual([]);
    expect(ambiguous).toEqual(['chair']);
  });
});

it('of a binary file no more is read than its JSON', async () => {
  const json = Buffer.from(JSON.stringify(await exported(room())));
  const head = Buffer.alloc(20);
  [0x46546c67, 2, 1e9, json.length, 0x4e4f534a].forEach((word, i) => head.writeUInt32LE(word, 4 * i));
  const server = createServer((_, response) => {
    // The rest never comes.
    response.writeHead(200);
    response.write(head.subarray(0, 7));
    setTimeout(() => response.write(Buffer.concat([head.subarray(7), json, Buffer.alloc(50)])), 20);
  });
  await new Promise<void>((resolve) => server.listen(0, '127.0.0.1', resolve));
  const nodes = await readNames(`http://127.0.0.1:${(server.address() as AddressInfo).port}/room.glb`);
  expect(nodes.map(({ name }) => name)).toContain('hall lamp.1');
  server.closeAllConnections();
  server.close();
});
