import { type ChildProcess, spawn } from 'node:child_process';
import { existsSync } from 'node:fs';
import { createServer } from 'node:net';
import { resolve } from 'node:path';

const ROOT = resolve(import.meta.dirname, '../../..');

/** The program under test: what the environment says, else what cargo has built. */
export function lumencastProgram(): string {
  const target = process.env.CARGO_TARGET_DIR ?? resolve(ROOT, 'target');
  const paths = [process.env.LUMENCAST_BIN, resolve(target, 'debug/lumencast')];
  const found = paths.find((path) => path && existsSync(path));
  if (!found) {
    throw new Error(
      `the test needs lumencast (cargo build -p lumencast-cli); looked for ${paths.filter(Boolean).join(', ')}`,
    );
  }
  return found;
}

/** A scene from beside the repository; `undefined` when it is not there. */
export function sharedScene(name: string): string | undefined {
  const path = resolve(process.env.LUMENCAST_SCENES ?? resolve(ROOT, '../shared/scenes'), name);
  return existsSync(path) ? path : undefined;
}

/** A port that nobody listens on at the moment. */
export function freePort(): Promise<number> {
  return new Promise((found, reject) => {
    const socket = createServer();
    socket.once('error', reject);
    socket.listen(0, '127.0.0.1', () => {
      const address = socket.address();
      socket.close(() => found(typeof address === 'object' && address ? address.port : 0));
    });
  });
}

/** Where and how a server runs, if otherwise than usual. */
interface Surroundings {
  readonly environment?: Readonly<Record<string, string>>;
  /** Address to listen at. */
  readonly host?: string;
  /** Words before the program that start it elsewhere. */
  readonly inside?: readonly string[];
}

/** A running `lumencast serve`, of which only this process is ever killed. */
export class Server {
  /** Where its page is, by its own words. */
  address = '';

  private constructor(
    private readonly process: ChildProcess,
    readonly port: number,
    private readonly said: string[],
  ) {}

  static async start(
    program: string,
    scene: string,
    port: number,
    options: readonly string[],
    { environment = {}, host = '127.0.0.1', inside = [] }: Surroundings = {},
  ): Promise<Server> {
    const listen = ['--listen', `${host}:${port}`];
    const [first, ...words] = [...inside, program, 'serve', scene, ...listen, ...options];
    const child = spawn(first, words, {
      stdio: ['ignore', 'pipe', 'pipe'],
      env: { ...process.env, ...environment },
    });
    const said: string[] = [];
    child.stdout.on('data', (chunk: Buffer) => said.push(chunk.toString()));
    child.stderr.on('data', (chunk: Buffer) => said.push(chunk.toString()));
    const server = new Server(child, port, said);
    await server.#ready();
    return server;
  }

  /** What it has written so far. */
  get output(): string {
    return this.said.join('');
  }

  /** Ends it at once, as a crash would. */
  async kill(): Promise<void> {
    if (this.process.exitCode !== null || this.process.signalCode !== null) return;
    const gone = new Promise((resolve) => this.process.once('exit', resolve));
    this.process.kill('SIGKILL');
    await gone;
  }

  async #ready(): Promise<void> {
    for (const start = Date.now(); Date.now() - start < 90_000;) {
      if (this.process.exitCode !== null) break;
      this.address = /^(https?:\/\/\S+)\/$/m.exec(this.output)?.[1] ?? '';
      if (this.address) return;
      await new Promise((resolve) => setTimeout(resolve, 100));
    }
    await this.kill();
    throw new Error(`the server did not start:\n${this.output}`);
  }
}
