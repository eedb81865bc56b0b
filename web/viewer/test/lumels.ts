/** What tests of lumels in the room `cornell` have in common. */
import type { Page } from 'playwright-core';
import { onScreen, type Pixel } from './browser.js';

/** Meshes of the room that have lumels while they stand still; the ball moves. */
export const STILL = 4;

/** Points of the room's surfaces that lumels light: walls, floor and ceiling. */
export const SURFACES = [
  ['the wall behind', [0.4, 1.2, -1]],
  ['the left wall', [-1, 1.2, 0]],
  ['the right wall', [1, 1.2, 0]],
  ['the floor', [0.1, 0, 0.7]],
  ['the ceiling', [0.6, 2, -0.2]],
] as const;

export const POINTS = SURFACES.map(([, point]) => point);

export function setStrengths(page: Page, still: number, moving: number): Promise<void> {
  return page.evaluate(
    ([still, moving]) => {
      Object.assign(window.lumencast!.light.strengths, { static: still, dynamic: moving });
    },
    [still, moving],
  );
}

/** Surfaces at these points. */
export async function seen(
  page: Page,
  points: readonly (readonly [number, number, number])[] = POINTS,
): Promise<Pixel[]> {
  const at = await Promise.all(points.map((point) => onScreen(page, point)));
  await settled(page);
  return page.evaluate((at) => window.lumencast!.pixels(at), at);
}

/** Lets changes reach the picture: WebGPURenderer takes those of lamps over once a frame of the browser. */
export function settled(page: Page): Promise<void> {
  return page.evaluate(async () => {
    for (let i = 0; i < 2; i++) {
      await new Promise(requestAnimationFrame);
      window.lumencast!.viewer.draw();
    }
  });
}

/** Meshes that lumels would light in a picture of now. It takes no picture: in software one takes long. */
export function lit(page: Page): Promise<number> {
  return page.evaluate(() => {
    const { camera, light, scene } = window.lumencast!;
    scene.updateMatrixWorld();
    light.update(camera);
    return light.lumelMeshes;
  });
}
