/**
 * A network of this machine's own with a link that a test makes as slow as it likes: a namespace of
 * Linux with nothing but a loopback, on which what comes from one address passes a token bucket.
 */
import { type ChildProcess, execFile, spawn } from 'node:child_process';
import { writeFileSync } from 'node:fs';
import { promisify } from 'node:util';

const run = promisify(execFile);

/** What comes from here takes the slow link; from other loopback addresses it comes at once. */
export const SLOW_ADDRESS = '127.0.0.2';
/** As much as Ethernet carries; a loopback's own packets are longer than a slow link's queue. */
const PACKET = 1500;
/** What waits longer at the link than this is lost, as in a router. */
const QUEUE_MS = 200;

/** The namespace lives as long as the process that holds it, and that as long as this process. */
export class NarrowLink {
  readonly #holder: ChildProcess;
  /** What to put before a command that is to run inside. */
  readonly inside: readonly string[];

  private constructor(holder: ChildProcess, asRoot: boolean) {
    this.#holder = holder;
    const user = asRoot ? [] : ['--user', '--preserve-credentials'];
    this.inside = ['nsenter', '--target', String(holder.pid), '--net', ...user, '--'];
  }

  /** @throws Error that says why this machine cannot do it. */
  static async open(): Promise<NarrowLink> {
    const asRoot = process.getuid?.() === 0;
    // It echoes what it is sent once it is inside, and ends with its input.
    const holder = spawn('unshare', ['--net', ...(asRoot ? [] : ['--map-root-user']), 'cat'], {
      stdio: ['pipe', 'pipe', 'pipe'],
    });
    try {
      await answer(holder);
      const link = new NarrowLink(holder, asRoot);
      await link.#set('ip', 'link', 'set', 'lo', 'up', 'mtu', String(PACKET));
      // What Linux has unless told otherwise.
      const route = 'local 127.0.0.1 dev lo table local proto kernel scope host src 127.0.0.1';
      await link.#set('ip', 'route', 'replace', ...route.split(' '), 'congctl', 'cubic');
      // Classes 1:1, the slow one, and 1:2 for the rest; the bucket alone limits anything.
      await link.#tc('qdisc add dev lo root handle 1: htb default 2');
      for (const id of ['1:1', '1:2'])
        await link.#tc(`class add dev lo parent 1: classid ${id} htb rate 10gbit`);
      const slow = `match ip src ${SLOW_ADDRESS}/32 flowid 1:1`;
      await link.#tc(`filter add dev lo parent 1: protocol ip u32 ${slow}`);
      await link.#tc(`qdisc add dev lo parent 1:1 handle 10: ${bucket(1000)}`);
      return link;
    } catch (error) {
      holder.kill();
      throw error;
    }
  }

  /** Sets what the link carries from now on. */
  async carry(megabits: number): Promise<void> {
    await this.#tc(`qdisc change dev lo parent 1:1 handle 10: ${bucket(megabits)}`);
  }

  /** Writes a program that starts another inside, for those who take a program but no arguments. */
  wrap(program: string, file: string): string {
    const words = [...this.inside, program].map((word) => `'${word}'`).join(' ');
    writeFileSync(file, `#!/bin/sh\nexec ${words} "$@"\n`, { mode: 0o755 });
    return file;
  }

  close(): void {
    this.#holder.kill();
  }

  #tc(words: string): Promise<void> {
    return this.#set('tc', ...words.split(' '));
  }

  async #set(...command: string[]): Promise<void> {
    const [program, ...words] = [...this.inside, ...command];
    await run(program, words);
  }
}

function bucket(megabits: number): string {
  const bits = Math.round(megabits * 1e6);
  // The burst is what has come together within a tick of the kernel's clock, but two packets at least.
  const burst = Math.max(2 * PACKET, Math.round(bits / 8 / 250));
  return `tbf rate ${bits}bit burst ${burst} latency ${QUEUE_MS}ms`;
}

/** Waits until a `cat` echoes. */
function answer(echo: ChildProcess): Promise<void> {
  return new Promise((resolve, reject) => {
    let said = '';
    echo.stderr!.on('data', (chunk: Buffer) => (said += chunk.toString()));
    echo.once('error', reject);
    echo.once('exit', () => reject(new Error(said.trim() || 'no namespace for it')));
    echo.stdout!.once('data', () => resolve());
    echo.stdin!.on('error', () => {});
    echo.stdin!.write('there\n');
  });
}
