import { mkdtempSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { build, preview } from 'vite';

/** A folder's pages, built by Vite from our sources and served on a port of their own. */
export interface ServedPages {
  readonly port: number;
  close(): Promise<void>;
}

/** Builds the pages of a folder, `index.html` unless told which, and serves them to any host name. */
export async function servePages(
  root: string,
  pages: readonly string[] = ['index.html'],
): Promise<ServedPages> {
  const outDir = mkdtempSync(join(tmpdir(), 'lumencast-pages-'));
  await build({
    configFile: false,
    root,
    base: './',
    logLevel: 'error',
    mode: 'production',
    resolve: { conditions: ['lumencast-source', 'module', 'browser', 'import', 'default'] },
    build: {
      outDir,
      emptyOutDir: true,
      target: 'es2023',
      minify: false,
      chunkSizeWarningLimit: 5000,
      rolldownOptions: { input: pages.map((page) => join(root, page)) },
    },
  });
  const server = await preview({
    configFile: false,
    root,
    build: { outDir },
    preview: { host: '127.0.0.1', port: 0, allowedHosts: true },
  });
  return {
    port: Number(new URL(server.resolvedUrls!.local[0]).port),
    async close() {
      await server.close();
      rmSync(outDir, { recursive: true, force: true });
    },
  };
}
