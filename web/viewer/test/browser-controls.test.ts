/**
 * A person at the page: every control is clicked or dragged, and shows in the picture and in what the
 * server accepts. Then pages of other kinds: drawn by WebGPU, of two volumes, without a server.
 */
import { execFileSync } from 'node:child_process';
import { mkdtempSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join, resolve } from 'node:path';
import type { Edit } from '@lumencast/client';
import type { Browser, Page } from 'playwright-core';
import type { SpotLight } from 'three';
import { preview } from 'vite';
import { afterAll, beforeAll, describe, expect, it } from 'vitest';
import { launchBrowser } from '../../testing/chromium.js';
import {
  among,
  buildPage,
  cutOff,
  difference,
  draw,
  look,
  looks,
  onScreen,
  openPage,
  PATIENCE,
  type Pixel,
  settle,
  shoot,
  sum,
} from './browser.js';
import { freePort, lumencastProgram, Server } from './server.js';

const VIEWPORT = { width: 800, height: 600 };
/** Half as many pixels along an axis: all are drawn by the processor. */
const SCALE = { scale: '0.5' };

const program = lumencastProgram();
let folder: string;
let browser: Browser;

const start = async (scene: string) =>
  Server.start(program, scene, await freePort(), ['--page', folder, '--samples', '4..16']);

beforeAll(async () => {
  folder = mkdtempSync(join(tmpdir(), 'lumencast-controls-'));
  await buildPage(folder);
  browser = await launchBrowser();
});

afterAll(async () => {
  await browser?.close();
  rmSync(folder, { recursive: true, force: true });
});

describe('a person at the page', () => {
  let server: Server;
  let page: Page;

  beforeAll(async () => {
    server = await start('cornell');
    page = await openPage(browser, server.address, VIEWPORT, SCALE);
    await page.evaluate(async () => {
      const { light, scene, session } = window.lumencast!;
      Object.assign(window, { accepted: [] });
      session.on('edit', ({ edit, own }) => own && window.accepted!.push(edit));
      const node = (name: string) => light.content.nodeOf(scene.getObjectByName(name)!)!;
      await light.edit({ edit: 'set_animation', animation: 0, playing: false });
      // Out of the way of each other.
      await light.edit({ edit: 'move_node', node: node('sphere'), translation: [0.5, 0.9, 0.5] });
      await light.edit({ edit: 'move_node', node: node('tall_box'), translation: [-0.4, 0.4, -0.4] });
    });
    await settle(page, 40);
  });

  afterAll(() => server?.kill());

  /** The picture as it is shown now. */
  const picture = async () => look(page, await page.evaluate(() => window.lumencast!.light.show));
  const pressed = (title: string) => page.getAttribute(`[title^="${title}"]`, 'aria-pressed');
  const click = async (title: string) => {
    await among(page, `[title^="${title}"]`, (control) => page.click(control));
    await draw(page);
  };
  /** Drags, with a picture after every step as a hand would see it. */
  const drag = async (...[first, ...rest]: (readonly [number, number])[]) => {
    await page.mouse.move(...first);
    await draw(page);
    await page.mouse.down();
    for (const point of rest) {
      await page.mouse.move(...point);
      await draw(page);
      await page.waitForTimeout(40);
    }
    await page.mouse.up();
    await draw(page);
  };
  const choose = (label: string, option: string | { index: number }) =>
    among(page, `select[aria-label="${label}"]`, (select) => page.selectOption(select, option));
  /** Drags the thumb of a slider to a value, as near as a pixel comes. */
  const slide = async (label: string, value: number) => {
    const slider = page.locator(`input[aria-label="${label}"]`);
    const { x, y, width, height } = (await slider.boundingBox())!;
    const { min, max, now } = await slider.evaluate((input: HTMLInputElement) => ({
      min: Number(input.min),
      max: Number(input.max),
      now: input.valueAsNumber,
    }));
    // The middle of the thumb stays half of it off the ends.
    const at = (value: number) => x + 7 + ((value - min) / (max - min)) * (width - 14);
    await drag([at(now), y + height / 2], [at(value), y + height / 2]);
  };
  const expose = (stops: number) =>
    among(page, 'input[aria-label="Exposure"]', () => slide('Exposure', stops));
  /** This page's edits of a kind that the server has accepted; what a hand does is sent with pictures. */
  const accepted = async <K extends Edit['edit']>(kind: K) => {
    await draw(page);
    const edits = await page.evaluate(() => window.accepted!);
    return edits.filter((edit): edit is Extract<Edit, { edit: K }> => edit.edit === kind);
  };
  const camera = () =>
    page.evaluate(() => {
      const { position, quaternion } = window.lumencast!.camera;
      return { position: position.toArray(), rotation: quaternion.toArray() };
    });

  it('sees direct, indirect or both light', async () => {
    const seen: Record<string, Pixel[]> = {};
    for (const shown of ['Direct', 'Indirect', 'Both']) {
      await click(`${shown} light`);
      for (const each of ['Direct', 'Indirect', 'Both'])
        expect(await pressed(`${each} light`), each).toBe(String(each === shown));
      seen[shown] = await picture();
    }
    const { Direct: direct, Indirect: indirect, Both: both } = seen;
    expect(brightness(both)).toBeGreaterThan(1.1 * brightness(direct));
    expect(brightness(both)).toBeGreaterThan(1.03 * brightness(indirect));
    expect(difference(direct, indirect)).toBeGreaterThan(0.3);
    // Next to no pixel has less of both than of one; the tone mapping trades colour for brightness a little.
    const less = both.filter((pixel, i) => sum(pixel) < Math.max(sum(direct[i]), sum(indirect[i])) - 40);
    expect(less.length).toBeLessThan(both.length / 20);
  });

  it('sets the exposure, or leaves it to the page', async () => {
    const stops = () => page.evaluate(() => Math.log2(window.lumencast!.viewer.exposure));
    const [home, before] = [await stops(), brightness(await picture())];
    await expose(home + 2);
    expect(await stops()).toBeCloseTo(home + 2, 0);
    expect(brightness(await picture())).toBeGreaterThan(1.3 * before);
    expect(await page.textContent('.exposure output')).toMatch(/^[+−]\d+\.\d$/);
    await expose(home - 3);
    expect(brightness(await picture())).toBeLessThan(0.5 * before);
    await click('Exposure by the picture');
    await expect.poll(stops).toBeGreaterThan(home - 0.5);
    expect(Math.abs((await stops()) - home)).toBeLessThan(0.5);
  });

  it('chooses the tone mapping', async () => {
    const before = await picture();
    await choose('Tone mapping', 'ACES');
    expect(difference(before, await picture())).toBeGreaterThan(0.05);
    await choose('Tone mapping', 'AgX');
    expect(difference(before, await picture())).toBeLessThan(0.05);
  });

  it('sees the probes, each in the colour of its light', async () => {
    const before = await picture();
    await click('Show the light probes');
    await page.waitForTimeout(150);
    const spheres = await page.evaluate(() => {
      const { camera, renderer, session, viewer } = window.lumencast!;
      const { clientWidth, clientHeight } = renderer.domElement;
      const { center, size, resolution } = session.catalog!.fields.find((field) => field.kind === 'volume')!
        .shape.grid;
      const at = (axis: number, cell: number) =>
        center[axis] + ((cell + 0.5) / resolution[axis] - 0.5) * size[axis];
      const points: [number, number][] = [];
      const columns = [0, resolution[0] - 1];
      for (const i of columns) {
        for (let j = 0; j < resolution[1]; j++) {
          // Those of the front are before all else; the sides that look to the walls.
          const point = camera.position.clone().set(at(0, i), at(1, j), at(2, resolution[2] - 1));
          point.x += (i === 0 ? -0.06 : 0.06) * (size[0] / resolution[0]);
          point.project(camera);
          points.push([((point.x + 1) / 2) * clientWidth, ((1 - point.y) / 2) * clientHeight]);
        }
      }
      const shown = viewer.pixels(points);
      viewer.probes.group.visible = false;
      const hidden = viewer.pixels(points);
      viewer.probes.group.visible = true;
      return shown.map((pixel, i) => ({ pixel, behind: hidden[i] }));
    });
    const apart = ({ pixel, behind }: (typeof spheres)[number]) =>
      Math.max(...pixel.map((value, i) => Math.abs(value - behind[i])));
    expect(spheres.filter((each) => apart(each) > 4).length).toBeGreaterThan(spheres.length / 2);
    const pixels = spheres.map(({ pixel }) => pixel);
    const redness = (some: Pixel[]) => total(some, 0) / total(some, 1);
    const half = pixels.length / 2;
    expect(redness(pixels.slice(0, half))).toBeGreaterThan(1.3 * redness(pixels.slice(half)));
    await shoot(page, 'probes.png');
    await click('Show the light probes');
    expect(difference(before, await picture())).toBeLessThan(0.1);
  });

  it('orbits, flies, and goes back to the file’s view', async () => {
    const distance = (a: number[], b: number[]) => Math.hypot(...a.map((value, i) => value - b[i]));
    const home = await camera();
    await drag([300, 330], [340, 330], [400, 330], [420, 330]);
    const orbited = await camera();
    expect(distance(home.position, orbited.position)).toBeGreaterThan(0.3);

    await click('Fly with');
    expect(await pressed('Fly with')).toBe('true');
    expect(await page.innerText('.notices')).toContain('W A S D');
    await page.keyboard.down('w');
    for (let i = 0; i < 4; i++) await draw(page, 0.1);
    await page.keyboard.up('w');
    const flown = await camera();
    expect(distance(orbited.position, flown.position)).toBeGreaterThan(0.1);
    expect(distance(orbited.rotation, flown.rotation)).toBeLessThan(1e-6);
    await drag([300, 330], [360, 350]);
    const looked = await camera();
    expect(looked.position).toEqual(flown.position);
    expect(distance(flown.rotation, looked.rotation)).toBeGreaterThan(0.02);
    await click('Fly with');
    expect(await pressed('Fly with')).toBe('false');

    await choose('View', 'Overview');
    await draw(page);
    const whole = await camera();
    expect(distance(whole.position, home.position)).toBeGreaterThan(0.5);
    await choose('View', { index: 1 });
    for (let i = 0; i < 5; i++) await draw(page, 0.3);
    expect(distance((await camera()).position, home.position)).toBeLessThan(1e-3);
  });

  it('turns a box by its gizmo', async () => {
    await shoot(page, 'cornell-controls.png');
    const box = await page.evaluate(() => {
      const { light, scene } = window.lumencast!;
      return light.content.nodeOf(scene.getObjectByName('tall_box')!)!;
    });
    const before = await picture();
    await page.mouse.click(...(await onScreen(page, [-0.4, 1.1, -0.1])));
    await draw(page);
    expect(await page.innerText('.inspector')).toContain('tall box');
    await page.click('.inspector [title^="Turn"]');
    await draw(page);
    expect(await page.getAttribute('.inspector [title^="Turn"]', 'aria-pressed')).toBe('true');
    await shoot(page, 'turning.png');
    const [x, y] = await onScreen(page, [-0.4, 0.4, -0.4]);
    const view = await camera();
    // The front of the ring about the vertical, apart from where the other ring crosses it.
    await drag([x + 30, y + 8], [x + 40, y + 8], [x + 60, y + 8], [x + 90, y + 8]);
    // The hand has the box, not the camera.
    expect(await camera()).toEqual(view);
    await expect
      .poll(async () => {
        const turned = (await accepted('move_node')).filter(({ node, rotation }) => node === box && rotation);
        return Math.abs(turned.at(-1)?.rotation?.[1] ?? 0);
      })
      .toBeGreaterThan(0.1);
    await page.click('.inspector [title^="Close"]');
    expect(await page.isVisible('.inspector')).toBe(false);
    // What noise and the light's way to its end change is far less than the box's edges.
    const after = await picture();
    const edges = before.filter((pixel, i) => pixel.some((value, c) => Math.abs(value - after[i][c]) > 40));
    expect(edges.length / before.length).toBeGreaterThan(0.002);
  });

  it('changes a lamp in the inspector, and its light follows', async () => {
    const light = () =>
      page.evaluate(() => {
        const { coefficients } = window
          .lumencast!.session.light()
          .fields.find((field) => field.kind === 'volume')!;
        let [red, blue] = [0, 0];
        for (let i = 0; i < coefficients.length; i += 27) {
          red += coefficients[i];
          blue += coefficients[i + 2];
        }
        return { red, blue };
      });
    const lamp = () =>
      page.evaluate(() => {
        const { intensity, angle } = window.lumencast!.viewer.lights[0] as SpotLight;
        return { intensity, angle };
      });
    await choose('Lights', { index: 1 });
    await draw(page);
    expect(await page.innerText('.inspector')).toMatch(/lamp[^]*spot light[^]*Intensity[^]*Colour[^]*Cone/);
    await shoot(page, 'inspector.png');
    const [home, lit] = [await lamp(), await light()];
    await click('Direct light');
    const before = await picture();

    await slide('Intensity', Math.log10(home.intensity * 4));
    const { intensity } = await lamp();
    expect(intensity / home.intensity).toBeGreaterThan(3);
    expect(intensity / home.intensity).toBeLessThan(5.3);
    expect(brightness(await picture())).toBeGreaterThan(1.1 * brightness(before));
    await expect.poll(async () => (await accepted('set_light')).at(-1)?.intensity).toBeCloseTo(intensity, 4);
    await expect.poll(async () => (await light()).red).toBeGreaterThan(1.5 * lit.red);

    await page.fill('.inspector input[type="color"]', '#2040ff');
    await draw(page);
    await expect
      .poll(async () => ((l) => l.blue / l.red)(await light()))
      .toBeGreaterThan((2 * lit.blue) / lit.red);
    const blue = await picture();
    expect(total(blue, 2) / total(blue, 0)).toBeGreaterThan((1.5 * total(before, 2)) / total(before, 0));

    await slide('Cone', 20);
    expect((await lamp()).angle).toBeLessThan(0.6 * home.angle);
    expect(brightness(await picture())).toBeLessThan(brightness(blue));
    await page.click('.inspector [title^="Close"]');
    await click('Both light');
  });

  it('finds a faint lamp as faint as it is, and does not change it by a touch', async () => {
    const lamp = () => page.evaluate(() => window.lumencast!.viewer.lights[0].intensity);
    const set = (intensity: number) =>
      page.evaluate((intensity) => {
        const { light, viewer } = window.lumencast!;
        return light.edit({ edit: 'set_light', node: light.content.nodeOf(viewer.lights[0])!, intensity });
      }, intensity);
    const home = await lamp();
    await choose('Lights', { index: 1 });
    const slider = page.locator('input[aria-label="Intensity"]');
    for (const intensity of [1e-3, 1e-7]) {
      await set(intensity);
      await draw(page);
      expect(await page.innerText('.inspector')).toContain(`${intensity} cd`);
      await slider.dispatchEvent('input');
      await draw(page);
      expect(await lamp()).toBe(intensity);
    }
    // At that end the thumb stood already.
    await slide('Intensity', 0);
    await slide('Intensity', -4);
    expect(await lamp()).toBe(0);
    expect(await page.innerText('.inspector')).toContain('0 cd');
    await slide('Intensity', 5);
    expect(Math.log10(await lamp())).toBeCloseTo(5, 0);
    await set(home);
    await page.click('.inspector [title^="Close"]');
  });

  it('drags a lamp by its glyph', async () => {
    const where = () =>
      page.evaluate(() => {
        const { viewer, light, camera } = window.lumencast!;
        const at = viewer.lights[0].getWorldPosition(camera.position.clone());
        return { node: light.content.nodeOf(viewer.lights[0])!, at: at.toArray() };
      });
    const home = await where();
    const [x, y] = await onScreen(page, home.at);
    // A notice may lie over it, which goes when it is clicked.
    const select = async () => {
      await page.mouse.click(x, y);
      await draw(page);
      return page.innerText('.inspector');
    };
    await expect.poll(select).toMatch(/lamp[^]*spot light/);
    await page.click('.inspector [title^="Move"]');
    await draw(page);
    const view = await camera();
    // By the arrow to the right.
    await drag([x + 30, y], [x + 40, y], [x + 60, y], [x + 90, y]);
    expect(await camera()).toEqual(view);
    // It is where the hand has let go of it, here and at the server.
    const moved = await where();
    const [nowX, nowY] = await onScreen(page, moved.at);
    expect(Math.hypot(nowX - (x + 60), nowY - y)).toBeLessThan(6);
    const sent = async () =>
      (await accepted('move_node')).filter(({ node }) => node === home.node).at(-1)?.translation;
    await expect.poll(async () => (await sent())?.[0]).toBeCloseTo(moved.at[0], 2);
    await page.click('.inspector [title^="Close"]');
    await page.evaluate(
      ({ node, at }) => window.lumencast!.light.edit({ edit: 'move_node', node, translation: at }),
      home,
    );
  });

  it('reads the figures and the keys, and pauses the animation for everyone', async () => {
    const figures = page.locator('.stats');
    expect(await figures.isVisible()).toBe(true);
    await click('Figures');
    expect(await figures.isVisible()).toBe(false);
    await click('Figures');
    await expect
      .poll(async () => (await draw(page), figures.innerText()))
      .toMatch(/ticks\s+\d+\.\d Hz[^]*tick\s+\d+\.\d ms[^]*samples\s+\d+[^]*age\s+\d+ ms[^]*network\s+\d/);
    await click('Keys and');
    expect(await page.isVisible('.guide .keys')).toBe(true);
    expect(await page.isVisible('.guide .gestures')).toBe(false);
    // Nothing is wider than what it stands in.
    await shoot(page, 'panels.png');
    expect(await cutOff(page)).toEqual([]);
    await click('Keys and');

    expect(await pressed('Pause or play')).toBe('true');
    await click('Pause or play');
    await expect.poll(async () => (await accepted('set_animation')).at(-1)?.playing).toBe(true);
    const height = () =>
      page.evaluate(() => {
        const { scene, viewer } = window.lumencast!;
        viewer.draw();
        return scene.getObjectByName('sphere')!.position.toArray();
      });
    const before = await height();
    await expect.poll(height).not.toEqual(before);
    await click('Pause or play');
    await expect.poll(async () => (await accepted('set_animation')).at(-1)?.playing).toBe(false);
  });
});

describe('a page drawn by WebGPU', () => {
  it('shows the same scene, without errors', async () => {
    const server = await start('cornell');
    const errors: string[] = [];
    try {
      const query = { ...SCALE, renderer: 'webgpu' };
      const page = await openPage(browser, server.address, VIEWPORT, query, errors);
      await settle(page, 40);
      expect(await page.evaluate(() => 'isWebGPURenderer' in window.lumencast!.renderer)).toBe(true);
      const [direct, both] = await looks(page, ['direct', 'both']);
      expect(both.filter((pixel) => sum(pixel) > 60).length).toBeGreaterThan(both.length / 4);
      expect(both.some(([r, g]) => r > 1.5 * g && r > 40)).toBe(true);
      expect(both.some(([r, g]) => g > 1.2 * r && g > 40)).toBe(true);
      expect(brightness(both)).toBeGreaterThan(1.1 * brightness(direct));
      await shoot(page, 'webgpu.png');
      // Far brighter than in the sun: half floats do not hold its light, but what is shown of it.
      const brightened = async (factor: number) => {
        await page.evaluate(async (factor) => {
          const { light, setMode, viewer } = window.lumencast!;
          const [lamp] = viewer.lights;
          const node = light.content.nodeOf(lamp)!;
          await light.edit({ edit: 'set_light', node, intensity: lamp.intensity * factor });
          setMode('direct');
          await viewer.meter();
        }, factor);
        return look(page, 'direct');
      };
      await page.evaluate(() =>
        window.lumencast!.light.edit({ edit: 'set_animation', animation: 0, playing: false }),
      );
      // What moves goes on until the page has been told where it stands.
      const still = async () => difference(await look(page, 'direct'), await look(page, 'direct'));
      await expect.poll(still).toBe(0);
      const [usual, sunny] = [await brightened(1), await brightened(2 ** 20)];
      expect(brightness(usual)).toBeGreaterThan(20);
      expect(difference(usual, sunny)).toBeLessThan(0.2);
      expect(errors).toEqual([]);
      await page.close();
    } finally {
      await server.kill();
    }
  });
});

describe('a scene of two volumes', () => {
  it('is lit in both, and bright through the door where no direct light comes', async () => {
    const server = await start('door');
    const errors: string[] = [];
    try {
      const page = await openPage(browser, server.address, VIEWPORT, SCALE, errors);
      await settle(page, 100);
      const fields = await page.evaluate(() => {
        const { session, light } = window.lumencast!;
        const mean = ({ coefficients }: { coefficients: Float32Array }) =>
          coefficients.reduce((total, value, i) => total + (i % 27 < 3 ? value : 0), 0) / coefficients.length;
        const fields = session.light().fields.filter((field) => field.kind === 'volume');
        return { means: fields.map(mean), grids: light.grids.length };
      });
      expect(fields.means.length).toBe(2);
      expect(fields.grids).toBe(2);
      for (const mean of fields.means) expect(mean).toBeGreaterThan(0);
      await page.evaluate(() => window.lumencast!.viewer.meter());
      const [direct, both] = await looks(page, ['direct', 'both']);
      await shoot(page, 'door.png');
      const dark = [...direct.keys()].filter((i) => sum(direct[i]) < 10);
      // Most of the room behind the door.
      expect(dark.length).toBeGreaterThan(direct.length / 3);
      const gained = dark.filter((i) => sum(both[i]) > 30);
      expect(gained.length).toBeGreaterThan(0.8 * dark.length);
      expect(errors).toEqual([]);
      await page.close();
    } finally {
      await server.kill();
    }
  });
});

describe('the tomb', () => {
  it('keeps its colours where the flashlight shines', async () => {
    const server = await start('tomb');
    try {
      const page = await openPage(browser, server.address, VIEWPORT, SCALE);
      await settle(page, 25);
      await page.evaluate(() => window.lumencast!.viewer.meter());
      const picture = await look(page, 'both');
      await shoot(page, 'tomb.png');
      const share = (fits: (pixel: Pixel) => boolean) => picture.filter(fits).length / picture.length;
      expect(share(([r, g, b]) => Math.min(r, g, b) > 225)).toBeLessThan(0.04);
      // The curtain is red, not pink, and what lies around it is not black.
      expect(share(([r, g, b]) => r > 180 && Math.max(g, b) < 0.65 * r)).toBeGreaterThan(0.01);
      expect(share((pixel) => sum(pixel) < 30)).toBeLessThan(0.2);
      await page.close();
    } finally {
      await server.kill();
    }
  });
});

describe('a page without a server', () => {
  it('shows saved light, and says what it is', async () => {
    execFileSync(program, ['bake', 'cornell', '-o', join(folder, 'cornell.light'), '--samples', '64']);
    const server = await start('cornell');
    const { root } = (await (await fetch(`${server.address}/lumencast.json`)).json()) as { root: string };
    const scene = await fetch(`${server.address}/scene/${encodeURIComponent(root)}`);
    writeFileSync(join(folder, 'cornell.glb'), new Uint8Array(await scene.arrayBuffer()));
    await server.kill();
    const files = await preview({
      configFile: false,
      root: resolve(import.meta.dirname, '..'),
      build: { outDir: folder },
      preview: { host: '127.0.0.1', port: 0 },
    });
    const errors: string[] = [];
    try {
      const address = files.resolvedUrls!.local[0].replace(/\/$/, '');
      const query = { ...SCALE, light: 'cornell.light', gltf: 'cornell.glb' };
      const page = await openPage(browser, address, VIEWPORT, query, errors);
      await draw(page);
      expect(await page.textContent('.brand')).toContain('saved light');
      expect(await page.isVisible('.notice')).toBe(false);
      // Neither figures that nobody knows nor what only a server can do.
      await page.waitForTimeout(300);
      await draw(page);
      expect(await page.innerText('.stats')).toMatch(
        /^pages\s+1 × \d+²\s+lit\s+\d+\s+upkeep\s+[\d.]+ ms\s+frames\s+\d+ fps$/,
      );
      expect(await page.isVisible('[title^="Take the flashlight"]')).toBe(false);
      const [direct, both] = await looks(page, ['direct', 'both']);
      expect(brightness(both)).toBeGreaterThan(1.1 * brightness(direct));
      await shoot(page, 'saved.png');
      // What is moved goes back, as nobody computes its light.
      const refused = await page.evaluate(() => {
        const { light, viewer } = window.lumencast!;
        const node = light.content.nodeOf(viewer.lights[0])!;
        return light.edit({ edit: 'set_light', node, intensity: 1 }).catch((error: Error) => error.message);
      });
      expect(refused).toContain('there is no server');
      expect(errors).toEqual([]);
      await page.close();
      // What is missing is named, with the address that it was looked for at.
      for (const [light, gltf, missing] of [
        ['other.light', 'cornell.glb', 'other.light'],
        ['cornell.light', 'rooms/other.glb', 'rooms/other.glb'],
      ]) {
        const lost = await browser.newPage();
        lost.setDefaultTimeout(PATIENCE);
        await lost.route(`**/${missing}`, (route) => route.fulfill({ status: 404 }));
        await lost.goto(`${address}/?${new URLSearchParams({ light, gltf })}`);
        const said = await lost.textContent('.curtain.failed');
        expect(said).toMatch(/file.* is missing/);
        expect(said).toContain(`${address}/${missing}`);
        expect(said).not.toContain('server');
        await lost.close();
      }
    } finally {
      await files.close();
    }
  });
});

declare global {
  interface Window {
    /** This page's edits that the server has accepted. */
    accepted?: Edit[];
  }
}

const total = (picture: readonly Pixel[], channel: number) =>
  picture.reduce((total, pixel) => total + pixel[channel], 0);
const brightness = (picture: readonly Pixel[]) =>
  picture.reduce((total, pixel) => total + sum(pixel), 0) / picture.length;
