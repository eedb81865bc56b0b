import { h } from './dom.js';

const KEYS: readonly [keys: string, meaning: string][] = [
  ['drag', 'turn the view'],
  ['wheel', 'nearer, farther'],
  ['click', 'select a light or an object'],
  ['G R', 'move, turn the selection'],
  ['F', 'take the flashlight, put it away'],
  ['C', 'orbit or fly'],
  ['W A S D Q E', 'fly; shift is faster'],
  ['1 2 3', 'direct, indirect, both'],
  ['X', 'exposure by the picture'],
  ['P', 'light probes'],
  ['L', 'lumels, and strength of indirect light'],
  ['space', 'pause the animation'],
  ['I', 'figures'],
  ['Esc', 'let go'],
];

const GESTURES: readonly [gesture: string, meaning: string][] = [
  ['one finger', 'turn the view; aim the flashlight'],
  ['two fingers', 'pinch to come nearer, drag to move; fly'],
  ['tap', 'select a light or an object'],
  ['drag an arrow', 'move what is selected'],
];

/** What keys and mouse do, and what fingers do; the style sheet shows what the device has. */
export function helpPanel(close: () => void): HTMLElement {
  const list = (kind: string, rows: readonly [string, string][], term: (text: string) => (Node | string)[]) =>
    h(
      'dl',
      { class: kind },
      ...rows.map(([what, meaning]) => h('div', {}, h('dt', {}, ...term(what)), h('dd', {}, meaning))),
    );
  return h(
    'aside',
    { class: 'panel guide', hidden: true, 'aria-label': 'Help' },
    list('gestures', GESTURES, (gesture) => [gesture]),
    list('keys', KEYS, (keys) => keys.split(' ').map((key) => h('kbd', {}, key))),
    h('button', { type: 'button', onclick: close }, 'Close'),
  );
}

/** How the flashlight is used, and what becomes of it. */
export function flashlightHint(goes: boolean): string {
  const end = goes ? 'put it away' : 'leave it there';
  return hasFingers()
    ? `Point with one finger, move the view with two. Tap Flashlight again to ${end}.`
    : `The flashlight shines where you point. Press F again to ${end}.`;
}

export function flyHint(): string {
  return hasFingers()
    ? 'Look around with one finger. Two fingers fly: drag them aside or up, spread them to go ahead.'
    : 'Fly with W A S D, Q and E; drag to look around';
}

/** Whether fingers are what the device is used by. */
function hasFingers(): boolean {
  return matchMedia('(pointer: coarse)').matches;
}
