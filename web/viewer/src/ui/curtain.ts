import type { Failure } from '../words.js';
import { h, more } from './dom.js';

/** What lies over the page until there is a picture: progress, or why there will be none. */
export class Curtain {
  readonly #bar = h('i');
  readonly #words = h('p', {}, 'Connecting…');
  readonly #card = h(
    'div',
    { class: 'card' },
    h('h1', {}, 'Lumencast'),
    this.#words,
    h('div', { class: 'bar' }, this.#bar),
  );
  readonly element = h('div', { class: 'curtain', role: 'status' }, this.#card);

  say(words: string): void {
    this.#words.textContent = words;
  }

  /** Bytes so far and, where known, of all. */
  progress(what: string, loaded: number, total: number | undefined): void {
    const megabytes = (bytes: number) => (bytes / 1e6).toFixed(1);
    this.say(`${what} · ${megabytes(loaded)}${total ? ` of ${megabytes(total)}` : ''} MB`);
    this.#bar.style.transform = `scaleX(${total ? loaded / total : 0.3})`;
  }

  lift(): void {
    this.element.classList.add('lifted');
    setTimeout(() => this.element.remove(), 900);
  }

  /** There will be no picture: says why and what helps. */
  fail({ message, help, details }: Failure): void {
    this.element.classList.add('failed');
    this.element.setAttribute('role', 'alert');
    this.#card.replaceChildren(
      h('h1', {}, 'Lumencast'),
      h('p', {}, message),
      ...(help ? [h('p', { class: 'help' }, help)] : []),
      ...(details ? [more(details)] : []),
      h('button', { type: 'button', onclick: () => location.reload() }, 'Try again'),
    );
  }
}
