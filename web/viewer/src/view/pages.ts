import type { LumencastLight } from '@lumencast/three';
import { DoubleSide, Mesh, MeshBasicMaterial, type PerspectiveCamera, PlaneGeometry, Vector3 } from 'three';

/** Of the picture's height or width, whichever is less for the pages, so much. */
const SHARE = 0.86;

/** All pages of lumels, flat before the camera: as bright as white surfaces that they lit. */
export class PagesView {
  readonly mesh = new Mesh(new PlaneGeometry(1, 1), new MeshBasicMaterial({ side: DoubleSide }));
  readonly #ahead = new Vector3();

  constructor() {
    const { material, geometry } = this.mesh;
    this.mesh.name = 'pages';
    this.mesh.visible = false;
    this.mesh.renderOrder = 1e6;
    Object.assign(material, { depthTest: false, depthWrite: false, transparent: true });
    // Rows from the top, as pictures of pages have them.
    const uv = geometry.getAttribute('uv');
    for (let i = 0; i < uv.count; i++) uv.setY(i, 1 - uv.getY(i));
  }

  update(camera: PerspectiveCamera, light: Pick<LumencastLight, 'pages' | 'look' | 'preExposure'>): void {
    const { pages } = light;
    const { mesh } = this;
    if (!pages) return void (mesh.visible = false);
    if (mesh.material.map !== pages.texture) {
      mesh.material.map = pages.texture;
      mesh.material.needsUpdate = true;
    }
    // What lumels are looked into by does not change with the exposure.
    const scale = light.look === 'light' ? pages.scale / Math.PI : 1 / light.preExposure;
    mesh.material.color.setRGB(scale, scale, scale);
    const { width, height } = pages.texture.image as { width: number; height: number };
    const distance = 2 * camera.near;
    const seen = 2 * distance * Math.tan((camera.fov * Math.PI) / 360);
    const side = SHARE * Math.min(seen / height, (seen * camera.aspect) / width);
    mesh.scale.set(side * width, side * height, 1);
    mesh.quaternion.copy(camera.quaternion);
    this.#ahead.set(0, 0, -distance).applyQuaternion(camera.quaternion);
    mesh.position.copy(camera.position).add(this.#ahead);
  }
}
