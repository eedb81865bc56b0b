/** What npm packs of both packages: complete, and of use to a program that has nothing else of ours. */
import { execFileSync } from 'node:child_process';
import { mkdirSync, mkdtempSync, readFileSync, rmSync, symlinkSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join, resolve } from 'node:path';
import { afterAll, beforeAll, describe, expect, it } from 'vitest';

import { repositoryUrl } from '../../scripts/repository.mjs';

const WEB = resolve(import.meta.dirname, '../..');
const PROGRAM = `
import { ConnectError, connect, type Edit, type LumencastLight, show } from '@lumencast/three';
import { attach, loadGltf, connect as connectWebGPU } from '@lumencast/three/webgpu';
import { openLight, type Session } from '@lumencast/client';
import { Scene, WebGLRenderer } from 'three';

export async function run(bytes: Uint8Array): Promise<LumencastLight> {
  const session: Session = openLight(bytes);
  const edit: Edit = { edit: 'remove_node', node: 1 };
  await session.edit(edit);
  const options = { scene: new Scene(), renderer: new WebGLRenderer() };
  try {
    return await connect('http://localhost:4443/cornell', options);
  } catch (error) {
    if (error instanceof ConnectError && error.problem === 'origin') console.log(error.message);
    return show('room.light', options);
  }
}
export const others = [attach, loadGltf, connectWebGPU];
`;

interface Packed {
  readonly version: string;
  readonly filename: string;
  readonly files: readonly { readonly path: string }[];
}

/** A checkout whose remote asks for a password. */
const REMOTE = {
  ...process.env,
  GIT_CONFIG_COUNT: '1',
  GIT_CONFIG_KEY_0: 'remote.origin.url',
  GIT_CONFIG_VALUE_0: 'https://me:secret@example.org/light/lumencast.git',
};

describe('npm pack', () => {
  let folder: string;
  const packed = new Map<string, Packed>();

  beforeAll(() => {
    folder = mkdtempSync(join(tmpdir(), 'lumencast-packages-'));
    const modules = join(folder, 'node_modules');
    for (const name of ['client', 'three']) {
      const pack = ['pack', '--json', '--pack-destination', folder];
      const said = execFileSync('npm', pack, { cwd: join(WEB, name), encoding: 'utf8', env: REMOTE });
      const [tarball] = JSON.parse(said.slice(said.indexOf('['))) as [Packed];
      packed.set(name, tarball);
      const place = join(modules, '@lumencast', name);
      mkdirSync(place, { recursive: true });
      execFileSync('tar', ['-xzf', join(folder, tarball.filename), '-C', place, '--strip-components=1']);
    }
    // What a program would install beside.
    for (const other of ['three', '@types', '@moq', '@dimforge', '@tweenjs', 'fflate', 'meshoptimizer']) {
      symlinkSync(join(WEB, 'node_modules', other), join(modules, other));
    }
  }, 120_000);

  afterAll(() => rmSync(folder, { recursive: true, force: true }));

  it.each([
    { name: 'client', entries: ['index'] },
    { name: 'three', entries: ['index', 'webgpu'] },
  ])('holds all of $name, and no tests', ({ name, entries }) => {
    const paths = packed.get(name)!.files.map(({ path }) => path);
    const compiled = entries.flatMap((entry) => [`dist/${entry}.js`, `dist/${entry}.d.ts`]);
    expect(paths).toEqual(
      expect.arrayContaining(['README.md', 'LICENSE-APACHE', 'LICENSE-MIT', 'package.json', ...compiled]),
    );
    expect(paths.filter((path) => /test|vitest|bench/.test(path))).toEqual([]);
  });

  it('asks for the client of its own version', () => {
    const path = join(folder, 'node_modules/@lumencast/three/package.json');
    const { dependencies } = JSON.parse(readFileSync(path, 'utf8')) as { dependencies: object };
    expect(dependencies).toEqual({ '@lumencast/client': packed.get('client')!.version });
  });

  it.each(['client', 'three'])('names the repository that %s is from', (name) => {
    const read = (path: string) => JSON.parse(readFileSync(path, 'utf8')) as { repository?: object };
    expect(read(join(folder, 'node_modules/@lumencast', name, 'package.json')).repository).toEqual({
      type: 'git',
      url: 'git+https://example.org/light/lumencast.git',
      directory: `web/${name}`,
    });
    expect(read(join(WEB, name, 'package.json')).repository, 'only while it is packed').toBeUndefined();
  });

  it.each([
    ['git@example.org:light/lumencast.git', 'git+https://example.org/light/lumencast.git'],
    ['ssh://git@example.org/light/lumencast.git', 'git+https://example.org/light/lumencast.git'],
    ['ssh://git@example.org:2222/light/lumencast.git', 'git+https://example.org/light/lumencast.git'],
    ['/home/me/lumencast', undefined],
    ['file:///home/me/lumencast', undefined],
  ])('makes an address that anyone can open of %s', (remote, url) => {
    expect(repositoryUrl(remote)).toBe(url);
  });

  it.each(['bundler', 'nodenext'])(
    'is typed for programs, with resolution as in %s',
    (moduleResolution) => {
      writeFileSync(join(folder, 'program.ts'), PROGRAM);
      const compilerOptions = {
        ...{ target: 'ES2023', lib: ['ES2023', 'DOM', 'DOM.Iterable', 'DOM.AsyncIterable'], types: [] },
        ...{ module: moduleResolution === 'bundler' ? 'ESNext' : 'NodeNext', moduleResolution },
        ...{ strict: true, noEmit: true, skipLibCheck: true },
      };
      writeFileSync(
        join(folder, 'tsconfig.json'),
        JSON.stringify({ compilerOptions, files: ['program.ts'] }),
      );
      writeFileSync(join(folder, 'package.json'), '{"type":"module"}');
      const tsc = join(WEB, 'node_modules/.bin/tsc');
      expect(compile(tsc, folder)).toBe('');
    },
    60_000,
  );

  it('is found by Node', () => {
    const script = `
      const names = ['@lumencast/client', '@lumencast/three', '@lumencast/three/webgpu'];
      const modules = await Promise.all(names.map((name) => import(name)));
      console.log(modules.map(({ connect }) => typeof connect).join());
    `;
    const said = execFileSync('node', ['--input-type=module', '-e', script], {
      cwd: folder,
      encoding: 'utf8',
    });
    expect(said.trim()).toBe('function,function,function');
  }, 60_000);
});

/** What the compiler complains of. */
function compile(tsc: string, cwd: string): string {
  try {
    return execFileSync(tsc, ['-p', '.'], { cwd, encoding: 'utf8' });
  } catch (error) {
    return (error as { stdout: string }).stdout;
  }
}
