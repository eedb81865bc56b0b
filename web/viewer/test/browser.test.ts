/**
 * The whole way: a real server, a real headless browser, real transport. The page draws, shows indirect
 * light, follows edits, stands a server's death, and stays in step with other pages.
 *
 * LUMENCAST_BIN names the program, CHROMIUM the browser, LUMENCAST_SHOTS a folder for screenshots.
 */
import { mkdtempSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import type { Browser, Page } from 'playwright-core';
import { afterAll, beforeAll, describe, expect, it } from 'vitest';
import { launchBrowser } from '../../testing/chromium.js';
import {
  buildPage,
  difference,
  look,
  looks,
  onScreen,
  openPage,
  PATIENCE,
  type Pixel,
  SHOTS,
  settle,
  shoot,
  sum,
} from './browser.js';
import { freePort, lumencastProgram, Server, sharedScene } from './server.js';

/** Small: every pixel is drawn by the processor. */
const VIEWPORT = { width: 400, height: 300 };

const program = lumencastProgram();

describe('the page', () => {
  let folder: string;
  let browser: Browser;
  let server: Server;
  let page: Page;

  // The processor draws the picture as well: the server must leave some of it.
  const start = (scene: string, port: number, ...options: string[]) =>
    Server.start(program, scene, port, ['--page', folder, '--samples', '4..16', ...options]);

  beforeAll(async () => {
    folder = mkdtempSync(join(tmpdir(), 'lumencast-page-'));
    await buildPage(folder);
    browser = await launchBrowser();
    server = await start('cornell', await freePort());
    page = await openPage(browser, server.address, VIEWPORT);
    // Pictures are compared with each other: nothing is to move by itself.
    await page.evaluate(() =>
      window.lumencast!.light.edit({ edit: 'set_animation', animation: 0, playing: false }),
    );
  });

  afterAll(async () => {
    await browser?.close();
    await server?.kill();
    rmSync(folder, { recursive: true, force: true });
  });

  it('draws the scene', async () => {
    const picture = await look(page, 'both');
    const bright = picture.filter(([r, g, b]) => r + g + b > 60).length;
    expect(bright).toBeGreaterThan(picture.length / 4);
    // Red and green walls, not one grey.
    expect(picture.some(([r, g]) => r > 1.5 * g && r > 40)).toBe(true);
    expect(picture.some(([r, g]) => g > 1.2 * r && g > 40)).toBe(true);
    await shoot(page, 'cornell.png');
  });

  it('brightens what direct light does not reach', async () => {
    const [direct, indirect, both] = await looks(page, ['direct', 'indirect', 'both']);
    const shadowed = [...direct.keys()].filter((i) => sum(direct[i]) < 20 && sum(indirect[i]) > 20);
    expect(shadowed.length).toBeGreaterThan(5);
    for (const i of shadowed) expect(sum(both[i])).toBeGreaterThan(sum(direct[i]) + 10);
  });

  it('follows a moved light within a second of ticks, and shows it', async () => {
    const seen = await page.evaluate(async () => {
      const { light, session, viewer, setMode } = window.lumencast!;
      const points = Array.from(
        { length: 60 },
        (_, i) => [60 + (i % 10) * 30, 40 + Math.floor(i / 10) * 30] as const,
      );
      const look = () => viewer.pixels(points).flat();
      const lit = () => session.light().fields.find((field) => field.kind === 'volume')!;
      const change = (a: ArrayLike<number>, b: ArrayLike<number>) => {
        let [apart, all] = [0, 1e-6];
        for (let i = 0; i < a.length; i++) {
          apart += Math.abs(a[i] - b[i]);
          all += Math.abs(a[i]);
        }
        return apart / all;
      };
      /** Reads the light as it comes, until it has what is looked for; returns that light's tick. */
      const until = (isIt: (field: ReturnType<typeof lit>) => boolean) =>
        new Promise<number>((found) => {
          const unsubscribe = session.on('light', () => {
            const field = lit();
            if (!isIt(field)) return;
            unsubscribe();
            found(field.tick!);
          });
        });
      const later = (ticks: number) => {
        const from = lit().tick!;
        return until(({ tick }) => tick! >= from + ticks);
      };
      setMode('indirect');
      const node = light.content.nodeOf(viewer.lights[0])!;
      const home = light.content.object(node)!.position.toArray();
      const { intensity } = viewer.lights[0];
      await light.edit({ edit: 'set_light', node, intensity: intensity * 4 });
      await later(75);
      const calm = lit().coefficients.slice();
      await later(12);
      const noise = change(calm, lit().coefficients);
      const moves: { ticks: number; picture: number }[] = [];
      const [right, left]: [number, number, number][] = [
        [0.7, 0.5, 0.6],
        [-0.7, 0.5, 0.6],
      ];
      for (const translation of [right, home, left, home, right]) {
        const [before, picture] = [lit().coefficients.slice(), look()];
        await light.edit({ edit: 'move_node', node, translation });
        const accepted = lit().tick!;
        const followed = await until(
          ({ coefficients, tick }) =>
            change(before, coefficients) > 2 * noise + 0.01 || tick! > accepted + 200,
        );
        await later(75);
        moves.push({ ticks: followed - accepted, picture: change(picture, look()) });
      }
      await light.edit({ edit: 'move_node', node, translation: home });
      await light.edit({ edit: 'set_light', node, intensity });
      return moves;
    });
    console.log(
      `the light followed ${seen.map(({ ticks }) => ticks).join(', ')} ticks after a lamp was moved`,
    );
    for (const { ticks, picture } of seen) {
      expect(ticks).toBeLessThan(25);
      expect(picture).toBeGreaterThan(0.02);
    }
  });

  it('keeps the picture when the server dies, and goes on when it is back', async () => {
    await settle(page, 75);
    const before = await look(page, 'both');
    const { port } = server;
    await server.kill();
    await page.waitForSelector('.notice.standing');
    expect(await page.textContent('.notice.standing')).toMatch(
      /The server is gone\. The light stays; trying again\./,
    );
    await page.click('.notice.standing button');
    expect(await page.textContent('.notice.standing small')).toMatch(/\w/);
    const after = await look(page, 'both');
    expect(difference(before, after)).toBeLessThan(0.05);
    await shoot(page, 'connection-lost.png');

    const revision = await page.evaluate(() => window.lumencast!.light.lightRevision);
    server = await start('cornell', port);
    await page.waitForFunction(
      (before) => {
        const { light, viewer } = window.lumencast!;
        viewer.draw();
        return light.lightRevision > before + 3;
      },
      revision,
      { polling: 200 },
    );
    expect(await page.isVisible('.notice.standing')).toBe(false);
    await settle(page, 75);
    expect(difference(before, await look(page, 'both'))).toBeLessThan(0.25);
  });

  it('shows one page’s edit on another', async () => {
    const second = await openPage(browser, server.address, VIEWPORT);
    try {
      const moved: [number, number, number] = [0.31, 1.27, 0.11];
      const node = await page.evaluate(async (translation) => {
        const { light, viewer } = window.lumencast!;
        const node = light.content.nodeOf(viewer.lights[0])!;
        await light.edit({ edit: 'move_node', node, translation });
        return node;
      }, moved);
      await second.waitForFunction(
        ([node, x]) => Math.abs(window.lumencast!.light.content.object(node)!.position.x - x) < 1e-4,
        [node, moved[0]] as const,
      );
      // A page that joins later gets it with the snapshot.
      const third = await openPage(browser, server.address, VIEWPORT);
      const position = await third.evaluate(
        (node) => window.lumencast!.light.content.object(node)!.position.toArray(),
        node,
      );
      position.forEach((value, axis) => expect(value).toBeCloseTo(moved[axis], 4));
      await third.close();
    } finally {
      await second.close();
    }
  });

  it('moves a sphere by its gizmo, for every page', async () => {
    const second = await openPage(browser, server.address, VIEWPORT);
    try {
      const place = (on: Page, name: string): Promise<number[]> =>
        on.evaluate((name) => {
          const { scene, viewer } = window.lumencast!;
          viewer.draw();
          const object = scene.getObjectByName(name)!;
          return [...object.position.toArray(), ...object.quaternion.toArray()] as number[];
        }, name);
      const apart = (a: number[], b: number[]) => Math.hypot(...a.map((value, i) => value - b[i]));
      // The page draws when asked to: each gesture needs pictures, as a hand would see them.
      const gesture = async (...steps: (() => Promise<unknown>)[]) => {
        for (const step of steps) {
          await step();
          await page.evaluate(() => window.lumencast!.viewer.draw());
          await page.waitForTimeout(60);
        }
      };
      const seenBySecond = async (name: string, from: number[]) => {
        await expect.poll(async () => apart(await place(second, name), from)).toBeGreaterThan(0.05);
        // What the hand's page shows is what the others get.
        await expect
          .poll(async () => apart(await place(second, name), await place(page, name)))
          .toBeLessThan(1e-3);
      };

      await page.setViewportSize({ width: 800, height: 600 });
      // The server that was restarted plays again; and nothing is to stand in the hand's way.
      await page.evaluate(async () => {
        const { light, scene } = window.lumencast!;
        await light.edit({ edit: 'set_animation', animation: 0, playing: false });
        const node = light.content.nodeOf(scene.getObjectByName('sphere')!)!;
        await light.edit({ edit: 'move_node', node, translation: [0.3, 0.9, 0.5] });
      });
      await settle(page, 12);
      const sphere = await place(page, 'sphere');
      const at = await page.evaluate(() => {
        const sphere = window.lumencast!.scene.getObjectByName('sphere')!;
        return sphere.getWorldPosition(sphere.position.clone()).toArray();
      });
      const [x, y] = await onScreen(page, at);
      const { mouse } = page;
      await gesture(
        () => mouse.click(x, y),
        () => mouse.move(x, y),
        () => mouse.down(),
        () => mouse.move(x + 10, y),
        () => mouse.move(x + 40, y - 30),
        () => mouse.up(),
      );
      await seenBySecond('sphere', sphere);
    } finally {
      await second.close();
    }
  });

  it('shines the flashlight where the pointer is, for every page, until it is put away', async () => {
    const second = await openPage(browser, server.address, VIEWPORT);
    try {
      await page.setViewportSize({ width: 800, height: 600 });
      const lights = (on: Page) =>
        on.evaluate(() => (window.lumencast!.viewer.draw(), window.lumencast!.viewer.lights.length));
      await page.evaluate(() =>
        window.lumencast!.light.edit({ edit: 'set_animation', animation: 0, playing: false }),
      );
      const before = await lights(second);
      await page.click('[title^="Take the flashlight"]');
      await expect.poll(() => lights(page)).toBe(before + 1);
      await expect.poll(() => page.innerText('.notices')).toContain('where you point');
      const spots: [number, number][] = [
        [330, 160],
        [460, 400],
      ];
      const seen: Pixel[][] = [];
      for (const [x, y] of spots) {
        await page.mouse.move(x, y);
        // Until the page looks again at how far away that is.
        await page.waitForTimeout(200);
        seen.push(
          await page.evaluate((spots) => {
            const { pixels, setMode } = window.lumencast!;
            setMode('direct');
            return pixels(spots);
          }, spots),
        );
      }
      await page.evaluate(() => window.lumencast!.setMode('both'));
      await shoot(page, 'flashlight.png');
      const [first, then] = seen;
      expect(sum(first[0])).toBeGreaterThan(1.2 * sum(then[0]));
      expect(sum(then[1])).toBeGreaterThan(1.2 * sum(first[1]));
      await expect.poll(() => lights(second)).toBe(before + 1);
      await page.click('[title^="Take the flashlight"]');
      await expect.poll(() => lights(second)).toBe(before);
      expect(await lights(page)).toBe(before);
    } finally {
      await second.close();
    }
  });

  it('says so when there is no server', async () => {
    const lonely = await browser.newPage();
    lonely.setDefaultTimeout(PATIENCE);
    await lonely.route('**/lumencast.json', (route) => route.abort());
    await lonely.goto(server.address);
    expect(await lonely.textContent('.curtain.failed')).toMatch(/does not answer/);
    await lonely.close();
  });

  const sponza = sharedScene('sponza/Sponza.glb');
  it.skipIf(!SHOTS || !sponza)(
    'draws Sponza',
    async () => {
      const options = ['--volume', '16x8x10', '--environment', 'sky:4'];
      const other = await start(sponza!, await freePort(), ...options);
      try {
        const view = await openPage(browser, other.address, { width: 1280, height: 720 });
        await view.waitForTimeout(20_000);
        await view.evaluate(() => window.lumencast!.viewer.meter());
        // Without a GPU they are those of a server starved by the page's drawing.
        await view.click('[title^="Figures"]');
        await shoot(view, 'sponza.jpg');
        await view.close();
      } finally {
        await other.kill();
      }
    },
    240_000,
  );
});
