import { mkdirSync } from 'node:fs';
import { join, resolve } from 'node:path';
import type { Browser, Page } from 'playwright-core';
import { build } from 'vite';

/** Where pictures of the page go; none are made unless it is set. */
export const SHOTS = process.env.LUMENCAST_SHOTS;

/** Milliseconds that the page may take for anything: machines may be busy. */
export const PATIENCE = 120_000;

/** Builds the page into a folder, for `lumencast serve --page`. */
export async function buildPage(folder: string): Promise<void> {
  await build({
    root: resolve(import.meta.dirname, '..'),
    logLevel: 'error',
    build: { outDir: folder, emptyOutDir: true },
  });
}

/**
 * Opens the page and waits for its first light, at a fixed exposure. From then on it draws when asked
 * to: a page that draws without pause in software leaves the server no processor, and never comes to
 * rest for a screenshot. What goes wrong in it is added to `errors`. With `touch`, it is a phone's.
 */
export async function openPage(
  browser: Browser,
  address: string,
  { touch = false, ...viewport }: { width: number; height: number; touch?: boolean },
  query: Readonly<Record<string, string>> = {},
  errors: string[] = [],
): Promise<Page> {
  const page = await browser.newPage({ viewport, hasTouch: touch, isMobile: touch });
  page.setDefaultTimeout(PATIENCE);
  page.on('pageerror', (error) => errors.push(String(error)));
  page.on('console', (message) => {
    if (message.type() === 'error') errors.push(`${message.text()} (${message.location().url})`);
  });
  try {
    await page.goto(`${address}/?${new URLSearchParams({ scale: '1', ...query })}`);
    await page.waitForFunction(() => window.lumencast);
    await page.evaluate(() => window.lumencast!.ready);
    await page.waitForSelector('.curtain', { state: 'detached' });
    await page.evaluate(() => {
      const { viewer } = window.lumencast!;
      viewer.autoExposure = false;
      viewer.stop();
      return viewer.meter();
    });
    return page;
  } catch (error) {
    const shown = await page.innerText('body').catch(() => '');
    throw new Error(`the page did not come up; it says: ${shown.slice(0, 300)}\n${errors.join('\n')}`, {
      cause: error,
    });
  }
}

/** Red, green, blue, 0 to 255. */
export type Pixel = [r: number, g: number, b: number];

/** Red, green and blue together: how bright a pixel is. */
export const sum = ([r, g, b]: Pixel) => r + g + b;

type Shown = 'both' | 'direct' | 'indirect';

/** Points of the picture on a grid, with one part of the light shown. */
export async function look(page: Page, shown: Shown): Promise<Pixel[]> {
  return (await looks(page, [shown]))[0];
}

/** The parts of the light one by one, all at one instant: between two, light goes on changing. */
export function looks(page: Page, parts: readonly Shown[]): Promise<Pixel[][]> {
  return page.evaluate((parts) => {
    const { pixels, renderer, setMode } = window.lumencast!;
    const { clientWidth, clientHeight } = renderer.domElement;
    const points: [number, number][] = [];
    for (let y = 10; y < clientHeight; y += 15) {
      for (let x = 10; x < clientWidth; x += 15) points.push([x, y]);
    }
    const now = performance.now();
    return parts.map((shown) => {
      setMode(shown);
      return pixels(points, now);
    });
  }, parts);
}

/** Mean difference of two pictures over their mean brightness. */
export function difference(a: readonly Pixel[], b: readonly Pixel[]): number {
  const [va, vb] = [a.flat(), b.flat()];
  const apart = va.reduce((total, value, i) => total + Math.abs(value - vb[i]), 0);
  return (
    apart /
    Math.max(
      va.reduce((total, value) => total + value),
      1,
    )
  );
}

/** A picture of the page as it now is, where any are wanted; the name says of which kind. */
export async function shoot(page: Page, name: string): Promise<void> {
  if (!SHOTS) return;
  mkdirSync(SHOTS, { recursive: true });
  await draw(page);
  await page.screenshot({
    path: join(SHOTS, name),
    ...(name.endsWith('.jpg') ? { quality: 90 } : {}),
    timeout: 60_000,
    animations: 'disabled',
  });
}

/** Waits until so much more light has come, in ticks of the server: it settles however slow the machine is. */
export async function settle(page: Page, ticks: number): Promise<void> {
  const newest = () => page.evaluate(() => window.lumencast!.session.light().fields[0].tick ?? 0);
  const from = await newest();
  await page.waitForFunction(
    (until) => (window.lumencast!.session.light().fields[0].tick ?? 0) >= until,
    from + ticks,
    {
      polling: 50,
    },
  );
}

/** Where a point of the scene is on the page, whose canvas begins at the page's corner. */
export function onScreen(page: Page, point: readonly [number, number, number]): Promise<[number, number]> {
  return page.evaluate(([x, y, z]) => {
    const { camera, renderer } = window.lumencast!;
    const at = camera.position.clone().set(x, y, z).project(camera);
    const { clientWidth, clientHeight } = renderer.domElement;
    return [((at.x + 1) / 2) * clientWidth, ((1 - at.y) / 2) * clientHeight];
  }, point);
}

/**
 * Does something with a control that may be among the settings, which are a panel where the bar has no
 * room for them: opens it and closes it again.
 */
export async function among(
  page: Page,
  selector: string,
  act: (selector: string) => Promise<unknown>,
): Promise<void> {
  const isHidden = !(await page.isVisible(selector));
  if (isHidden) await page.click('.dock .open');
  await act(selector);
  if (isHidden && (await page.isVisible(selector))) await page.click('.dock .open');
}

/** One picture, so many seconds after the one before, and the panels as they then are. */
export function draw(page: Page, seconds = 0): Promise<void> {
  return page.evaluate((seconds) => {
    const { viewer } = window.lumencast!;
    viewer.draw(performance.now(), seconds);
    viewer.controls.update();
  }, seconds);
}

/** Texts of bar and panels that do not fit where they stand, and what the window cuts. */
export function cutOff(page: Page): Promise<string[]> {
  return page.evaluate(() =>
    [...document.querySelectorAll<HTMLElement>('.controls *, .dock, .dock *')]
      .filter((element) => element.checkVisibility() && !element.closest('svg'))
      .filter((element) => {
        const { left, right, top, bottom } = element.getBoundingClientRect();
        const outside = left < -1 || top < -1 || right > innerWidth + 1 || bottom > innerHeight + 1;
        return outside || (element.children.length === 0 && element.scrollWidth > element.clientWidth + 1);
      })
      .map((element) => `${element.tagName}.${element.className}: ${element.textContent}`),
  );
}
