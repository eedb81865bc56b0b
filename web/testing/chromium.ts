import { existsSync } from 'node:fs';
import { type Browser, chromium } from 'playwright-core';

/** WebGL and WebGPU drawn by the processor. */
const FLAGS = [
  '--headless=new',
  '--no-sandbox',
  '--enable-unsafe-webgpu',
  '--use-webgpu-adapter=swiftshader',
  '--enable-features=Vulkan',
  '--use-vulkan=swiftshader',
  '--use-angle=swiftshader',
  '--enable-unsafe-swiftshader',
  // Containers have little of it.
  '--disable-dev-shm-usage',
];

/** A browser to drive: what the environment says, else the system's; `undefined` when there is none. */
export const chromiumProgram = [process.env.CHROMIUM, '/usr/bin/chromium', '/usr/bin/google-chrome'].find(
  (path) => path && existsSync(path),
);

/** Starts {@link chromiumProgram}; an error where there is none. */
export function launchBrowser(...flags: string[]): Promise<Browser> {
  if (!chromiumProgram) throw new Error('the test needs Chromium; CHROMIUM names another place for it');
  return launchProgram(chromiumProgram, ...flags);
}

/** Starts a program that is Chromium, or becomes it. */
export function launchProgram(program: string, ...flags: string[]): Promise<Browser> {
  return chromium.launch({ executablePath: program, headless: true, args: [...FLAGS, ...flags] });
}
