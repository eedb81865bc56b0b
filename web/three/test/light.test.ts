import type { Edit, FieldInfo, LightmapSurface, LightState, SessionEvents, Vec3 } from '@lumencast/client';
import {
  Color,
  DataUtils,
  Group,
  LinearSRGBColorSpace,
  Mesh,
  MeshBasicMaterial,
  MeshStandardMaterial,
  PerspectiveCamera,
  PlaneGeometry,
  PointLight,
  Quaternion,
  Scene,
  SpotLight,
  SRGBColorSpace,
  Texture,
  Vector3,
} from 'three';
import type { GLTF } from 'three/addons/loaders/GLTFLoader.js';
import { afterEach, beforeEach, describe, expect, it, vi } from 'vitest';
import { LUMELS } from '../src/charted.js';
import { LumencastLight } from '../src/light.js';
import type { LightSession } from '../src/light-session.js';
import {
  chartsOf,
  halves,
  layout,
  lightmapField,
  lightmapLight,
  region,
  surface,
} from './support/lightmaps.js';
import { platform } from './support/platform.js';

const camera = new PerspectiveCamera();
const settle = () => new Promise((resolve) => setTimeout(resolve));

class FakeSession {
  readonly sent: { edit: Edit; accept: () => void; refuse: (error: Error) => void }[] = [];
  readonly files = 'http://localhost:1/scene/';
  readonly status = { state: 'connected', transport: 'websocket' } as const;
  catalog: SessionEvents['catalog'] | undefined;
  unshown: readonly FieldInfo[] = [];
  state: LightState = { fields: [], age: undefined };
  closed = false;
  readonly #listeners = new Map<string, (value: never) => void>();

  on(event: string, listener: (value: never) => void): () => void {
    this.#listeners.set(event, listener);
    return () => this.#listeners.delete(event);
  }

  tell<K extends keyof SessionEvents>(event: K, value: SessionEvents[K]): void {
    this.#listeners.get(event)?.(value as never);
  }

  edit(edit: Edit): Promise<void> {
    return new Promise((accept, refuse) => this.sent.push({ edit, accept, refuse }));
  }

  light = () => this.state;
  sceneTime = () => undefined;
  setCamera = vi.fn();
  close = () => void (this.closed = true);
}

const field: FieldInfo<'volume'> = {
  id: 4,
  use: 'all',
  kind: 'volume',
  shape: {
    basis: 'sh',
    order: 2,
    grid: { center: [0, 0, 0], rotation: [0, 0, 0, 1], size: [1, 1, 1], resolution: [1, 1, 1] },
    offset: { cells: 0.5 },
    cellsMin: [0, 0, 0],
    regions: [],
    layers: 3,
  },
};

/** What a server says that has these fields. */
function catalogOf(...fields: FieldInfo[]): SessionEvents['catalog'] {
  return { epoch: '', scene: { name: '', root: '' }, tickSeconds: 0.04, fields, unknown: [] };
}

let session: FakeSession;
let scene: Scene;
let mesh: Mesh;
let light: LumencastLight;
let warnings: string[];

beforeEach(() => {
  session = new FakeSession();
  scene = new Scene();
  mesh = new Mesh(undefined, new MeshStandardMaterial());
  const root = new Group().add(mesh);
  scene.add(root);
  const gltf = {
    scene: root,
    cameras: [],
    animations: [],
    parser: { associations: new Map([[mesh, { nodes: 3 }]]), json: {} },
  };
  warnings = [];
  light = new LumencastLight(session as unknown as LightSession, platform, {
    scene,
    gltf: gltf as unknown as GLTF,
    onWarning: (message) => warnings.push(message),
  });
});

describe('light', () => {
  it('goes into a grid: halves of value over scale, and the scale in the free channel', () => {
    session.tell('catalog', catalogOf(field));
    const coefficients = new Float32Array(27).fill(1024).with(0, 2048);
    const lit = {
      kind: 'volume' as const,
      field,
      coefficients,
      scale: 2048,
      revision: 1,
      age: 0,
      sceneVersion: 0,
      tick: 0,
    };
    session.state = { fields: [{ ...lit, regions: { lit: 1, all: 1 } }], age: 0 };
    light.update(camera);
    const texture = light.grids[0].texture!;
    const halves = [...(texture.image.data as Uint16Array)].map((half) => DataUtils.fromHalfFloat(half));
    // One probe, and a layer of its copies on every side.
    expect(halves).toHaveLength(3 * 3 * 7 * (3 + 2) * 4);
    expect(halves.slice(0, 4)).toEqual([1, 0.5, 0.5, 0.5]);
    expect(halves.slice(-4)).toEqual([0.5, 0.5, 0.5, 11]);

    const version = texture.version;
    light.update(camera);
    expect(texture.version).toBe(version);
    session.state = { fields: [{ ...lit, revision: 2, regions: { lit: 1, all: 1 } }], age: 0 };
    light.update(camera);
    expect(texture.version).toBe(version + 1);

    light.show = 'direct';
    expect(light.grids[0].texture).not.toBe(texture);
    light.show = 'both';
    expect(light.grids[0].texture).toBe(texture);
    light.dispose();
    expect(scene.children).toHaveLength(1);
    expect(session.closed).toBe(true);
  });
});

describe('follow', () => {
  const edits = () => session.sent.map(({ edit }) => edit);

  it('sends what changed, at most 30 times a second', () => {
    light.follow(mesh);
    light.update(camera, 0);
    expect(edits()).toEqual([]);
    for (let now = 100; now < 200; now += 5) {
      mesh.position.x = now;
      session.sent.forEach(({ accept }) => accept());
      light.update(camera, now);
    }
    expect(edits()[0]).toEqual({ edit: 'move_node', node: 3, translation: [100, 0, 0] });
    expect(edits().length).toBeGreaterThanOrEqual(2);
    expect(edits().length).toBeLessThanOrEqual(4);
  });

  it('does not queue on a link that is too slow', () => {
    light.follow(mesh);
    for (let now = 100; now < 10_000; now += 100) {
      mesh.position.x = now;
      light.update(camera, now);
    }
    expect(session.sent).toHaveLength(4);
  });

  it('is not disturbed by others until it ends, and its last edit is answered', async () => {
    const unfollow = light.follow(mesh);
    mesh.position.x = 1;
    light.update(camera, 100);
    const others: Edit = { edit: 'move_node', node: 3, translation: [9, 0, 0] };
    session.tell('edit', { edit: others, own: false });
    expect(mesh.position.x).toBe(1);
    mesh.position.x = 2;
    unfollow();
    expect(edits().at(-1)).toEqual({ edit: 'move_node', node: 3, translation: [2, 0, 0] });
    expect(mesh.position.x).toBe(2);
    for (const { edit, accept } of session.sent) {
      session.tell('edit', { edit, own: true });
      accept();
    }
    await settle();
    expect(mesh.position.x).toBe(2);
    session.tell('edit', { edit: others, own: false });
    expect(mesh.position.x).toBe(9);
  });

  it('sends everything anew after a restart of the server', () => {
    light.follow(mesh);
    mesh.position.x = 5;
    session.tell('snapshot', []);
    expect(mesh.position.x).toBe(5);
    light.update(camera, 100);
    expect(edits().at(-1)).toMatchObject({ edit: 'move_node', node: 3, translation: [5, 0, 0] });
  });

  it('adds an own light to the server’s scene, aimed at its target, and moves it from then on', async () => {
    const lamp = new SpotLight(0xffffff, 7);
    lamp.position.set(0, 2, 0);
    lamp.target.position.set(0, 2, 5);
    scene.add(lamp, lamp.target);
    session.tell('snapshot', []);
    light.follow(lamp);
    light.update(camera, 100);
    light.update(camera, 200);
    expect(edits()).toHaveLength(1);
    const [{ edit, accept }] = session.sent;
    expect(edit).toMatchObject({ edit: 'add_light', light: { type: 'spot', intensity: 7 } });
    // Along −Z of the node: half a turn about y.
    const { rotation } = (edit as Edit & { edit: 'add_light' }).transform!;
    expect(Math.abs(rotation![1])).toBeCloseTo(1);

    session.tell('edit', { edit: { ...edit, node: 12 } as Edit, own: true });
    accept();
    await settle();
    lamp.intensity = 8;
    light.update(camera, 300);
    expect(edits()[1]).toEqual({ edit: 'set_light', node: 12, intensity: 8 });
    expect(warnings).toEqual(["SpotLight is no light of the server's scene, and is added to it"]);
  });

  it('lets an object of the page stand for a node, a light aimed as it is', () => {
    const arm = new Group();
    arm.rotation.y = Math.PI / 2;
    const lamp = new SpotLight();
    lamp.position.set(0, 0, 0);
    lamp.target.position.set(5, 0, 0);
    scene.add(arm.add(lamp), lamp.target);
    session.tell('edit', { edit: { edit: 'set_light', node: 9, intensity: 3 }, own: false });
    light.setNode(lamp, 9);
    expect(lamp.intensity).toBe(3);
    light.follow(lamp);
    lamp.target.position.set(0, 0, -5);
    light.update(camera, 100);
    const [moved] = edits() as [Edit & { edit: 'move_node' }];
    expect(moved).toMatchObject({ edit: 'move_node', node: 9 });
    const forward = new Vector3(0, 0, -1).applyQuaternion(new Quaternion(...moved.rotation!));
    // An edit's rotation is relative to the parent's.
    expect(forward.applyQuaternion(arm.quaternion).distanceTo(new Vector3(0, 0, -1))).toBeLessThan(1e-6);
    expect(warnings).toEqual([]);
  });

  it('does not take a light for the node that it hangs below', () => {
    const lamp = new PointLight();
    lamp.name = 'torch';
    mesh.add(lamp);
    light.setNode(new Group().add(mesh), 3);
    session.tell('snapshot', []);
    light.follow(lamp);
    light.update(camera, 100);
    expect(edits()).toMatchObject([{ edit: 'add_light' }]);
    expect(warnings).toEqual(["torch is no light of the server's scene, and is added to it"]);
  });

  it('refuses what the server cannot know, and warns of what it refuses', async () => {
    expect(() => light.follow(new Mesh())).toThrow(/not part of the server/);
    light.follow(mesh);
    mesh.position.x = 1;
    light.update(camera, 100);
    session.sent[0].refuse(new Error('no edits without a token'));
    await settle();
    expect(warnings.join()).toMatch(/token/);
  });
});

describe('grids', () => {
  it('are dark while the light is of a field’s former shape', () => {
    const { shape } = field;
    const wider = { ...shape, grid: { ...shape.grid, resolution: [2, 1, 1] as Vec3 } };
    const lit = (of: FieldInfo<'volume'>, probes: number) => ({
      kind: 'volume' as const,
      field: of,
      coefficients: new Float32Array(27 * probes).fill(2),
      scale: 1,
      revision: 1,
      age: undefined,
      sceneVersion: undefined,
      tick: undefined,
      regions: { lit: 1, all: 1 },
    });
    session.tell('catalog', catalogOf({ ...field, shape: wider }));
    session.state = { fields: [lit(field, 1)], age: undefined };
    const first = () => {
      light.update(camera);
      return (light.grids[0].texture!.image.data as Uint16Array).find((half) => half !== 0);
    };
    expect(DataUtils.fromHalfFloat(first() ?? 0)).toBe(0);
    session.state = { fields: [lit({ ...field, shape: wider }, 2)], age: undefined };
    expect(DataUtils.fromHalfFloat(first() ?? 0)).toBe(2);
  });

  it('are made anew as materials leave other numbers of texture units, and warn once', () => {
    const { shape } = field;
    const fields = [-4, 0, 4].map((x, id): FieldInfo => ({
      ...field,
      id,
      shape: { ...shape, grid: { ...shape.grid, center: [x, 0, 0] } },
    }));
    session.tell('catalog', catalogOf(...fields));
    const free = vi.spyOn(platform, 'freeUnits');
    const gridsWith = (units: number) => {
      free.mockReturnValue(units);
      light.update(camera);
      return scene.children.filter((child) => child.name.startsWith('lumencast')).length;
    };
    warnings = [];
    expect(gridsWith(9)).toBe(3);
    const kept = light.grids[0];
    expect(gridsWith(3)).toBe(3);
    expect(light.grids[0]).toBe(kept);
    expect(warnings).toEqual([]);
    expect(gridsWith(1)).toBe(1);
    expect(warnings.join()).toMatch(/texture units are short/);
    const before = warnings.length;
    expect([gridsWith(5), gridsWith(1)]).toEqual([3, 1]);
    expect(warnings).toHaveLength(before);
    expect([gridsWith(-3), gridsWith(0)]).toEqual([0, 0]);
    expect(warnings.slice(before)).toEqual([expect.stringMatching(/no texture unit is free/)]);
    free.mockRestore();
  });
});

describe('lumels', () => {
  const pages = { texture: new Texture(), paint: vi.fn(), dispose: vi.fn() };
  const lightmap = lightmapField(1);
  const SQUARE = chartsOf([0, 2, 1, 2, 3, 1]);
  let wall: Mesh;

  beforeEach(() => {
    vi.clearAllMocks();
    vi.spyOn(platform, 'createPages').mockReturnValue(pages);
    wall = new Mesh(new PlaneGeometry(2, 2));
    scene.add(wall);
    light.setNode(wall, 9);
  });

  afterEach(() => vi.restoreAllMocks());

  /** Lets the session have light of one scale at lumels, if any, and of a volume. */
  function shine(scale: number, ...surfaces: LightmapSurface[]): void {
    const regions = [region({ picture: halves(0, 64, scale) })];
    session.state = { fields: [lightmapLight(regions, layout(...surfaces), lightmap)], age: 0 };
    light.update(camera);
  }

  /** What shaders multiply by. */
  const factors = () => {
    const { lumels, still, moving } = platform.factors;
    let seen: unknown[] = [];
    drawn(() => (seen = [lumels.value, still.value, moving.value, platform.pages!.value]));
    return seen;
  };

  it('light what the layout names, and are given back', () => {
    const { geometry } = wall;
    session.tell('catalog', catalogOf(lightmap, field));
    const before = light.lightRevision;
    shine(4, surface({ node: 9, charts: SQUARE }));
    expect(light.lightRevision).toBeGreaterThan(before);
    expect([light.lumelMeshes, wall.geometry.hasAttribute(LUMELS)]).toEqual([1, true]);
    expect(light.pages).toEqual({ texture: pages.texture, scale: 4 });
    expect(pages.paint).toHaveBeenCalledOnce();
    light.dispose();
    expect(wall.geometry).toBe(geometry);
    expect(pages.dispose).toHaveBeenCalledOnce();
  });

  it('tell how much of the page’s time they take', () => {
    session.tell('catalog', catalogOf(lightmap, field));
    expect(light.lumelTime).toBe(0);
    pages.paint.mockImplementationOnce(() => {
      for (const begun = performance.now(); performance.now() < begun + 5;);
    });
    shine(4);
    expect(light.lumelTime).toBeGreaterThanOrEqual(5);
  });

  it('are weighed apart from what moves, and without them all is weighed alike', () => {
    Object.assign(light.strengths, { static: 0.5, dynamic: 3 });
    expect(factors()).toEqual([0, 0.5, 0.5, null]);
    session.tell('catalog', catalogOf(lightmap, field));
    shine(8);
    expect(factors()).toEqual([4, 0.5, 3, pages.texture]);
    light.preExposure = 0.25;
    expect(factors()).toEqual([1, 0.125, 0.75, pages.texture]);
    light.show = 'direct';
    expect(factors()[0]).toBe(0);
    const { lumels, still, moving } = platform.factors;
    expect([lumels.value, still.value, moving.value, platform.pages!.value]).toEqual([1, 1, 1, null]);
  });

  it('take a texture unit before grids do', () => {
    const other = { ...field, id: 5 };
    session.tell('catalog', catalogOf(field, other));
    expect(light.grids).toHaveLength(2);
    session.tell('catalog', catalogOf(lightmap, field, other));
    expect(light.grids).toHaveLength(1);
  });

  it('keep their pages while these take the same room', () => {
    const elsewhere = { ...lightmap, shape: { ...lightmap.shape, layout: '1'.repeat(64) } };
    session.tell('catalog', catalogOf(lightmap));
    session.tell('catalog', catalogOf(elsewhere, field));
    expect(platform.createPages).toHaveBeenCalledOnce();
    session.tell('catalog', catalogOf(lightmapField(1, 16)));
    expect(platform.createPages).toHaveBeenLastCalledWith(16, 16);
    // Until there is new light, it is of the former shape.
    shine(4, surface({ node: 9, charts: SQUARE }));
    expect([light.lumelMeshes, pages.paint.mock.calls.length]).toEqual([0, 0]);
    session.tell('catalog', catalogOf(field));
    expect(pages.dispose).toHaveBeenCalledTimes(2);
    expect(light.pages).toBeUndefined();
  });

  it('stay on their meshes while pages are added, not while fewer are left', () => {
    const square = surface({ node: 9, charts: SQUARE });
    const ofPages = (pages: number) => session.tell('catalog', catalogOf(lightmapField(1, 8, pages)));
    ofPages(1);
    shine(4, square);
    const { geometry } = wall;
    ofPages(2);
    expect([light.lumelMeshes, wall.geometry]).toEqual([1, geometry]);
    const regions = [region({ picture: halves(0, 64, 4) })];
    session.state = { fields: [lightmapLight(regions, layout(square), lightmapField(1, 8, 2))], age: 0 };
    light.update(camera);
    expect([light.lumelMeshes, wall.geometry]).toEqual([1, geometry]);
    // What is there is painted anew, whole and at once.
    expect(pages.paint.mock.lastCall![0]).toMatchObject([{ x: 0, y: 0, share: 1 }]);
    ofPages(1);
    expect(light.lumelMeshes).toBe(0);
  });

  it('take no room where the session cannot show them', () => {
    session.unshown = [lightmap];
    session.tell('catalog', catalogOf(lightmap, field));
    expect([light.pages, light.grids.length]).toEqual([undefined, 1]);
    expect(platform.createPages).not.toHaveBeenCalled();
  });

  it.each([
    ['half floats', 8, () => vi.spyOn(platform, 'createPages').mockReturnValue(undefined), /half floats/],
    ['a texture unit', 8, () => vi.spyOn(platform, 'freeUnits').mockReturnValue(0), /unit/],
    ['textures large enough', 4096, () => {}, /larger than textures/],
  ])('are not shown without %s, with a warning', (_, pageSize, lack, words) => {
    lack();
    session.tell('catalog', catalogOf(lightmapField(1, pageSize)));
    shine(4, surface({ node: 9, charts: SQUARE }));
    expect(light.lumelMeshes).toBe(0);
    expect(warnings.filter((warning) => warning.includes('lumels'))).toEqual([expect.stringMatching(words)]);
  });
});

/** As a renderer does; `within` draws more. */
function drawn(within: () => void): void {
  scene.onBeforeRender(undefined!, scene, camera, undefined!, undefined!, undefined!);
  within();
  scene.onAfterRender(undefined!, scene, camera, undefined!, undefined!, undefined!);
}

describe('shadows', () => {
  /** What a shadow map is drawn by, and whether it is to be drawn. */
  function shadowOf({ shadow }: PointLight) {
    const { camera, needsUpdate } = shadow;
    return { far: (camera as PerspectiveCamera).far, needsUpdate };
  }

  it('are fitted for the first picture, and drawn anew when they are fitted again', () => {
    const [room, lamp] = [new Mesh(new PlaneGeometry(3, 4)), new PointLight()];
    const own = new Scene().add(room, lamp);
    const lit = new LumencastLight(session as unknown as LightSession, platform, { scene: own });
    lamp.shadow.autoUpdate = false;
    lit.update(camera, 100);
    expect(shadowOf(lamp)).toEqual({ far: 7.5, needsUpdate: true });

    lamp.shadow.needsUpdate = false;
    lit.update(camera, 1000);
    expect(shadowOf(lamp)).toEqual({ far: 7.5, needsUpdate: false });

    room.scale.setScalar(2);
    session.tell('snapshot', []);
    lit.update(camera, 2000);
    expect(shadowOf(lamp)).toEqual({ far: 15, needsUpdate: true });
    lit.dispose();
  });
});

describe('show', () => {
  it('darkens lights for the time of rendering only', () => {
    const lamp = new PointLight(0xffffff, 5);
    scene.add(lamp);
    light.show = 'indirect';
    drawn(() => expect(lamp.intensity).toBe(0));
    expect(lamp.intensity).toBe(5);
  });

  it('gives lights back after a picture that was drawn within another, as shadow maps are', () => {
    const lamp = new PointLight(0xffffff, 5);
    scene.add(lamp);
    light.show = 'indirect';
    drawn(() => {
      drawn(() => expect(lamp.intensity).toBe(0));
      expect(lamp.intensity).toBe(0);
    });
    expect(lamp.intensity).toBe(5);
  });

  it('gives lights back after a picture that failed', async () => {
    const lamp = new PointLight(0xffffff, 5);
    scene.add(lamp);
    light.show = 'indirect';
    expect(() => drawn(() => expect.fail('no picture'))).toThrow(/no picture/);
    await settle();
    expect(lamp.intensity).toBe(5);
    drawn(() => expect(lamp.intensity).toBe(0));
    expect(lamp.intensity).toBe(5);
  });
});

describe('preExposure', () => {
  const texture = (colorSpace: string) => Object.assign(new Texture(), { colorSpace });
  let lamp: PointLight;
  let glow: MeshStandardMaterial;
  let unlit: MeshBasicMaterial;
  let shownAsItIs: MeshBasicMaterial;
  const radiating = () => [
    lamp.intensity,
    glow.emissiveIntensity,
    glow.lightMapIntensity,
    glow.envMapIntensity,
    ...unlit.color.toArray(),
    scene.environmentIntensity,
    scene.backgroundIntensity,
    platform.factors.moving.value,
  ];

  beforeEach(() => {
    lamp = new PointLight(0xffffff, 5);
    glow = new MeshStandardMaterial({ emissiveIntensity: 3, lightMapIntensity: 2, envMapIntensity: 7 });
    unlit = new MeshBasicMaterial({ color: 0x000000 });
    unlit.color.setRGB(2, 4, 6);
    shownAsItIs = new MeshBasicMaterial({ color: 0xffffff, toneMapped: false });
    // One material on two meshes is still multiplied once.
    scene.add(lamp, ...[glow, glow, unlit, shownAsItIs].map((material) => new Mesh(undefined, material)));
    scene.backgroundIntensity = 8;
  });

  it('multiplies all that radiates while the scene is drawn, and gives it back', () => {
    const before = radiating();
    expect(before).toEqual([5, 3, 2, 7, 2, 4, 6, 1, 8, 1]);
    light.preExposure = 0.25;
    drawn(() => {
      expect(radiating()).toEqual(before.map((value) => value / 4));
      drawn(() => expect(radiating()).toEqual(before.map((value) => value / 4)));
      expect(radiating()).toEqual(before.map((value) => value / 4));
    });
    expect(radiating()).toEqual(before);
  });

  it('touches nothing unless it is set', () => {
    const writes: string[] = [];
    for (const key of ['emissiveIntensity', 'envMapIntensity'] as const) {
      const value = glow[key];
      Object.defineProperty(glow, key, { get: () => value, set: () => writes.push(key) });
    }
    const before = radiating();
    drawn(() => expect(radiating()).toEqual(before));
    expect(writes).toEqual([]);
  });

  it('leaves what three.js shows without exposure', () => {
    light.preExposure = 0.25;
    scene.background = texture(SRGBColorSpace);
    drawn(() => {
      expect(scene.backgroundIntensity).toBe(8);
      expect(shownAsItIs.color.r).toBe(1);
    });
    scene.background = texture(LinearSRGBColorSpace);
    drawn(() => expect(scene.backgroundIntensity).toBe(2));
    const colour = new Color(1, 1, 1);
    scene.background = colour;
    drawn(() => expect(colour.r).toBe(1));
  });

  it('keeps indirect light alone without lamps', () => {
    light.preExposure = 0.25;
    light.show = 'indirect';
    drawn(() => {
      expect(lamp.intensity).toBe(0);
      expect(glow.emissiveIntensity).toBe(0.75);
    });
    expect([lamp.intensity, glow.emissiveIntensity]).toEqual([5, 3]);
  });
});
