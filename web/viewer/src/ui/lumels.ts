import type { LumelLook, LumencastLight } from '@lumencast/three';
import { choice, h, labelledButton, setPressed, slider } from './dom.js';

export interface LumelsActions {
  readonly light: Pick<LumencastLight, 'strengths' | 'look'>;
  /** Shows the pages flat, or no more. */
  pages(): void;
  close(): void;
}

const LOOKS: readonly [look: LumelLook, label: string][] = [
  ['light', 'Light'],
  ['lumels', 'Lumels, one square each'],
  ['age', 'Age, green to red'],
];

const STRENGTHS = { min: 0, max: 2, step: 0.02 };

/** The panel of light at lumels: how much of it is shown, and looks into how it is made. */
export class LumelsPanel {
  readonly element: HTMLElement;
  readonly #words = h('small');
  readonly #still: ReturnType<typeof slider>;
  readonly #moving: ReturnType<typeof slider>;
  readonly #look: ReturnType<typeof choice>;
  readonly #pages: HTMLButtonElement;

  constructor(private readonly actions: LumelsActions) {
    const { light } = actions;
    this.#still = slider('Static', STRENGTHS, percent, (value) => void (light.strengths.static = value));
    this.#moving = slider('Dynamic', STRENGTHS, percent, (value) => void (light.strengths.dynamic = value));
    this.#still.element.title = 'Strength of light from lumels, on what stands still';
    this.#moving.element.title = 'Strength of light from probes, on what moves';
    const labels = LOOKS.map(([, label]) => label);
    this.#look = choice('Show', labels, (index) => (light.look = LOOKS[index][0]));
    const title = 'Show the pages that lumels lie on';
    this.#pages = h('button', { type: 'button', title, onclick: () => actions.pages() }, 'Pages');
    this.element = h(
      'aside',
      { class: 'panel lumels', 'aria-label': 'Lumels', hidden: true },
      h(
        'header',
        {},
        h('div', {}, h('strong', {}, 'Lumels'), this.#words),
        labelledButton('close', 'Close', 'Close (L)', () => actions.close()),
      ),
      this.#still.element,
      this.#moving.element,
      h('div', { class: 'group' }, this.#look.element, this.#pages),
    );
  }

  /** Shows how things are; `words` say what there is, or why lumels are not shown. */
  update(words: string, pagesShown: boolean): void {
    const { strengths, look } = this.actions.light;
    if (this.#words.textContent !== words) this.#words.textContent = words;
    this.#still.set(strengths.static);
    this.#moving.set(strengths.dynamic);
    this.#look.select.selectedIndex = LOOKS.findIndex(([each]) => each === look);
    setPressed(this.#pages, pagesShown);
  }
}

function percent(value: number): string {
  return `${(value * 100).toFixed(0)} %`;
}
