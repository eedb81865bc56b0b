/**
 * Which repository a package is from, in its `package.json` while it is packed: the remote `origin` of the
 * checkout, so that a copy of the project elsewhere names itself. Without a remote the packages name none.
 */
import { execFileSync } from 'node:child_process';
import { readFileSync, writeFileSync } from 'node:fs';
import { relative, resolve } from 'node:path';
import { pathToFileURL } from 'node:url';

/** A remote's address as npm wants it, without who asks for it; `undefined` where it is no address. */
export function repositoryUrl(remote) {
  const short = /^(?:[\w.-]+@)?([\w.-]+):(?!\/\/)(.+)$/.exec(remote);
  const address = short ? `https://${short[1]}/${short[2]}` : remote.replace(/^ssh:/, 'https:');
  if (!URL.canParse(address)) return undefined;
  const url = new URL(address);
  if (url.protocol !== 'https:' && url.protocol !== 'http:') return undefined;
  url.username = url.password = '';
  // A port of ssh is none of the web's.
  if (remote.startsWith('ssh:')) url.port = '';
  return `git+${url.href}`;
}

function git(...args) {
  try {
    return execFileSync('git', args, { encoding: 'utf8', stdio: ['ignore', 'pipe', 'ignore'] }).trim();
  } catch {
    return undefined;
  }
}

/** Writes the field into the `package.json` of the working folder, or takes it out again. */
export function setRepository(on) {
  const path = resolve('package.json');
  const { repository: _, ...rest } = JSON.parse(readFileSync(path, 'utf8'));
  const remote = on ? git('config', '--get', 'remote.origin.url') : undefined;
  const url = remote && repositoryUrl(remote);
  if (on && !url) console.warn('no public remote "origin": the package names no repository');
  const directory = relative(git('rev-parse', '--show-toplevel') ?? '.', process.cwd());
  const repository = url && { repository: { type: 'git', url, directory } };
  writeFileSync(path, `${JSON.stringify({ ...rest, ...repository }, undefined, 2)}\n`);
}

if (process.argv[1] && import.meta.url === pathToFileURL(process.argv[1]).href) {
  setRepository(process.argv[2] === 'set');
}
