type Attributes = Readonly<Record<string, string | boolean | ((event: never) => void) | undefined>>;

/** Makes an element; attributes whose name starts with `on` are listeners. */
export function h<K extends keyof HTMLElementTagNameMap>(
  tag: K,
  attributes: Attributes = {},
  ...children: (Node | string)[]
): HTMLElementTagNameMap[K] {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (typeof value === 'function') element.addEventListener(name.slice(2), value as (event: Event) => void);
    else if (value === true) element.setAttribute(name, '');
    else if (typeof value === 'string') element.setAttribute(name, value);
  }
  element.append(...children);
  return element;
}

const PATHS = {
  fly: 'M3 12l18-8-6 17-3.5-7z',
  probes: 'M6 6h.01M12 6h.01M18 6h.01M6 12h.01M12 12h.01M18 12h.01M6 18h.01M12 18h.01M18 18h.01',
  lumels: 'M4 4h16v16H4zM4 12h16M12 4v16M6.5 8h3M14.5 16h3',
  flashlight: 'M7 3h10v4l-2.5 3v11h-5V10L7 7zM7 7h10M12 13v2',
  play: 'M7 4l13 8-13 8z',
  pause: 'M8 5v14M16 5v14',
  stats: 'M4 20V10M10 20V4M16 20v-7M21 20H3',
  help: 'M9 9a3 3 0 1 1 4.5 2.6c-1 .6-1.5 1.2-1.5 2.4M12 18h.01',
  settings: 'M4 7h8M18 7h2M15 4v6M4 17h2M12 17h8M9 14v6',
  close: 'M6 6l12 12M18 6L6 18',
  sun: 'M12 8a4 4 0 1 0 0 8 4 4 0 0 0 0-8M12 2v2M12 20v2M2 12h2M20 12h2M5 5l1.4 1.4M17.6 17.6L19 19M19 5l-1.4 1.4M6.4 17.6L5 19',
  move: 'M12 3v18M3 12h18M12 3L9 6M12 3l3 3M12 21l-3-3M12 21l3-3M3 12l3-3M3 12l3 3M21 12l-3-3M21 12l-3 3',
  rotate: 'M20 12a8 8 0 1 1-2.3-5.6M20 3v4h-4',
} as const;

export type Icon = keyof typeof PATHS;

/** A line drawing of 24 by 24, in the text's colour. */
export function icon(name: Icon): SVGSVGElement {
  const svg = document.createElementNS('http://www.w3.org/2000/svg', 'svg');
  svg.setAttribute('viewBox', '0 0 24 24');
  svg.setAttribute('aria-hidden', 'true');
  const path = document.createElementNS('http://www.w3.org/2000/svg', 'path');
  path.setAttribute('d', PATHS[name]);
  svg.append(path);
  return svg;
}

/** A button with an icon over a word; `title` is shown on hovering. */
export function labelledButton(
  name: Icon,
  label: string,
  title: string,
  onclick: () => void,
): HTMLButtonElement {
  return h('button', { type: 'button', class: 'labelled', title, onclick }, icon(name), h('span', {}, label));
}

/** A button that makes way for details. */
export function more(details: string): HTMLElement {
  const button = h(
    'button',
    { type: 'button', class: 'more', onclick: () => button.replaceWith(h('small', {}, details)) },
    'More',
  );
  return button;
}

/** Shows on a button whether what it stands for is on. */
export function setPressed(button: HTMLButtonElement, pressed: boolean): void {
  button.setAttribute('aria-pressed', String(pressed));
}

/**
 * A slider of a label and a value; `format` says the value in words, and `onInput` may return what came of
 * the thumb's position. A value past an end is said as it is, and stays until the thumb is moved.
 */
export function slider(
  label: string,
  range: { min: number; max: number; step: number },
  format: (value: number) => string,
  onInput: (value: number) => number | void,
): { element: HTMLElement; set: (value: number) => void } {
  const output = h('output');
  let shown: number;
  const input = h('input', {
    type: 'range',
    min: String(range.min),
    max: String(range.max),
    step: String(range.step),
    'aria-label': label,
    oninput: () => {
      if (input.valueAsNumber === shown) return;
      shown = input.valueAsNumber;
      output.value = format(onInput(shown) ?? shown);
    },
  });
  return {
    element: h('label', { class: 'slider' }, h('span', {}, label), input, output),
    set(value) {
      if (document.activeElement === input && input.matches(':active')) return;
      input.valueAsNumber = Math.min(Math.max(value, range.min), range.max);
      shown = input.valueAsNumber;
      output.value = format(value);
    },
  };
}

/** A choice among names, in an element with its label. */
export function choice(
  label: string,
  names: readonly string[],
  onChange: (index: number) => void,
): { element: HTMLElement; select: HTMLSelectElement } {
  const select = h(
    'select',
    { 'aria-label': label, title: label, onchange: () => onChange(select.selectedIndex) },
    ...names.map((name) => h('option', {}, name)),
  );
  return { element: h('label', { class: 'choice' }, h('span', {}, label), select), select };
}
