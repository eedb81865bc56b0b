/** Connecting a scene to a light, with and without a server. */
import { ConnectError } from '@lumencast/client';
import { Mesh, PerspectiveCamera, PointLight, Scene } from 'three';
import { afterEach, beforeEach, describe, expect, it, vi } from 'vitest';
import { FakeNet } from '../../client/test/support/fake-link.js';
import { FakeServer } from '../../client/test/support/fake-server.js';
import { lightFile } from '../../client/test/support/light-file.js';
import { connectWith, showWith } from '../src/connect.js';
import { glbUrl, load, POSITION } from './support/glb.js';
import { platform } from './support/platform.js';

const ROOM = {
  scenes: [{ nodes: [0] }],
  nodes: [{ name: 'wall', mesh: 0 }],
  meshes: [{ primitives: [{ attributes: { POSITION } }] }],
};

const camera = new PerspectiveCamera();
let net: FakeNet;
let asked: string[];

beforeEach(() => {
  net = new FakeNet();
  asked = [];
  const { fetch } = globalThis;
  vi.stubGlobal('fetch', (request: Request | string) => {
    asked.push(new Request(request).url);
    return fetch(glbUrl(ROOM));
  });
});

afterEach(() => vi.unstubAllGlobals());

/** The brightest of what the first grid's atlas holds, as a half. */
const brightest = (data: ArrayLike<number>) => Math.max(...Array.from(data).filter((half) => half < 0x7c00));

describe('connect', () => {
  it('loads the server’s scene once the server has named it', async () => {
    const scene = new Scene();
    const connecting = connectWith(platform, 'http://localhost:4443/test', {
      scene,
      session: { connector: net.connector },
    });
    await vi.waitFor(() => net.link);
    expect(asked).toEqual([]);
    net.link.deliver('catalog', new FakeServer().catalog);
    const light = await connecting;
    expect(asked).toEqual(['http://localhost:4443/scene/test.glb']);
    expect(light.content.object(0)!.name).toBe('wall');
    expect(scene.getObjectByName('wall')).toBeDefined();
    light.dispose();
  });

  it('shows saved light when there is no server', async () => {
    net.refuse = 'nobody there';
    const scene = new Scene();
    const saved = lightFile(new FakeServer({ brightness: () => 7 }));
    const light = await connectWith(platform, 'http://localhost:4443/test', {
      scene,
      session: { connector: net.connector, saved },
    });
    expect(scene.getObjectByName('wall')).toBeDefined();
    light.update(camera);
    expect(light.lightRevision).toBe(1);
    expect(brightest(light.grids[0].texture!.image.data as Uint16Array)).toBeGreaterThan(0);
    expect(light.session.status.state).toBe('lost');
    light.dispose();
  });

  it('leaves a scene alone that shows something already', async () => {
    const gltf = await load(ROOM);
    asked = [];
    const scene = new Scene().add(gltf.scene);
    const light = await connectWith(platform, 'http://localhost:4443/test', {
      scene,
      gltf,
      session: { connector: net.connector },
    });
    expect(asked).toEqual([]);
    expect(light.content.object(0)).toBe(scene.getObjectByName('wall') as Mesh);
    light.dispose();
  });

  it('matches a page’s own scene with the server’s by name', async () => {
    const wall = new Mesh();
    wall.name = 'wall';
    const [stray, plant] = [new PointLight(), new Mesh()];
    stray.name = 'stray';
    plant.name = 'plant';
    const scene = new Scene().add(wall, stray, plant);
    const onWarning = vi.fn<(message: string) => void>();
    const light = await connectWith(platform, 'http://localhost:4443/test', {
      ...{ scene, onWarning, session: { connector: net.connector } },
    });
    // Before the server has said what it has.
    for (const object of [wall, stray, plant]) light.follow(object);
    light.update(camera, 100);
    expect(onWarning).not.toHaveBeenCalled();
    const server = new FakeServer();
    net.link.deliver('catalog', server.catalog);
    net.link.tick(server);
    await vi.waitFor(() => expect(light.content.object(0)).toBe(wall));
    expect(asked).toEqual(['http://localhost:4443/scene/test.glb']);
    await vi.waitFor(() => expect(onWarning).toHaveBeenCalledTimes(1));
    expect(onWarning.mock.lastCall![0]).toContain('plant is not part of the server');
    light.update(camera, 200);
    expect(onWarning.mock.lastCall![0]).toContain('stray is no light of the server');
    expect(net.link.edits.map(({ edit }) => edit)).toMatchObject([
      { edit: 'move_node', node: 0 },
      { edit: 'add_light', name: 'stray', light: { type: 'point' } },
    ]);
    light.dispose();
  });

  it('rejects when there is nothing to show and three attempts have failed', async () => {
    net.refuse = new ConnectError('unreachable', 'nobody answers');
    const attempts = vi.fn(net.connector);
    const connecting = connectWith(platform, 'http://localhost:4443/test', {
      scene: new Scene(),
      session: { connector: attempts },
    });
    await expect(connecting).rejects.toMatchObject({ problem: 'unreachable', message: 'nobody answers' });
    expect(attempts).toHaveBeenCalledTimes(3);
    await new Promise((resolve) => setTimeout(resolve, 1100));
    expect(attempts).toHaveBeenCalledTimes(3);
  });

  it('rejects at once where further attempts would fail alike', async () => {
    net.refuse = new ConnectError('origin', 'not from there');
    const attempts = vi.fn(net.connector);
    const connecting = connectWith(platform, 'http://localhost:4443/test', {
      scene: new Scene(),
      session: { connector: attempts },
    });
    await expect(connecting).rejects.toMatchObject({ problem: 'origin' });
    expect(attempts).toHaveBeenCalledTimes(1);
  });

  it('warns once of a server that is not there while the page has a scene, and goes on trying', async () => {
    net.refuse = new ConnectError('unreachable', 'nobody answers');
    const attempts = vi.fn(net.connector);
    const onWarning = vi.fn<(message: string) => void>();
    const gltf = await load(ROOM);
    const scene = new Scene().add(gltf.scene);
    const session = { connector: attempts };
    const light = await connectWith(platform, 'http://localhost:4443/test', {
      ...{ scene, gltf, onWarning, session },
    });
    await vi.waitFor(() => expect(attempts.mock.calls.length).toBeGreaterThan(2), { timeout: 10_000 });
    expect(onWarning.mock.calls).toEqual([['not connected, trying again: nobody answers']]);
    net.refuse = new ConnectError('origin', 'not from there');
    await vi.waitFor(() => expect(onWarning).toHaveBeenCalledTimes(2), { timeout: 10_000 });
    expect(onWarning).toHaveBeenLastCalledWith('not connected, trying again: not from there');
    net.refuse = undefined;
    await vi.waitFor(() => net.link, { timeout: 10_000 });
    net.link.deliver('catalog', new FakeServer().catalog);
    expect(onWarning).toHaveBeenLastCalledWith('connected to the server');
    net.link.break('the server has gone');
    await vi.waitFor(() => expect(onWarning).toHaveBeenCalledTimes(4));
    expect(onWarning).toHaveBeenLastCalledWith('not connected, trying again: the server has gone');
    light.dispose();
    expect(onWarning).toHaveBeenCalledTimes(4);
  }, 60_000);
});

describe('show', () => {
  const saved = lightFile(new FakeServer({ brightness: () => 7 }));

  it('draws saved light in the scene beside it, and asks for nothing else', async () => {
    const served = vi.fn((request: Request | URL) => {
      const { href } = new URL(request instanceof URL ? request : request.url);
      return href.endsWith('.light') ? Promise.resolve(new Response(saved as BodyInit)) : fetch(glbUrl(ROOM));
    });
    const { fetch } = globalThis;
    vi.stubGlobal('fetch', served);
    const scene = new Scene();
    const light = await showWith(platform, 'http://host/shop/room.light', { scene });
    expect(scene.getObjectByName('wall')).toBeDefined();
    expect(
      served.mock.calls.map(([request]) => String(request instanceof URL ? request : request.url)),
    ).toEqual(['http://host/shop/room.light', 'http://host/shop/test.glb']);
    expect(light.urlOf('sky.hdr')).toBe('http://host/shop/sky.hdr');
    light.update(camera);
    expect(light.lightRevision).toBe(1);
    expect(brightest(light.grids[0].texture!.image.data as Uint16Array)).toBeGreaterThan(0);
    light.dispose();
    expect(served).toHaveBeenCalledTimes(2);
  });

  it('lets a page move things, refuses edits in words, and warns of nothing', async () => {
    const gltf = await load(ROOM);
    const scene = new Scene().add(gltf.scene);
    const onWarning = vi.fn();
    const light = await showWith(platform, saved, { scene, gltf, onWarning });
    const wall = scene.getObjectByName('wall')!;
    light.follow(wall);
    light.follow(new PointLight());
    for (const x of [1, 2, 3]) {
      wall.position.x = x;
      light.update(camera, 1000 * x);
    }
    await Promise.resolve();
    expect(onWarning).not.toHaveBeenCalled();
    const edit = light.edit({
      edit: 'set_environment',
      environment: { type: 'constant', radiance: [1, 1, 1] },
    });
    await expect(edit).rejects.toThrow('there is no server');
    light.dispose();
  });

  it('shows the environment that the light keeps, and its picture', async () => {
    const sky = { type: 'image' as const, uri: 'sky/./clear%20day.hdr', intensity: 2 };
    const kept = { 'sky/clear day.hdr': tinyHdr() };
    const edits = [{ edit: 'set_environment', environment: sky }];
    const file = lightFile(new FakeServer(), { edits, files: kept });
    const gltf = await load(ROOM);
    vi.unstubAllGlobals();
    vi.stubGlobal('ProgressEvent', class {});
    const scene = new Scene().add(gltf.scene);
    const onWarning = vi.fn();
    const light = await showWith(platform, file, {
      scene,
      gltf,
      onWarning,
      file: 'http://host/shop/room.glb',
    });
    expect(light.environment).toEqual(sky);
    const address = light.urlOf(sky.uri);
    expect(address).toMatch(/^blob:/);
    expect(new Uint8Array(await (await fetch(address)).arrayBuffer())).toEqual(tinyHdr());
    expect(light.urlOf('other.hdr')).toBe('http://host/shop/other.hdr');
    await vi.waitFor(() => expect(scene.background).not.toBeNull(), 30_000);
    expect(scene.backgroundIntensity).toBe(2);
    expect(onWarning).not.toHaveBeenCalled();
    light.dispose();
    await expect(fetch(address)).rejects.toThrow();
  }, 60_000);

  it('names a file that is missing', async () => {
    vi.stubGlobal('fetch', () => Promise.resolve(new Response('', { status: 404 })));
    const scene = new Scene();
    const missing = 'http://host/room.light is missing (HTTP 404)';
    await expect(showWith(platform, 'http://host/room.light', { scene })).rejects.toThrow(missing);
    const options = { scene, file: 'http://host/room.glb' };
    await expect(showWith(platform, saved, options)).rejects.toThrow(
      'http://host/room.glb is missing (HTTP 404)',
    );
    vi.stubGlobal('ProgressEvent', class {});
    vi.stubGlobal('fetch', () => Promise.resolve(new Response('<!doctype html>')));
    await expect(showWith(platform, saved, options)).rejects.toThrow('a web page was answered');
  });
});

/** An .hdr picture of 2 × 1 texels. */
function tinyHdr(): Uint8Array {
  const head = '#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n';
  return new Uint8Array([...new TextEncoder().encode(head), 128, 128, 128, 129, 64, 64, 64, 129]);
}
