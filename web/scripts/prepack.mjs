// Runs in a package's folder before npm packs it: builds it anew, and brings the licences that stand
// once at the repository's root.
import { execFileSync } from 'node:child_process';
import { copyFileSync, rmSync } from 'node:fs';
import { resolve } from 'node:path';

rmSync('dist', { recursive: true, force: true });
execFileSync('npm', ['run', 'build'], {
  stdio: ['ignore', 'ignore', 'inherit'],
  shell: process.platform === 'win32',
});
for (const licence of ['LICENSE-APACHE', 'LICENSE-MIT']) {
  copyFileSync(resolve(import.meta.dirname, '../..', licence), licence);
}
