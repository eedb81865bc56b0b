/**
 * Pages of scenes that people have: without any light, with instances and hidden nodes, with files whose
 * names are written in many ways.
 */
import { mkdirSync, mkdtempSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { crc32, deflateSync } from 'node:zlib';
import type { Browser, Page } from 'playwright-core';
import { afterAll, beforeAll, expect, it } from 'vitest';
import { launchBrowser } from '../../testing/chromium.js';
import { buildPage, cutOff, draw, look, onScreen, openPage, PATIENCE, type Pixel, shoot } from './browser.js';
import { lit } from './lumels.js';
import { freePort, lumencastProgram, Server } from './server.js';

const VIEWPORT = { width: 800, height: 600 };
const SCALE = { scale: '0.5' };

const program = lumencastProgram();
let folder: string;
let page: string;
let browser: Browser;

beforeAll(async () => {
  folder = mkdtempSync(join(tmpdir(), 'lumencast-files-'));
  page = join(folder, 'page');
  await buildPage(page);
  browser = await launchBrowser();
});

afterAll(async () => {
  await browser?.close();
  rmSync(folder, { recursive: true, force: true });
});

/** A floor, white unless said otherwise, whose buffer stands at a URI, with other parts. */
function writeScene(uri: string, parts: object = {}): string {
  const corners = [-1, 0, -1, -1, 0, 1, 1, 0, 1, -1, 0, -1, 1, 0, 1, 1, 0, -1];
  mkdirSync(join(folder, 'the data'), { recursive: true });
  writeFileSync(join(folder, 'the data', 'café 50%.bin'), Float32Array.from(corners));
  const scene = join(folder, 'floor.gltf');
  const json = {
    asset: { version: '2.0' },
    buffers: [{ uri, byteLength: 72 }],
    bufferViews: [{ buffer: 0, byteLength: 72 }],
    accessors: [
      { bufferView: 0, componentType: 5126, type: 'VEC3', count: 6, min: [-1, 0, -1], max: [1, 0, 1] },
    ],
    materials: [{ pbrMetallicRoughness: { metallicFactor: 0 }, doubleSided: true }],
    meshes: [{ primitives: [{ attributes: { POSITION: 0 }, material: 0 }] }],
    nodes: [{ mesh: 0 }],
    scenes: [{ nodes: [0] }],
    scene: 0,
    ...parts,
  };
  // With a byte-order mark.
  writeFileSync(scene, `\ufeff${JSON.stringify(json)}`);
  return scene;
}

async function visit(
  scene: string,
  see: (page: Page) => Promise<void>,
  viewport: Parameters<typeof openPage>[2] = VIEWPORT,
): Promise<void> {
  const options = ['--page', page, '--samples', '4..16', '--volume', '2x2x2@0,0.5,0:3,1.5,3'];
  const server = await Server.start(program, scene, await freePort(), options);
  const errors: string[] = [];
  try {
    const opened = await openPage(browser, server.address, viewport, SCALE, errors);
    await see(opened);
    expect(errors).toEqual([]);
    await opened.close();
  } finally {
    await server.kill();
  }
}

const brightness = (picture: readonly Pixel[]) =>
  picture.reduce((total, [r, g, b]) => total + r + g + b, 0) / picture.length;

it.each([
  { on: 'a desk', viewport: VIEWPORT },
  { on: 'a phone', viewport: { width: 360, height: 640, touch: true } },
])('offers a sky to a scene without light, by one click, on $on', async ({ on, viewport }) => {
  const see = async (page: Page) => {
    await draw(page);
    expect(await page.textContent('.notice.offer')).toContain('Nothing in this scene gives light');
    const dark = brightness(await look(page, 'both'));
    await shoot(page, `dark on ${on}.png`);
    expect(await cutOff(page)).toEqual([]);
    await (on === 'a phone' ? page.tap('.notice.offer button') : page.click('.notice.offer button'));
    await page.waitForFunction(() => window.lumencast!.light.environment?.type === 'sky');
    await expect.poll(() => draw(page).then(() => page.isVisible('.notice.offer'))).toBe(false);
    await page.evaluate(() => window.lumencast!.viewer.meter());
    expect(dark).toBeLessThan(3);
    expect(brightness(await look(page, 'both'))).toBeGreaterThan(60);
    await shoot(page, `sky on ${on}.png`);
    // The floor is seen whole, and not as a speck.
    const corners: [number, number][] = [];
    for (const x of [-1, 1]) for (const z of [-1, 1]) corners.push(await onScreen(page, [x, 0, z]));
    const across = corners.map(([x]) => x);
    const width = Math.max(...across) - Math.min(...across);
    const room = Math.min(viewport.width, viewport.height);
    expect(Math.min(...across)).toBeGreaterThan(0);
    expect(Math.max(...across)).toBeLessThan(viewport.width);
    expect(width / room).toBeGreaterThan(0.6);
  };
  await visit(writeScene('the%20data\\caf%C3%A9%2050%25.bin'), see, viewport);
});

it('offers none where there is light', async () => {
  const lit = { pbrMetallicRoughness: { metallicFactor: 0 }, emissiveFactor: [1, 1, 1] };
  await visit(writeScene('the data//café 50%.bin', { materials: [lit] }), async (page) => {
    await draw(page);
    expect(await page.isVisible('.notice.offer')).toBe(false);
  });
});

/** A PNG of a row of texels: red, green, blue, alpha. */
function png(...texels: readonly (readonly number[])[]): string {
  const word = (value: number) => Buffer.from([value >>> 24, value >>> 16, value >>> 8, value]);
  const chunk = (kind: string, body: Buffer) => {
    const checked = Buffer.concat([Buffer.from(kind), body]);
    return [word(body.length), checked, word(crc32(checked))];
  };
  const header = Buffer.concat([word(texels.length), word(1), Buffer.from([8, 6, 0, 0, 0])]);
  const row = deflateSync(Buffer.from([0, ...texels.flat()]));
  const signature = Buffer.from([0x89, 0x50, 0x4e, 0x47, 13, 10, 26, 10]);
  const parts = [...chunk('IHDR', header), ...chunk('IDAT', row), ...chunk('IEND', Buffer.alloc(0))];
  return `data:image/png;base64,${Buffer.concat([signature, ...parts]).toString('base64')}`;
}

it('shows the roughness of specular-glossiness', async () => {
  const specularGlossinessTexture = { index: 0, extensions: { KHR_texture_transform: { offset: [0.5, 0] } } };
  const gloss = { glossinessFactor: 0.5, specularGlossinessTexture };
  const scene = writeScene('the data/café 50%.bin', {
    extensionsUsed: ['KHR_materials_pbrSpecularGlossiness', 'KHR_texture_transform'],
    materials: [{ emissiveFactor: [1, 1, 1], extensions: { KHR_materials_pbrSpecularGlossiness: gloss } }],
    images: [{ uri: png([200, 100, 50, 102], [10, 20, 30, 255]) }],
    textures: [{ source: 0 }],
  });
  await visit(scene, async (page) => {
    const found = await page.evaluate(() => {
      const texelsOf = (image: CanvasImageSource) => {
        const canvas = document.createElement('canvas');
        [canvas.width, canvas.height] = [2, 1];
        const context = canvas.getContext('2d')!;
        context.drawImage(image, 0, 0);
        return [...context.getImageData(0, 0, 2, 1).data];
      };
      const material = window.lumencast!.light.content.materials(0)[0] as unknown as {
        roughnessMap: { image: CanvasImageSource; offset: { x: number } };
        specularColorMap: { image: CanvasImageSource };
        roughness: number;
      };
      const { roughnessMap, specularColorMap, roughness } = material;
      return {
        rough: texelsOf(roughnessMap.image),
        specular: texelsOf(specularColorMap.image),
        offset: roughnessMap.offset.x,
        roughness,
      };
    });
    expect(found.rough).toEqual([0, 204, 0, 255, 0, 128, 0, 255]);
    expect(found.specular.slice(4)).toEqual([10, 20, 30, 255]);
    expect([found.offset, found.roughness]).toEqual([0.5, 1]);
  });
});

/** Three small floors in a row, and one in front of the camera that is hidden. */
it('shows instances and no hidden nodes', async () => {
  const instances = { EXT_mesh_gpu_instancing: { attributes: { TRANSLATION: 0, SCALE: 1 } } };
  const hide = { KHR_node_visibility: { visible: false } };
  const scene = writeScene('the data/café 50%.bin', {
    extensionsUsed: ['EXT_mesh_gpu_instancing', 'KHR_node_visibility'],
    // Of six instances in the corners of the floor's two triangles.
    accessors: [
      { bufferView: 0, componentType: 5126, type: 'VEC3', count: 6, min: [-1, 0, -1], max: [1, 0, 1] },
      { componentType: 5126, type: 'VEC3', count: 6, bufferView: 1 },
    ],
    buffers: [
      { uri: 'the data/café 50%.bin', byteLength: 72 },
      {
        uri: `data:;base64,${Buffer.from(Float32Array.from(new Array(18).fill(0.25)).buffer).toString('base64')}`,
        byteLength: 72,
      },
    ],
    bufferViews: [
      { buffer: 0, byteLength: 72 },
      { buffer: 1, byteLength: 72 },
    ],
    materials: [{ emissiveFactor: [1, 1, 1] }],
    nodes: [
      { mesh: 0, extensions: instances },
      { mesh: 0, translation: [0, 50, 0], extensions: hide },
    ],
    scenes: [{ nodes: [0, 1] }],
  });
  await visit(scene, async (page) => {
    const found = await page.evaluate(() => {
      const { light, camera } = window.lumencast!;
      return { hidden: light.content.object(1)!.visible, height: camera.position.y };
    });
    const points = [
      await onScreen(page, [-1, 0, -1]),
      await onScreen(page, [1, 0, 1]),
      await onScreen(page, [0, 0, 0]),
    ];
    const pixels = await page.evaluate((points) => window.lumencast!.pixels(points), points);
    const [near, far, between] = pixels.map(([r, g, b]) => r + g + b);
    expect(Math.min(near, far)).toBeGreaterThan(100);
    expect(between).toBeLessThan(30);
    expect(found.hidden).toBe(false);
    // What is hidden does not widen the view.
    expect(found.height).toBeLessThan(20);
    await shoot(page, 'instances.png');
  });
});

/** Squares whose triangles three.js and the server read each in their way: their charts fit all the same. */
it('lights meshes by lumels whatever their triangles are made of', async () => {
  const corners = [0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, 0.5, 0, 0];
  const numbers: number[] = [];
  const accessors: object[] = [];
  const bufferViews: object[] = [];
  const add = (type: 'SCALAR' | 'VEC2' | 'VEC3', values: readonly number[], more: object = {}) => {
    bufferViews.push({ buffer: 0, byteOffset: 4 * numbers.length, byteLength: 4 * values.length });
    // Floats and indices have four bytes each.
    const words = type === 'SCALAR' ? Uint32Array.from(values) : Float32Array.from(values);
    numbers.push(...new Uint32Array(words.buffer));
    const [componentType, size] = type === 'SCALAR' ? [5125, 1] : [5126, type === 'VEC2' ? 2 : 3];
    const count = values.length / size;
    return accessors.push({ bufferView: bufferViews.length - 1, componentType, type, count, ...more }) - 1;
  };
  const POSITION = add('VEC3', corners, { min: [0, 0, 0], max: [1, 1, 0] });
  const NORMAL = add('VEC3', new Array(5).fill([0, 0, 1]).flat());
  // Mirrored on one of the two triangles: tangents split their vertices.
  const TEXCOORD_0 = add('VEC2', [0, 0, 1, 0, 1, 1, 1, 0, 0, 0]);
  const square = [0, 1, 2, 0, 2, 3];
  const smooth = { POSITION, NORMAL };
  const meshes = [
    // Without area, in their midst; after points.
    [
      { mode: 0, attributes: { POSITION } },
      { attributes: smooth, indices: add('SCALAR', [0, 1, 1, 0, 1, 2, 0, 4, 1, 0, 2, 3]) },
    ],
    // Without normals.
    [{ attributes: { POSITION }, indices: add('SCALAR', square) }],
    // A strip, a fan, and corners of no whole triangle.
    [{ mode: 5, attributes: smooth, indices: add('SCALAR', [0, 1, 3, 2]) }],
    [{ mode: 6, attributes: smooth, indices: add('SCALAR', [0, 1, 2, 3]) }],
    [{ attributes: smooth, indices: add('SCALAR', [...square, 0]) }],
    [{ attributes: { ...smooth, TEXCOORD_0 }, indices: add('SCALAR', square), material: 0 }],
  ].map((primitives) => ({ primitives }));
  const bytes = Buffer.from(Uint32Array.from(numbers).buffer);
  const scene = writeScene('', {
    extensionsUsed: ['KHR_lights_punctual'],
    extensions: { KHR_lights_punctual: { lights: [{ type: 'point', intensity: 100 }] } },
    buffers: [{ uri: `data:;base64,${bytes.toString('base64')}`, byteLength: bytes.length }],
    bufferViews,
    accessors,
    images: [{ uri: png([128, 128, 255, 255]) }],
    textures: [{ source: 0 }],
    materials: [{ normalTexture: { index: 0 } }],
    meshes,
    nodes: [
      ...meshes.map((_, mesh) => ({ mesh, translation: [1.5 * mesh, 0, 0] })),
      { translation: [4, 1, 2], extensions: { KHR_lights_punctual: { light: 0 } } },
    ],
    scenes: [{ nodes: [...meshes.keys(), meshes.length] }],
  });
  await visit(scene, async (page) => {
    await expect.poll(() => lit(page), { timeout: PATIENCE }).toBe(meshes.length);
    await shoot(page, 'triangles.png');
  });
});
