import { h } from './dom.js';

const KEYS: readonly [keys: string, meaning: string][] = [
  ['1 2 3', 'direct, indirect, both'],
  ['X', 'exposure by the picture'],
  ['C', 'orbit or fly'],
  ['W A S D Q E', 'fly; shift is faster'],
  ['click', 'select a light or an object'],
  ['G R', 'move, turn the selection'],
  ['F', 'take the flashlight'],
  ['P', 'light probes'],
  ['space', 'pause the animation'],
  ['I', 'figures'],
  ['Esc', 'let go'],
];

/** The list of keys. */
export function helpPanel(): HTMLElement {
  return h(
    'aside',
    { class: 'panel keys', hidden: true, 'aria-label': 'Keys' },
    h(
      'dl',
      {},
      ...KEYS.map(([keys, meaning]) => h('div', {}, h('dt', {}, ...keyCaps(keys)), h('dd', {}, meaning))),
    ),
  );
}

function keyCaps(keys: string): HTMLElement[] {
  return keys.split(' ').map((key) => h('kbd', {}, key));
}
