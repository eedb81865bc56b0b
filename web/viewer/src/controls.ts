import { capabilities, isLightmap, type Status } from '@lumencast/client';
import type { Shown } from '@lumencast/three';
import { Dock, type Toggle } from './ui/dock.js';
import { h } from './ui/dom.js';
import { flashlightHint, flyHint, helpPanel } from './ui/help.js';
import { Inspector, nameOf } from './ui/inspector.js';
import { LumelsPanel } from './ui/lumels.js';
import { Notices } from './ui/notices.js';
import { StatsPanel } from './ui/stats.js';
import { isTyping } from './view/camera-rig.js';
import { TONE_MAPPINGS } from './view/renderer.js';
import type { Gizmo } from './view/selection.js';
import { SKY } from './view/sky.js';
import type { Viewer } from './viewer.js';
import { lumelWords, unshownWords, wordsFor } from './words.js';

/** The bar beside the picture, the panels over it, and the keys. */
export class Controls {
  readonly overlay: HTMLElement;
  readonly notices = new Notices();
  readonly #dock: Dock;
  readonly #inspector: Inspector;
  readonly #stats = new StatsPanel();
  readonly #lumels: LumelsPanel;
  readonly #help = helpPanel(() => this.#toggle('help'));
  readonly #brand: HTMLElement;
  #statsAt = 0;

  constructor(private readonly viewer: Viewer) {
    const { session, selection, gltf } = viewer;
    this.#brand = h(
      'div',
      { class: 'panel brand' },
      h('i', { class: 'dot' }),
      h('strong', {}, 'Lumencast'),
      h('span', {}, viewer.isSaved ? `${session.scene} · saved light` : session.scene),
    );
    this.#dock = this.#createDock(gltf.cameras.map((camera, i) => camera.name || `Camera ${i + 1}`));
    this.#inspector = new Inspector({
      touched: (object) => viewer.touch.touch(object),
      carrier: (object) => viewer.light.content.carrier(object),
      gizmo: (mode) => this.#setGizmo(mode),
      close: () => selection.select(undefined),
    });
    this.#lumels = new LumelsPanel({
      light: viewer.light,
      pages: () => viewer.togglePages(),
      close: () => this.#toggle('lumels'),
    });
    selection.onChange = (object) => this.#inspector.show(object, selection.gizmo);
    this.#stats.element.hidden = innerWidth < 720 || innerHeight < 480;
    this.overlay = h(
      'div',
      { class: 'controls' },
      this.#brand,
      this.notices.element,
      h('div', { class: 'side' }, this.#stats.element, this.#lumels.element, this.#inspector.element),
      this.#help,
    );
    addEventListener('keydown', (event) => this.#key(event));
    session.on('status', (status) => this.#say(status));
    this.#say(session.status);
    for (const notice of capabilities().notices) this.notices.passing(notice, 14);
  }

  get bar(): HTMLElement {
    return this.#dock.element;
  }

  /** Shows how things are; to be called each frame. */
  update(): void {
    const { viewer } = this;
    const dock = this.#dock;
    dock.shown = viewer.light.show;
    dock.exposure = Math.log2(viewer.exposure);
    dock.lights = viewer.lights.map(nameOf);
    dock.set('fly', viewer.rig.mode === 'fly');
    dock.set('probes', viewer.probes.group.visible);
    dock.set('flashlight', viewer.flashlight.on);
    dock.set('playing', !viewer.playing);
    // Without a server, nothing moves and nobody computes another light's way.
    const { isSaved } = viewer;
    dock.hide('playing', isSaved || viewer.light.content.animations.size === 0);
    dock.hide('flashlight', isSaved);
    dock.set('stats', !this.#stats.element.hidden);
    dock.set('help', !this.#help.hidden);
    this.#updateLumels();
    this.#inspector.update();
    this.#offerSky();
    if (performance.now() - this.#statsAt < 250) return;
    this.#statsAt = performance.now();
    if (!this.#stats.element.hidden) this.#stats.update(viewer.stats());
  }

  #updateLumels(): void {
    const { viewer } = this;
    const { element } = this.#lumels;
    const lightmap = viewer.session.catalog?.fields.find(isLightmap);
    this.#dock.hide('lumels', !lightmap);
    this.#dock.set('lumels', !element.hidden);
    if (!lightmap || element.hidden) return;
    const isShown = !viewer.session.unshown.includes(lightmap);
    const words = isShown
      ? lumelWords({ ...lightmap.shape, meshes: viewer.light.lumelMeshes })
      : unshownWords(capabilities());
    this.#lumels.update(words, viewer.pages.mesh.visible);
  }

  #createDock(cameras: readonly string[]): Dock {
    const { viewer } = this;
    const tones = Object.keys(TONE_MAPPINGS);
    return new Dock(
      {
        show: (shown) => viewer.setMode(shown),
        exposure: (stops) => {
          viewer.autoExposure = false;
          viewer.exposure = 2 ** stops;
        },
        autoExposure: () => void viewer.meter(),
        tone: (name) => (viewer.renderer.toneMapping = TONE_MAPPINGS[name]),
        camera: (index) => {
          const camera = viewer.gltf.cameras[index];
          if (camera) viewer.rig.goTo(camera);
          else viewer.rig.overview();
        },
        toggle: (what) => this.#toggle(what),
        select: (index) => viewer.selection.select(viewer.lights[index]),
      },
      tones,
      cameras,
    );
  }

  #toggle(what: Toggle): void {
    const { viewer } = this;
    switch (what) {
      case 'fly':
        viewer.rig.mode = viewer.rig.mode === 'fly' ? 'orbit' : 'fly';
        if (viewer.rig.mode === 'fly') this.notices.passing(flyHint(), 6);
        return;
      case 'probes':
        viewer.probes.group.visible = !viewer.probes.group.visible;
        return;
      case 'lumels':
        this.#lumels.element.hidden = !this.#lumels.element.hidden;
        return;
      case 'flashlight':
        return this.#takeFlashlight();
      case 'playing':
        return viewer.togglePlaying();
      case 'stats':
        this.#stats.element.hidden = !this.#stats.element.hidden;
        return;
      case 'help':
        this.#dock.closeSettings();
        this.#help.hidden = !this.#help.hidden;
    }
  }

  /** Where a scene has no light of its own, all is black. */
  #offerSky(): void {
    const { viewer } = this;
    const message = 'Nothing in this scene gives light.';
    const take = () => {
      viewer.light
        .edit({ edit: 'set_environment', environment: SKY })
        .then(() => viewer.meterAnew())
        .catch((error: Error) => this.notices.passing(`No sky: ${error.message}`));
    };
    this.notices.offer(viewer.isDark ? { message, label: 'Put it under a sky', take } : undefined);
  }

  #takeFlashlight(): void {
    const { flashlight, selection } = this.viewer;
    if (flashlight.on) return this.#putFlashlightAway();
    selection.select(undefined);
    flashlight.take().then(
      () => flashlight.on && this.notices.passing(flashlightHint(flashlight.isAdded), 9),
      (error: Error) => this.notices.passing(`No flashlight: ${error.message}`),
    );
  }

  #putFlashlightAway(): void {
    this.viewer.flashlight
      .putAway()
      .catch((error: Error) => this.notices.passing(`The flashlight stays: ${error.message}`));
  }

  #setGizmo(mode: Gizmo): void {
    const { selection } = this.viewer;
    selection.gizmo = mode;
    this.#inspector.show(selection.selected, mode);
  }

  #key(event: KeyboardEvent): void {
    if (isTyping(event) || event.ctrlKey || event.metaKey || event.altKey) return;
    const shown: Record<string, Shown> = { Digit1: 'direct', Digit2: 'indirect', Digit3: 'both' };
    const toggles: Record<string, Toggle> = {
      KeyC: 'fly',
      KeyP: 'probes',
      KeyL: 'lumels',
      KeyF: 'flashlight',
      KeyI: 'stats',
      Space: 'playing',
    };
    const { code } = event;
    const toggle = this.#dock.has(toggles[code]) ? toggles[code] : undefined;
    if (event.key === '?') this.#toggle('help');
    else if (shown[code]) this.viewer.setMode(shown[code]);
    else if (toggle) this.#toggle(toggle);
    else if (code === 'KeyX') void this.viewer.meter();
    else if (code === 'KeyG') this.#setGizmo('translate');
    else if (code === 'KeyR') this.#setGizmo('rotate');
    else if (code === 'Escape') this.#letGo();
    else return;
    event.preventDefault();
  }

  #letGo(): void {
    this.#putFlashlightAway();
    this.viewer.selection.select(undefined);
    this.#help.hidden = true;
    this.#dock.closeSettings();
  }

  #say(status: Status): void {
    this.#brand.dataset.state = status.state;
    // While it connects, first or again, what was said stays.
    if (status.state === 'connecting') return;
    this.notices.standing(wordsFor(status, this.viewer.session.catalog !== undefined));
  }
}
