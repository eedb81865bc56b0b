import type { SessionStats } from '@lumencast/client';
import { h } from './dom.js';

/** What the panel shows: the session's figures and what the page measures itself. */
export interface Figures extends SessionStats {
  readonly framesPerSecond: number;
  /** Pages and programs that watch; `undefined` where the server does not say. */
  readonly clients: number | undefined;
  readonly lumels: LumelFigures | undefined;
}

export interface LumelFigures {
  /** Pages that are shown, and lumels along their sides. */
  readonly pages: number;
  readonly pageSize: number;
  /** Meshes that have some. */
  readonly meshes: number;
  /** Milliseconds a picture that they take of the page's thread. */
  readonly time: number;
}

const ROWS: readonly [label: string, title: string, text: (figures: Figures) => string | undefined][] = [
  [
    'ticks',
    'Ticks of the server a second',
    ({ tickRate }) => known(tickRate, (rate) => `${rate.toFixed(1)} Hz`),
  ],
  [
    'tick',
    'Time that the server needs for a tick',
    ({ tickMs }) => known(tickMs, (ms) => `${ms.toFixed(1)} ms`),
  ],
  ['samples', 'Paths traced a probe and tick', ({ samples }) => known(samples, (n) => n.toFixed(0))],
  ['age', 'Time since the light on the screen was computed', ({ age }) => known(age, seconds)],
  ['delay', 'Time that light waits on the way', ({ delay }) => known(delay, seconds)],
  [
    'network',
    'Received from the server',
    // Nothing is expected where no server has said anything.
    ({ bandwidth, tickRate }) => known(tickRate, () => bytes(bandwidth)),
  ],
  [
    'pages',
    'Pages of lumels, and lumels along their sides',
    ({ lumels }) => known(lumels, ({ pages, pageSize }) => `${pages} × ${pageSize}²`),
  ],
  ['lit', 'Objects that lumels light', ({ lumels }) => known(lumels, ({ meshes }) => meshes.toFixed(0))],
  [
    'upkeep',
    'Time of each picture that lumels take of this page’s thread',
    ({ lumels }) => known(lumels, ({ time }) => `${time.toFixed(1)} ms`),
  ],
  ['clients', 'Who watches this scene', ({ clients }) => known(clients, (n) => n.toFixed(0))],
  ['frames', 'Pictures a second on this page', ({ framesPerSecond }) => `${framesPerSecond.toFixed(0)} fps`],
];

export class StatsPanel {
  readonly #values = ROWS.map(() => h('dd'));
  readonly #rows = ROWS.map(([label, title], i) =>
    h('div', { title, hidden: true }, h('dt', {}, label), this.#values[i]),
  );
  readonly element = h('dl', { class: 'panel stats' }, ...this.#rows);

  /** Shows the figures that are known. */
  update(figures: Figures): void {
    ROWS.forEach(([, , text], i) => {
      const value = text(figures);
      this.#rows[i].hidden = value === undefined;
      if (value !== undefined && this.#values[i].textContent !== value) this.#values[i].textContent = value;
    });
  }
}

function known<T>(value: T | undefined, text: (value: T) => string): string | undefined {
  return value === undefined ? undefined : text(value);
}

function seconds(value: number): string {
  return value < 10 ? `${(value * 1000).toFixed(0)} ms` : `${value.toFixed(0)} s`;
}

function bytes(perSecond: number): string {
  return perSecond < 1e6 ? `${(perSecond / 1e3).toFixed(1)} kB/s` : `${(perSecond / 1e6).toFixed(2)} MB/s`;
}
