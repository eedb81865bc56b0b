import { isPunctualLight } from '@lumencast/three';
import { DirectionalLight, type Object3D, PointLight, SpotLight, SRGBColorSpace } from 'three';
import { setSunAngles, sunAngles } from '../view/sun.js';
import type { Gizmo } from '../view/selection.js';
import { h, type Icon, labelledButton, setPressed, slider } from './dom.js';
import { INTENSITY, intensityAt, intensityText } from './intensity.js';

export interface InspectorActions {
  /** The object is about to be changed by hand. */
  touched(object: Object3D): void;
  /** What is turned where the object belongs to a node. */
  carrier(object: Object3D): Object3D;
  gizmo(mode: Gizmo): void;
  close(): void;
}

const DEGREES = 180 / Math.PI;

/** The panel of the selected light or object. Its sliders change the object itself. */
export class Inspector {
  readonly element = h('aside', { class: 'panel inspector', 'aria-label': 'Selection', hidden: true });
  #object: Object3D | undefined;
  #refresh: (() => void)[] = [];

  constructor(private readonly actions: InspectorActions) {}

  show(object: Object3D | undefined, gizmo: Gizmo): void {
    this.#object = object;
    this.element.hidden = object === undefined;
    this.#refresh = [];
    if (!object) return this.element.replaceChildren();
    this.element.replaceChildren(this.#head(object), ...this.#rows(object), ...this.#gizmo(object, gizmo));
    this.update();
  }

  /** Shows the object as it now is. */
  update(): void {
    for (const refresh of this.#refresh) refresh();
  }

  #head(object: Object3D): HTMLElement {
    return h(
      'header',
      {},
      h('div', {}, h('strong', {}, nameOf(object)), h('small', {}, kindOf(object))),
      labelledButton('close', 'Close', 'Close (Esc)', () => this.actions.close()),
    );
  }

  #rows(object: Object3D): HTMLElement[] {
    if (!isPunctualLight(object)) return [];
    const rows = [
      this.#slider('Intensity', INTENSITY, intensityText(unitOf(object)), {
        get: () => Math.log10(object.intensity),
        set: (value) => (object.intensity = intensityAt(value)),
      }),
      this.#color(object),
    ];
    if (object instanceof DirectionalLight) {
      const carrier = this.actions.carrier(object);
      const degrees = (value: number) => `${value.toFixed(0)}°`;
      rows.push(
        this.#slider('Height', { min: 1, max: 90, step: 0.2 }, degrees, {
          get: () => sunAngles(object).elevation * DEGREES,
          set: (value) => setSunAngles(carrier, { ...sunAngles(object), elevation: value / DEGREES }),
        }),
        this.#slider('Direction', { min: -180, max: 180, step: 0.5 }, degrees, {
          get: () => sunAngles(object).azimuth * DEGREES,
          set: (value) => setSunAngles(carrier, { ...sunAngles(object), azimuth: value / DEGREES }),
        }),
      );
    }
    if (object instanceof SpotLight) {
      rows.push(
        this.#slider('Cone', { min: 2, max: 85, step: 0.5 }, (value) => `${value.toFixed(0)}°`, {
          get: () => object.angle * DEGREES,
          set: (value) => (object.angle = value / DEGREES),
        }),
      );
    }
    return rows;
  }

  #slider(
    label: string,
    range: { min: number; max: number; step: number },
    format: (value: number) => string,
    value: { get: () => number; set: (value: number) => void },
  ): HTMLElement {
    const { element, set } = slider(label, range, format, (input) => {
      if (this.#object) this.actions.touched(this.#object);
      value.set(input);
      return value.get();
    });
    this.#refresh.push(() => set(value.get()));
    return element;
  }

  #color(light: PointLight | SpotLight | DirectionalLight): HTMLElement {
    const input = h('input', {
      type: 'color',
      'aria-label': 'Colour',
      oninput: () => {
        this.actions.touched(light);
        light.color.setStyle(input.value, SRGBColorSpace);
      },
    });
    this.#refresh.push(() => {
      if (document.activeElement !== input) input.value = `#${light.color.getHexString(SRGBColorSpace)}`;
    });
    return h('label', { class: 'slider' }, h('span', {}, 'Colour'), input);
  }

  #gizmo(object: Object3D, gizmo: Gizmo): HTMLElement[] {
    if (object instanceof DirectionalLight) return [];
    const modes: [Gizmo, Icon, label: string, key: string][] = [['translate', 'move', 'Move', 'G']];
    if (!(object instanceof PointLight)) modes.push(['rotate', 'rotate', 'Turn', 'R']);
    const buttons = modes.map(([mode, name, label, key]) => {
      const button = labelledButton(name, label, `${label} (${key})`, () => this.actions.gizmo(mode));
      setPressed(button, mode === gizmo);
      return button;
    });
    return [h('div', { class: 'group' }, ...buttons)];
  }
}

export function nameOf(object: Object3D): string {
  return namedInFile(object) || (object.parent && namedInFile(object.parent)) || kindOf(object);
}

/** GLTFLoader keeps the name that a node has in its file; the object's own is without spaces. */
function namedInFile({ name, userData }: Object3D): string {
  return typeof userData.name === 'string' ? userData.name : name;
}

function kindOf(object: Object3D): string {
  if (object instanceof DirectionalLight) return 'directional light';
  if (object instanceof SpotLight) return 'spot light';
  if (object instanceof PointLight) return 'point light';
  return 'object';
}

function unitOf(light: Object3D): string {
  return light instanceof DirectionalLight ? 'lx' : 'cd';
}
