/** Which meshes get geometries with lumels, and when they get their own ones back. */
import type { LightmapSurface } from '@lumencast/client';
import {
  type BufferAttribute,
  Group,
  InstancedBufferAttribute,
  InstancedMesh,
  Mesh,
  MeshPhysicalMaterial,
  type Object3D,
  PlaneGeometry,
  Scene,
} from 'three';
import { beforeEach, describe, expect, it } from 'vitest';
import { FIRST, isCharted, LUMEL_CORNER, LUMEL_SHARE, LUMELS, NO_LUMELS } from '../src/charted.js';
import { Content, instantiateMesh } from '../src/content.js';
import { LumelSurfaces } from '../src/lumel-surfaces.js';
import { load, POSITION } from './support/glb.js';
import { chartsOf, layout, surface } from './support/lightmaps.js';

const SQUARE = chartsOf([0, 2, 1, 2, 3, 1]);
const corner = () => [0, 0] as const;

let scene: Scene;
let content: Content;
let warnings: string[];
let surfaces: LumelSurfaces;
let revision: number;
let now: number;

beforeEach(() => {
  scene = new Scene();
  content = new Content();
  warnings = [];
  surfaces = new LumelSurfaces(scene, content, (message) => void warnings.push(message));
  [revision, now] = [0, 0];
});

/** A node with a mesh of a square; squares of one geometry share it. */
function square(node: number, geometry = new PlaneGeometry(2, 2)): Mesh {
  const mesh = new Mesh(geometry);
  scene.add(mesh);
  content.setNode(node, mesh);
  return mesh;
}

function set(...nodes: number[]): void {
  const all = nodes.map((node) =>
    surface({ node, charts: SQUARE, rectangles: [{ page: 0, x: node, y: 0 }] }),
  );
  surfaces.setLayouts([{ layout: layout(...all), corner }]);
}

function frame(milliseconds = 16): void {
  scene.updateMatrixWorld();
  now += milliseconds;
  surfaces.update(revision, now, Infinity);
}

const isLit = (object: Object3D) => isCharted((object as Mesh).geometry);

/** How much of a mesh's light lumels make; 0 where it shows its own geometry. */
const share = ({ geometry }: Mesh) => geometry.attributes[LUMEL_SHARE]?.getX(0) ?? 0;

/** Copies of a square, drawn in one go. */
function squares(node: number, count: number): InstancedMesh {
  const mesh = new InstancedMesh(new PlaneGeometry(2, 2), undefined, count);
  scene.add(mesh);
  content.setNode(node, mesh);
  return mesh;
}

describe('meshes that a layout names', () => {
  it('get a geometry with lumels, and their own one back when it names them no more', () => {
    const [one, other] = [square(0), square(1)];
    const own = [one.geometry, other.geometry];
    set(0, 1);
    frame();
    expect([one, other].map(isLit)).toEqual([true, true]);
    expect(surfaces.count).toBe(2);
    set(1);
    frame();
    frame(500);
    expect([one, other].map(isLit)).toEqual([false, true]);
    surfaces.clear();
    expect([one.geometry, other.geometry]).toEqual(own);
  });

  it('share what is parted alike, and have lumels of their own', () => {
    const geometry = new PlaneGeometry(2, 2);
    const [one, other] = [square(0, geometry), square(1, geometry)];
    set(0, 1);
    frame();
    expect(one.geometry).not.toBe(other.geometry);
    expect(one.geometry.getAttribute('position')).toBe(other.geometry.getAttribute('position'));
    expect(one.geometry.index).toBe(other.geometry.index);
    const first = (mesh: Mesh) => mesh.geometry.getAttribute(LUMELS).getX(0);
    expect(first(other) - first(one)).toBe(1);
  });

  it('keep their geometry where nothing of theirs changes', () => {
    const mesh = square(0);
    square(1);
    set(0);
    frame();
    const { geometry } = mesh;
    set(0, 1);
    frame();
    expect(mesh.geometry).toBe(geometry);
    surfaces.setLayouts([{ layout: layout(surface({ charts: SQUARE })), corner: () => [64, 0] }]);
    frame();
    expect(mesh.geometry).not.toBe(geometry);
    expect(share(mesh)).toBe(1);
  });

  it('are lit once they are here', () => {
    set(4);
    frame();
    const late = square(4);
    frame();
    expect(isLit(late)).toBe(false);
    revision++;
    frame();
    expect(share(late)).toBe(1);
    // A snapshot has another object stand for the node.
    content.deleteNode(4);
    revision++;
    frame();
    expect(isLit(late)).toBe(false);
    const other = square(4);
    revision++;
    frame();
    expect(share(other)).toBe(1);
  });

  it('leave their lumels when they move, and find them where they were', () => {
    const above = new Group();
    const mesh = square(0);
    scene.add(above.add(mesh));
    set(0);
    frame();
    above.position.x = 1;
    frame();
    expect([share(mesh), surfaces.count]).toEqual([1, 1]);
    frame(125);
    expect(share(mesh)).toBe(0.75);
    frame(375);
    expect([isLit(mesh), surfaces.count]).toEqual([false, 0]);
    above.position.x = 0;
    frame();
    frame(125);
    expect(share(mesh)).toBe(0.25);
    // The server takes them from it, and gives them back where it rests.
    above.position.x = 2;
    set();
    frame(0);
    frame(1000);
    expect(isLit(mesh)).toBe(false);
    set(0);
    frame();
    frame(250);
    expect(share(mesh)).toBe(0.5);
  });

  it('keep their lumels where they are put right by rounding', () => {
    const mesh = square(0);
    mesh.position.set(-2.501316059358957, 0.1, 800.01);
    set(0);
    frame();
    mesh.position.fromArray([...mesh.position].map(Math.fround));
    frame();
    frame(1000);
    expect([share(mesh), surfaces.count]).toEqual([1, 1]);
    mesh.position.y += 1e-3;
    frame();
    frame(1000);
    expect(surfaces.count).toBe(0);
  });

  it('have lumels where they are found when the page is shown again', () => {
    const mesh = square(0);
    set(0);
    frame();
    mesh.position.x = 1;
    frame(5000);
    expect(isLit(mesh)).toBe(true);
  });

  it('are left alone when the program gives them another geometry', () => {
    const mesh = square(0);
    set(0);
    frame();
    const other = new PlaneGeometry(3, 3, 2);
    mesh.geometry = other;
    frame();
    surfaces.clear();
    expect(mesh.geometry).toBe(other);
  });

  it('are made a few in a frame', () => {
    const all = [0, 1, 2].map((node) => square(node));
    set(0, 1, 2);
    scene.updateMatrixWorld();
    const counts = all.map(() => {
      surfaces.update(revision, (now += 16), 0);
      return surfaces.count;
    });
    expect(counts).toEqual([1, 2, 3]);
  });
});

describe('light passes from probes to lumels, and back', () => {
  it('within half a second, from where it is', () => {
    const [mesh] = [square(0), square(1)];
    set(1);
    frame();
    set(0, 1);
    frame();
    expect([share(mesh), isLit(mesh)]).toEqual([0, true]);
    for (const expected of [0.25, 0.5, 0.75]) {
      frame(125);
      expect(share(mesh)).toBe(expected);
    }
    set(1);
    frame(0);
    frame(125);
    expect(share(mesh)).toBe(0.5);
    set(0, 1);
    frame(0);
    frame(125);
    expect(share(mesh)).toBe(0.75);
    frame(125);
    expect(share(mesh)).toBe(1);
    frame(125);
    expect(share(mesh)).toBe(1);
  });

  it('at 60 Hz in thirty even frames, and tells the device so', () => {
    const [mesh] = [square(0), square(1)];
    set(0, 1);
    frame();
    set(1);
    frame();
    const attribute = mesh.geometry.attributes[LUMEL_SHARE] as BufferAttribute;
    const steps = Array.from({ length: 29 }, () => {
      const [before, { version }] = [share(mesh), attribute];
      frame(1000 / 60);
      expect(attribute.version - version).toBe(1);
      return before - share(mesh);
    });
    for (const step of steps) expect(step * 30).toBeCloseTo(1, 5);
    expect(share(mesh) * 30).toBeCloseTo(1, 5);
    set(0, 1);
    frame(0);
    frame(500);
    const { version } = attribute;
    frame();
    expect([share(mesh), attribute.version]).toEqual([1, version]);
  });

  it('from other places of its lumels at once, with the share that it had', () => {
    const mesh = square(0);
    square(1);
    set(1);
    frame();
    set(0, 1);
    frame();
    frame(250);
    const { geometry } = mesh;
    const first = () => mesh.geometry.getAttribute(LUMELS).getX(0);
    const before = first();
    surfaces.setLayouts([{ layout: layout(surface({ charts: SQUARE })), corner: () => [64, 0] }]);
    frame(0);
    expect(mesh.geometry).not.toBe(geometry);
    expect([share(mesh), first() - before]).toEqual([0.5, 66]);
  });

  it('at once where all lumels have gone, and with the next layout', () => {
    const mesh = square(0);
    set(0);
    frame();
    surfaces.clear();
    expect(isLit(mesh)).toBe(false);
    surfaces.setLayouts([]);
    frame();
    set(0);
    frame();
    expect(share(mesh)).toBe(1);
  });

  it('for each of those that share a geometry', () => {
    const geometry = new PlaneGeometry(2, 2);
    const [one, other] = [square(0, geometry), square(1, geometry)];
    set(0, 1);
    frame();
    set(1);
    frame();
    frame(250);
    expect([one, other].map(share)).toEqual([0.5, 1]);
    frame(250);
    expect([one, other].map(share)).toEqual([0, 1]);
    expect(one.geometry).toBe(geometry);
    expect(Object.keys(other.geometry.attributes)).toContain('position');
  });
});

/** The square's triangles are 0 2 1 and 2 3 1. */
it('triangles of charts may begin at any corner, and corners be left at the end', () => {
  const charts = chartsOf([2, 1, 0, 1, 2, 3]);
  charts.at.set([0, 1, 2, 3].flatMap((vertex) => [0.25 * vertex, 1]));
  const geometry = new PlaneGeometry(2, 2);
  geometry.setIndex([...geometry.index!.array, 0]);
  const mesh = square(0, geometry);
  surfaces.setLayouts([{ layout: layout(surface({ charts })), corner }]);
  frame();
  const { attributes, index } = mesh.geometry;
  const places = [...index!.array].map((vertex) => attributes[LUMELS].getX(vertex));
  expect(places).toEqual([...[0, 2, 1, 2, 3, 1].map((v) => FIRST + 2 + 0.25 * v), NO_LUMELS]);
  const positions = (of: typeof mesh.geometry) =>
    [...of.index!.array].map((vertex) => of.attributes.position.getX(vertex));
  expect(positions(mesh.geometry)).toEqual(positions(geometry));
});

describe('probes alone light', () => {
  it('what is wound the other way', () => {
    const mesh = square(0);
    surfaces.setLayouts([{ layout: layout(surface({ charts: chartsOf([2, 0, 1, 2, 3, 1]) })), corner }]);
    frame();
    expect(isLit(mesh)).toBe(false);
    expect(warnings.length).toBe(1);
  });

  it('what has other triangles, with one warning', () => {
    const meshes = [0, 1].map((node) => square(node, new PlaneGeometry(2, 2, 3)));
    meshes[0].name = 'wall';
    set(0, 1);
    frame();
    frame();
    expect(meshes.map(isLit)).toEqual([false, false]);
    expect(warnings).toEqual([expect.stringMatching(/triangles.*wall/)]);
  });

  it('what light goes through', () => {
    const glass = new Mesh(new PlaneGeometry(2, 2), new MeshPhysicalMaterial({ transmission: 1 }));
    scene.add(glass);
    content.setNode(0, glass);
    set(0);
    frame();
    expect(isLit(glass)).toBe(false);
    expect(warnings).toEqual([]);
  });

  it('further instances, and surfaces whose rectangles do not fit their charts', () => {
    const mesh = square(0);
    for (const wrong of [{ copy: 1 }, { rectangles: [] }]) {
      surfaces.setLayouts([{ layout: layout(surface({ charts: SQUARE, ...wrong })), corner }]);
      frame();
      expect(isLit(mesh)).toBe(false);
    }
  });

  it('copies that a program makes of what has lumels', () => {
    const mesh = square(0);
    const { geometry } = mesh;
    set(0);
    frame();
    const copy = mesh.clone();
    scene.add(copy);
    expect(isLit(copy)).toBe(true);
    frame();
    expect(copy.geometry).toBe(geometry);
    expect(isLit(mesh)).toBe(true);
  });
});

it('meshes are found by node and primitive in what GLTFLoader has read', async () => {
  const TRIANGLE = { attributes: { POSITION } };
  const gltf = await load({
    scenes: [{ nodes: [0, 1] }],
    nodes: [{ mesh: 0, children: [2] }, { mesh: 0 }, { mesh: 1 }],
    meshes: [{ primitives: [TRIANGLE, { ...TRIANGLE, material: 0 }] }, { primitives: [TRIANGLE] }],
    materials: [{}],
  });
  scene.add(gltf.scene);
  content.add(gltf, { node: 0, material: 0, animation: 0 });
  const wanted = [
    [0, 0],
    [0, 1],
    [1, 1],
    [2, 0],
  ].map(([node, primitive]) => surface({ node, primitive, charts: chartsOf([0, 1, 2]) }));
  surfaces.setLayouts([{ layout: layout(...wanted), corner }]);
  frame();
  expect(surfaces.count).toBe(4);
  const lit = wanted.map(({ node, primitive }) => content.mesh(node, primitive)!);
  expect(lit.map(isLit)).toEqual([true, true, true, true]);
  expect(isLit(content.mesh(1, 0)!)).toBe(false);
  expect(content.mesh(2, 1)).toBeUndefined();
  // What is made of the file later has no lumels of the mesh that it is made from.
  const later: Mesh[] = [];
  (await instantiateMesh(gltf, 0)).traverse((object) => {
    if ((object as Mesh).isMesh) later.push(object as Mesh);
  });
  expect(later.map(isLit)).toEqual([false, false]);
});

describe('copies of a mesh', () => {
  const OTHER = chartsOf([0, 2, 1, 2, 3, 1]);
  const of = (copy: number, changes: Partial<LightmapSurface> = {}) =>
    surface({ charts: SQUARE, copy, rectangles: [{ page: 0, x: 10 * copy, y: copy }], ...changes });
  const corners = ({ geometry }: Mesh) => {
    const attribute = geometry.getAttribute(LUMEL_CORNER);
    return Array.from({ length: attribute.count }, (_, copy) =>
      Array.from({ length: 4 }, (_, k) => attribute.getComponent(copy, k)),
    );
  };
  const put = (x: number, y: number) => [FIRST + x, FIRST + y];
  const NONE = [NO_LUMELS, NO_LUMELS];
  const lay = (...all: LightmapSurface[]) => surfaces.setLayouts([{ layout: layout(...all), corner }]);

  it('have lumels of their own, on both sides', () => {
    const mesh = squares(0, 3);
    lay(of(0), of(0, { back: true, rectangles: [{ page: 0, x: 50, y: 60 }] }), of(2), of(3));
    frame();
    expect(corners(mesh)).toEqual([
      [...put(0, 0), ...put(50, 60)],
      [...NONE, ...NONE],
      [...put(20, 2), ...NONE],
    ]);
    // Their charts begin at each one's corner.
    const lumels = mesh.geometry.getAttribute(LUMELS);
    expect([lumels.getX(0), lumels.getY(0)]).toEqual(put(1, 1));
    expect(mesh.geometry.getAttribute(LUMEL_SHARE).count).toBe(3);
    expect([surfaces.count, warnings]).toEqual([1, []]);
  });

  it('pass from probes to lumels, and back, all at once', () => {
    const mesh = squares(0, 2);
    lay(of(0), of(1));
    frame();
    mesh.position.x = 1;
    frame();
    frame(125);
    const { geometry } = mesh;
    const shares = () => [0, 1].map((copy) => geometry.getAttribute(LUMEL_SHARE).getX(copy));
    expect(shares()).toEqual([0.75, 0.75]);
    const [[x]] = corners(mesh);
    expect(x).toBe(FIRST);
    frame(375);
    expect(isLit(mesh)).toBe(false);
  });

  it('keep what they have where others move on the pages', () => {
    const mesh = squares(0, 2);
    lay(of(0), of(1));
    frame();
    lay(of(0), of(1, { rectangles: [{ page: 0, x: 70, y: 80 }] }));
    frame();
    expect(corners(mesh)).toEqual([
      [...put(0, 0), ...NONE],
      [...put(70, 80), ...NONE],
    ]);
  });

  it('stay with probes where their charts are not those of most, or lie on several rectangles', () => {
    const mesh = squares(0, 3);
    lay(of(0, { charts: OTHER }), of(1), of(2));
    frame();
    expect(corners(mesh).map(([x]) => x)).toEqual([NO_LUMELS, FIRST + 10, FIRST + 20]);
    expect(warnings).toEqual([expect.stringMatching(/copies.*probes/)]);

    const [whole, all] = [{ ...SQUARE, sizes: [SQUARE.sizes[0], SQUARE.sizes[0]] }, squares(1, 1)];
    const rectangles = [0, 1].map((page) => ({ page, x: 0, y: 0 }));
    lay(of(0, { node: 1, charts: whole, rectangles }));
    frame();
    expect(isLit(all)).toBe(false);
    expect(warnings).toHaveLength(1);
  });

  it('keep what their geometry has for each of them', () => {
    const mesh = squares(0, 2);
    const tint = new InstancedBufferAttribute(Float32Array.of(1, 2), 1);
    mesh.geometry.setAttribute('tint', tint);
    lay(of(0), of(1));
    frame();
    expect(mesh.geometry.getAttribute('tint')).toBe(tint);
  });
});
