import type { Shown } from '@lumencast/three';
import { STOPS } from '../view/exposure.js';
import { choice, h, type Icon, labelledButton, setPressed, slider } from './dom.js';

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

export type Toggle = 'fly' | 'probes' | 'lumels' | 'flashlight' | 'playing' | 'stats' | 'help';

const SHOWN: readonly [shown: Shown, label: string][] = [
  ['direct', 'Direct'],
  ['indirect', 'Indirect'],
  ['both', 'Both'],
];

type Entry = readonly [toggle: Toggle, icon: Icon, label: string, title: string];

/** What stands in the bar at any size. */
const FIRST: readonly Entry[] = [
  ['flashlight', 'flashlight', 'Flashlight', 'Take the flashlight, aim with the pointer (F)'],
  ['playing', 'pause', 'Pause', 'Pause or play the animation (space)'],
];
/** What stands among the settings. */
const FURTHER: readonly Entry[] = [
  ['fly', 'fly', 'Fly', 'Fly with W A S D, Q E and the mouse (C)'],
  ['probes', 'probes', 'Probes', 'Show the light probes (P)'],
  ['lumels', 'lumels', 'Lumels', 'Strength of indirect light, and its lumels (L)'],
  ['stats', 'stats', 'Figures', 'Figures (I)'],
  ['help', 'help', 'Help', 'Keys and gestures (?)'],
];

/**
 * The bar of controls beside the picture. The settings are part of it where there is room, else a panel
 * that a button opens; which of both is the style sheet's matter.
 */
export class Dock {
  readonly element: HTMLElement;
  readonly #shown = new Map<Shown, HTMLButtonElement>();
  readonly #toggles = new Map<Toggle, HTMLButtonElement>();
  readonly #exposure: ReturnType<typeof slider>;
  readonly #lights: ReturnType<typeof choice>;
  readonly #settings: HTMLElement;
  readonly #open: HTMLButtonElement;

  constructor(actions: DockActions, tones: readonly string[], cameras: readonly string[]) {
    const segments = SHOWN.map(([shown, label], i) => {
      const title = `${label} light${shown === 'both' ? ' together' : ' alone'} (${i + 1})`;
      const button = h('button', { type: 'button', title, onclick: () => actions.show(shown) }, label);
      this.#shown.set(shown, button);
      return button;
    });
    const toggle = ([toggle, icon, label, title]: Entry) => {
      const button = labelledButton(icon, label, title, () => actions.toggle(toggle));
      this.#toggles.set(toggle, button);
      return button;
    };
    this.#exposure = slider('Exposure', { ...STOPS, step: 0.05 }, stops, (value) => actions.exposure(value));
    const title = 'Exposure by the picture (X)';
    const auto = h('button', { type: 'button', title, onclick: () => actions.autoExposure() }, 'Auto');
    const view = choice('View', ['Overview', ...cameras], (index) => actions.camera(index - 1));
    view.select.selectedIndex = cameras.length > 0 ? 1 : 0;
    this.#lights = choice('Lights', ['Lights'], (index) => {
      actions.select(index - 1);
      this.#lights.select.selectedIndex = 0;
    });
    const tone = choice('Tone mapping', tones, (index) => actions.tone(tones[index]));
    this.#settings = h(
      'div',
      { class: 'settings', id: 'settings', role: 'group', 'aria-label': 'Settings' },
      h('div', { class: 'group exposure' }, this.#exposure.element, auto),
      h('div', { class: 'group choices' }, tone.element, view.element, this.#lights.element),
      h('div', { class: 'group' }, ...FURTHER.map(toggle)),
    );
    this.#open = labelledButton('settings', 'More', 'More settings', () => this.#setOpen(!this.#isOpen));
    this.#open.classList.add('open');
    this.#open.setAttribute('aria-controls', this.#settings.id);
    this.element = h(
      'nav',
      { class: 'dock', 'aria-label': 'Controls' },
      h('div', { class: 'segments', role: 'group', 'aria-label': 'Light shown' }, ...segments),
      h('div', { class: 'group' }, ...FIRST.map(toggle)),
      this.#settings,
      this.#open,
    );
    this.#setOpen(false);
  }

  set shown(shown: Shown) {
    for (const [each, button] of this.#shown) setPressed(button, each === shown);
  }

  set exposure(value: number) {
    this.#exposure.set(value);
  }

  set lights(names: readonly string[]) {
    const { element, select } = this.#lights;
    element.hidden = names.length === 0;
    if (select.length === names.length + 1) return;
    select.replaceChildren(...['Lights', ...names].map((name) => h('option', {}, name)));
  }

  set(toggle: Toggle, on: boolean): void {
    setPressed(this.#toggles.get(toggle)!, on);
  }

  hide(toggle: Toggle, hidden: boolean): void {
    this.#toggles.get(toggle)!.hidden = hidden;
  }

  /** Whether it offers this. */
  has(toggle: Toggle | undefined): boolean {
    return toggle !== undefined && !this.#toggles.get(toggle)!.hidden;
  }

  closeSettings(): void {
    this.#setOpen(false);
  }

  get #isOpen(): boolean {
    return this.#settings.classList.contains('opened');
  }

  #setOpen(open: boolean): void {
    this.#settings.classList.toggle('opened', open);
    this.#open.setAttribute('aria-expanded', String(open));
    setPressed(this.#open, open);
  }
}

function stops(value: number): string {
  return `${value < 0 ? '−' : '+'}${Math.abs(value).toFixed(1)}`;
}
