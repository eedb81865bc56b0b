/** Connecting a scene to a light, with and without a server. */
import { type Mesh, PerspectiveCamera, Scene } from 'three';
import { afterEach, beforeEach, describe, expect, it, vi } from 'vitest';
import { FakeNet } from '../../client/test/support/fake-link.js';
import { FakeServer } from '../../client/test/support/fake-server.js';
import { lightFile } from '../../client/test/support/light-file.js';
import { connectWith } from '../src/connect.js';
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
  vi.stubGlobal('fetch', (request: Request) => {
    asked.push(request.url);
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

  it('shows a saved light field when there is no server', async () => {
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
});
