import {
  Box3,
  DirectionalLight,
  DoubleSide,
  type Light,
  type Material,
  Matrix4,
  type Mesh,
  type Object3D,
  PointLight,
  Quaternion,
  SpotLight,
  Vector3,
} from 'three';
import { isHidden } from './exported.js';
import { isPunctualLight } from './lights.js';
import { materialsOf } from './patch.js';

const DEFAULT_SHADOW_LIGHTS = 4;

export interface ShadowOptions {
  /** Texels of a shadow map along an axis; a point light has six maps of half that. 2048 unless given. */
  mapSize?: number;
  /** Most lights that cast shadows: each takes a texture unit of every material. 4 unless given. */
  lights?: number;
}

/**
 * Shadows of a scene's direct light, as the server traces them: every surface blocks light from both
 * sides, also the back of a single-sided one; a directional light's map is fitted to the scene.
 */
export class Shadows {
  readonly #mapSize: number;
  readonly #maxLights: number;
  readonly #lights: Light[] = [];
  readonly #bounds = new Box3();
  readonly #fitted = new WeakMap<DirectionalLight, Quaternion>();

  constructor({ mapSize = 2048, lights = DEFAULT_SHADOW_LIGHTS }: ShadowOptions = {}) {
    this.#mapSize = mapSize;
    this.#maxLights = lights;
  }

  /** Lets an object and all below it cast and receive shadows. */
  add(root: Object3D): void {
    root.traverse((object) => {
      const mesh = object as Mesh;
      if (mesh.isMesh) {
        const materials = materialsOf(mesh);
        mesh.castShadow = !materials.every(isClear);
        mesh.receiveShadow = true;
        for (const material of materials) material.shadowSide = DoubleSide;
      } else if (isPunctualLight(object) && !isHidden(object) && this.#lights.length < this.#maxLights) {
        this.#lights.push(object);
        object.castShadow = true;
        const size = object instanceof PointLight ? this.#mapSize / 2 : this.#mapSize;
        object.shadow.mapSize.set(size, size);
      }
    });
  }

  /** Forgets a light that leaves the scene. */
  remove(root: Object3D): void {
    root.traverse((object) => {
      const index = this.#lights.indexOf(object as Light);
      if (index >= 0) this.#lights.splice(index, 1);
    });
  }

  /** Fits the shadow cameras to what the scene now holds; maps are drawn anew, as they are read by these. */
  fit(content: Object3D): void {
    this.#bounds.setFromObject(content);
    if (this.#bounds.isEmpty()) return;
    for (const light of this.#lights) {
      if (light instanceof DirectionalLight) this.#fitted.delete(light);
      else if (light instanceof PointLight || light instanceof SpotLight) fitLocal(light, this.#bounds);
    }
    this.update();
  }

  /** Fits directional lights that have turned since the last call. */
  update(): void {
    if (this.#bounds.isEmpty()) return;
    for (const light of this.#lights) {
      if (!(light instanceof DirectionalLight)) continue;
      light.updateWorldMatrix(true, true);
      const turn = light.getWorldQuaternion(quaternion);
      const fitted = this.#fitted.get(light);
      if (fitted && fitted.angleTo(turn) < 1e-5) continue;
      this.#fitted.set(light, turn.clone());
      fitDirectional(light, this.#bounds);
    }
  }
}

const quaternion = new Quaternion();
const lightFromWorld = new Matrix4();
const inLight = new Box3();
const extent = new Vector3();
const from = new Vector3();
const to = new Vector3();

/** Glass and the like: the server lets light through. */
function isClear(material: Material): boolean {
  const { transmission = 0 } = material as Material & { transmission?: number };
  return transmission > 0.5 || (material.transparent && material.opacity < 0.5);
}

function fitDirectional(light: DirectionalLight, bounds: Box3): void {
  from.setFromMatrixPosition(light.matrixWorld);
  to.setFromMatrixPosition(light.target.matrixWorld);
  const { camera } = light.shadow;
  // As three.js itself sets the shadow's camera up.
  lightFromWorld.lookAt(from, to, camera.up).setPosition(from).invert();
  inLight.copy(bounds).applyMatrix4(lightFromWorld);
  Object.assign(camera, {
    left: inLight.min.x,
    right: inLight.max.x,
    bottom: inLight.min.y,
    top: inLight.max.y,
  });
  // Along −Z; a margin keeps the outermost surfaces off the clipping planes.
  const margin = 0.01 * (inLight.max.z - inLight.min.z) + 1e-3;
  camera.near = -inLight.max.z - margin;
  camera.far = -inLight.min.z + margin;
  camera.updateProjectionMatrix();
  inLight.getSize(extent);
  const texel = Math.max(extent.x, extent.y) / light.shadow.mapSize.x;
  light.shadow.normalBias = 1.5 * texel;
  light.shadow.bias = -texel / (camera.far - camera.near);
  light.shadow.needsUpdate = true;
}

function fitLocal(light: PointLight | SpotLight, bounds: Box3): void {
  const reach = bounds.getSize(extent).length();
  const { camera } = light.shadow;
  camera.near = reach * 1e-3;
  camera.far = reach * 1.5;
  camera.updateProjectionMatrix();
  // A texel grows with the distance; this is about one at a third of the scene's extent.
  light.shadow.normalBias = (reach / 3 / light.shadow.mapSize.x) * 2;
  light.shadow.bias = -1e-4;
  light.shadow.needsUpdate = true;
}
