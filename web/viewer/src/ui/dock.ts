import type { Shown } from '@lumencast/three';
import { STOPS } from '../view/exposure.js';
import { choice, h, type Icon, iconButton, setPressed, slider } from './dom.js';

/** What the dock's controls do. */
export interface DockActions {
  show(shown: Shown): void;
  /** Exposure in stops: 0 is 1 / (cd/m²). */
  exposure(stops: number): void;
  autoExposure(): void;
  tone(name: string): void;
  /** Index of a camera of the file; −1 is the overview. */
  camera(index: number): void;
  toggle(what: Toggle): void;
  select(light: number): void;
}

export type Toggle = 'fly' | 'probes' | 'flashlight' | 'playing' | 'stats' | 'help';

const SHOWN: readonly [shown: Shown, label: string][] = [
  ['direct', 'Direct'],
  ['indirect', 'Indirect'],
  ['both', 'Both'],
];
const TOGGLES: readonly [toggle: Toggle, icon: Icon, title: string][] = [
  ['fly', 'fly', 'Fly with W A S D, Q E and the mouse (C)'],
  ['playing', 'pause', 'Pause or play the animation (space)'],
  ['flashlight', 'flashlight', 'Take the flashlight, aim with the mouse (F)'],
  ['probes', 'probes', 'Show the light probes (P)'],
  ['stats', 'stats', 'Figures (I)'],
  ['help', 'help', 'Keys (?)'],
];

/** The bar of controls at the lower edge. */
export class Dock {
  readonly element: HTMLElement;
  readonly #shown = new Map<Shown, HTMLButtonElement>();
  readonly #toggles = new Map<Toggle, HTMLButtonElement>();
  readonly #exposure: ReturnType<typeof slider>;
  readonly #lights: HTMLSelectElement;

  constructor(actions: DockActions, tones: readonly string[], cameras: readonly string[]) {
    const segments = SHOWN.map(([shown, label], i) => {
      const title = `${label} light${shown === 'both' ? ' together' : ' alone'} (${i + 1})`;
      const button = h('button', { type: 'button', title, onclick: () => actions.show(shown) }, label);
      this.#shown.set(shown, button);
      return button;
    });
    const toggles = TOGGLES.map(([toggle, icon, title]) => {
      const button = iconButton(icon, title, () => actions.toggle(toggle));
      this.#toggles.set(toggle, button);
      return button;
    });
    this.#exposure = slider('Exposure', { ...STOPS, step: 0.05 }, stops, (value) => actions.exposure(value));
    const auto = h(
      'button',
      {
        type: 'button',
        class: 'text',
        title: 'Exposure by the picture (X)',
        onclick: () => actions.autoExposure(),
      },
      'Auto',
    );
    const view = choice('View', ['Overview', ...cameras], (index) => actions.camera(index - 1));
    view.selectedIndex = cameras.length > 0 ? 1 : 0;
    this.#lights = choice('Lights', ['Lights'], (index) => {
      actions.select(index - 1);
      this.#lights.selectedIndex = 0;
    });
    this.element = h(
      'nav',
      { class: 'panel dock', 'aria-label': 'Controls' },
      h('div', { class: 'segments', role: 'group', 'aria-label': 'Light shown' }, ...segments),
      h('div', { class: 'group exposure' }, this.#exposure.element, auto),
      h(
        'div',
        { class: 'group' },
        choice('Tone mapping', tones, (index) => actions.tone(tones[index])),
        view,
        this.#lights,
      ),
      h('div', { class: 'group' }, ...toggles),
    );
  }

  set shown(shown: Shown) {
    for (const [each, button] of this.#shown) setPressed(button, each === shown);
  }

  set exposure(value: number) {
    this.#exposure.set(value);
  }

  set lights(names: readonly string[]) {
    if (this.#lights.length === names.length + 1) return;
    this.#lights.replaceChildren(...['Lights', ...names].map((name) => h('option', {}, name)));
    this.#lights.hidden = names.length === 0;
  }

  set(toggle: Toggle, on: boolean): void {
    setPressed(this.#toggles.get(toggle)!, on);
  }

  hide(toggle: Toggle, hidden: boolean): void {
    this.#toggles.get(toggle)!.hidden = hidden;
  }
}

function stops(value: number): string {
  return `${value < 0 ? '−' : '+'}${Math.abs(value).toFixed(1)}`;
}
