import { connect, type Edit, type Session } from '@lumencast/client';
import { PerspectiveCamera, Scene } from 'three';
import { vi } from 'vitest';
import { FakeNet } from '../../../client/test/support/fake-link.js';
import { FakeServer } from '../../../client/test/support/fake-server.js';
import { LumencastLight } from '../../src/light.js';
import type { NamedNode } from '../../src/names.js';
import { platform } from './platform.js';

type AddLight = Edit & { edit: 'add_light' };

/** A page whose scene is its own. */
export interface Page {
  readonly scene: Scene;
  readonly session: Session;
  readonly light: LumencastLight;
  readonly net: FakeNet;
  readonly warnings: string[];
  /** What has been sent over the present connection. */
  edits(): unknown[];
}

/** A server that several pages are connected to, and the lights that they add to it. */
export class SharedServer {
  /** Lights that edits have added and none has removed, with what has been set of them since. */
  readonly lights = new Map<number, AddLight>();
  readonly #pages: Page[] = [];
  /** Edits of each connection that are dealt with. */
  readonly #read = new WeakMap<object, number>();
  #server = new FakeServer();
  #nextNode = 10;
  #now = 1000;

  /** A page that has joined; `file` are the named nodes of the server's file. */
  async open(file: readonly NamedNode[] | Promise<readonly NamedNode[]> = []): Promise<Page> {
    const net = new FakeNet();
    const session = connect('https://localhost:4443/test', { connector: net.connector });
    const warnings: string[] = [];
    const scene = new Scene();
    const onWarning = (message: string) => void warnings.push(message);
    const options = { scene, onWarning };
    const light = new LumencastLight(session, platform, options, [], Promise.resolve(file));
    const edits = () => net.link.edits.map(({ edit }) => edit);
    const page = { scene, session, light, net, warnings, edits };
    this.#pages.push(page);
    await this.join(page);
    return page;
  }

  /** Lets a page's newest connection begin. */
  async join(page: Page): Promise<void> {
    await vi.advanceTimersByTimeAsync(0);
    page.net.link.deliver('catalog', this.#server.catalog);
  }

  /** Forgets all that was added, and numbers nodes anew. */
  restart(): void {
    this.#server = new FakeServer({ epoch: '00000000000000bb' });
    this.lights.clear();
    this.#nextNode = 10;
  }

  /** Takes what pages have sent, tells all what came of it, and lets them draw a picture. */
  async tick(): Promise<void> {
    for (const { net, session } of this.#pages) {
      for (const { seq, edit } of net.link.edits.slice(this.#read.get(net.link) ?? 0))
        this.#receive(session.client, seq, edit as Edit);
      this.#read.set(net.link, net.link.edits.length);
    }
    const { state, probes } = this.#server.step(true);
    for (const { net } of this.#pages) {
      net.link.deliver('state', state);
      net.link.deliverAll(probes);
    }
    await vi.advanceTimersByTimeAsync(40);
    this.#now += 40;
    for (const page of this.#pages) this.draw(page);
  }

  draw({ light }: Page): void {
    light.update(new PerspectiveCamera(), this.#now);
  }

  async ticks(count: number): Promise<void> {
    for (let i = 0; i < count; i++) await this.tick();
  }

  /** Without client, the server's own. */
  accept(edit: Edit, client?: string, seq?: number): void {
    const node = 'node' in edit ? edit.node! : -1;
    const light = this.lights.get(node);
    if (edit.edit === 'add_light') this.lights.set(node, edit);
    this.#nextNode = Math.max(this.#nextNode, node + 1);
    if (edit.edit === 'remove_node') this.lights.delete(node);
    if (light && edit.edit === 'move_node') {
      const { edit: _, node: __, ...transform } = edit;
      this.lights.set(node, { ...light, transform: { ...light.transform, ...transform } });
    }
    this.#server.accept(edit, client, seq);
    this.#server.scene.clear();
    for (const [node, light] of this.lights) this.#server.scene.set(node, light);
  }

  #receive(client: string, seq: number, edit: Edit): void {
    if (edit.edit === 'add_light') return this.accept({ ...edit, node: this.#nextNode }, client, seq);
    const node = 'node' in edit ? edit.node! : -1;
    if (node < 10 || this.lights.has(node)) this.accept(edit, client, seq);
    else this.#server.refuse(client, seq, `node ${node} does not exist`);
  }
}
