import type { Words } from '../words.js';
import { h, more } from './dom.js';

/** Short messages over the picture: one that stays as long as its cause, others that go by themselves. */
export class Notices {
  readonly element = h('div', { class: 'notices', role: 'status', 'aria-live': 'polite' });
  #standing: { element: HTMLElement; message: string } | undefined;
  #offer: HTMLElement | undefined;

  /** A message that stays until it is replaced or, by `undefined`, taken away. */
  standing(words: Words | undefined): void {
    if (this.#standing?.message === words?.message) return;
    this.#standing?.element.remove();
    this.#standing = undefined;
    if (words === undefined) return;
    const { message, details } = words;
    const element = h(
      'div',
      { class: 'notice standing' },
      h('i', { class: 'pulse' }),
      h('span', {}, message),
      ...(details ? [more(details)] : []),
    );
    this.#standing = { element, message };
    this.element.prepend(element);
  }

  /** A message with something to do about it, until it is taken away by `undefined`. */
  offer(offer: { message: string; label: string; take: () => void } | undefined): void {
    if (this.#offer?.dataset.message === offer?.message) return;
    this.#offer?.remove();
    this.#offer = undefined;
    if (offer === undefined) return;
    const { message, label, take } = offer;
    this.#offer = h(
      'div',
      { class: 'notice offer', 'data-message': message },
      h('span', {}, message),
      h('button', { type: 'button', class: 'text', onclick: take }, label),
    );
    this.element.append(this.#offer);
  }

  /** A message that goes after a while, or when clicked. */
  passing(message: string, seconds = 7): void {
    if ([...this.element.children].some((shown) => shown.textContent === message)) return;
    const notice = h('div', { class: 'notice', onclick: () => notice.remove() }, h('span', {}, message));
    this.element.append(notice);
    setTimeout(() => notice.remove(), seconds * 1000);
  }
}
