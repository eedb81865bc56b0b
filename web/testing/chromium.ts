import { existsSync } from 'node:fs';
import { type Browser, chromium } from 'playwright-core';

/** WebGL drawn by the processor. */
const FLAGS = [
  '--headless=new',
  '--no-sandbox',
  '--enable-features=Vulkan',
  '--use-vulkan=swiftshader',
  '--use-angle=swiftshader',
  '--enable-unsafe-swiftshader',
  // Containers have little of it.
  '--disable-dev-shm-usage',
];
/** WebGPU drawn by the processor. */
const WEBGPU_FLAGS = ['--enable-unsafe-webgpu', '--use-webgpu-adapter=swiftshader'];

/** A browser to drive: what the environment says, else the system's; `undefined` when there is none. */
export const chromiumProgram = [process.env.CHROMIUM, '/usr/bin/chromium', '/usr/bin/google-chrome'].find(
  (path) => path && existsSync(path),
);

/** Starts {@link chromiumProgram}; an error where there is none. */
export function launchBrowser(...flags: string[]): Promise<Browser> {
  return launchProgram(installed(), ...flags);
}

/** Starts a program that is Chromium, or becomes it. */
export function launchProgram(program: string, ...flags: string[]): Promise<Browser> {
  return launch(program, [...FLAGS, ...WEBGPU_FLAGS, ...flags]);
}

/** As {@link launchBrowser}, with no adapter for WebGPU: what many devices have. */
export function launchWithoutWebGPU(): Promise<Browser> {
  return launch(installed(), FLAGS);
}

function installed(): string {
  if (!chromiumProgram) throw new Error('the test needs Chromium; CHROMIUM names another place for it');
  return chromiumProgram;
}

function launch(executablePath: string, args: string[]): Promise<Browser> {
  return chromium.launch({ executablePath, headless: true, args });
}
