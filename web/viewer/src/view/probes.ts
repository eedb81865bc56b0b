import { isVolume, type LightState, type VolumeLight } from '@lumencast/client';
import {
  BufferAttribute,
  BufferGeometry,
  Group,
  IcosahedronGeometry,
  Mesh,
  MeshBasicMaterial,
  Quaternion,
  Vector3,
} from 'three';
import { mergeVertices } from 'three/addons/utils/BufferGeometryUtils.js';

/** Least time between two colourings, milliseconds: the spheres are for looking at, not for lighting. */
const INTERVAL = 100;

/** Little spheres at the probes of volumes, each point in the colour of the irradiance that it would get there. */
export class ProbeSpheres {
  readonly group = new Group();
  readonly #fields = new Map<number, Spheres>();
  #at = -Infinity;

  constructor() {
    this.group.visible = false;
  }

  update(light: LightState, now: number): void {
    if (now - this.#at < INTERVAL) return;
    this.#at = now;
    const volumes = light.fields.filter(isVolume);
    for (const [id, spheres] of this.#fields) {
      if (volumes.some(({ field }) => field.id === id)) continue;
      spheres.dispose();
      this.#fields.delete(id);
    }
    for (const lit of volumes) {
      let spheres = this.#fields.get(lit.field.id);
      if (spheres?.field !== lit.field) {
        spheres?.dispose();
        spheres = new Spheres(lit.field);
        this.#fields.set(lit.field.id, spheres);
        this.group.add(spheres.mesh);
      }
      spheres.update(lit);
    }
  }
}

class Spheres {
  readonly mesh: Mesh<BufferGeometry, MeshBasicMaterial>;
  /** Irradiance over π of a point of the sphere: nine weights for the coefficients, a point. */
  readonly #weights: Float32Array;
  readonly #points: number;
  readonly #colors: BufferAttribute;
  #revision = -1;

  constructor(readonly field: VolumeLight['field']) {
    const { resolution, size } = field.shape.grid;
    const probes = resolution[0] * resolution[1] * resolution[2];
    const sphere = unitSphere(probes > 1500 ? 1 : 2);
    const points = sphere.getAttribute('position');
    this.#points = points.count;
    this.#weights = irradianceWeights(points.array as Float32Array);
    const spacing = Math.min(...size.map((s, axis) => s / resolution[axis]));
    const geometry = new BufferGeometry();
    geometry.setAttribute('position', new BufferAttribute(placed(field, points.array, spacing * 0.1), 3));
    this.#colors = new BufferAttribute(new Float32Array(probes * points.count * 3), 3);
    geometry.setAttribute('color', this.#colors);
    geometry.setIndex(repeated(Array.from(sphere.index!.array), points.count, probes));
    this.mesh = new Mesh(geometry, new MeshBasicMaterial({ vertexColors: true }));
  }

  update({ coefficients, revision, field }: VolumeLight): void {
    if (revision === this.#revision) return;
    this.#revision = revision;
    const { order } = field.shape;
    const stride = 3 * (order + 1) ** 2;
    const bands = Math.min(order, 2);
    const count = (bands + 1) ** 2;
    const colors = this.#colors.array as Float32Array;
    for (let first = 0, to = 0; first < coefficients.length; first += stride) {
      for (let point = 0; point < this.#points; point++, to += 3) {
        let [r, g, b] = [0, 0, 0];
        for (let i = 0; i < count; i++) {
          const weight = this.#weights[point * 9 + i];
          r += weight * coefficients[first + 3 * i];
          g += weight * coefficients[first + 3 * i + 1];
          b += weight * coefficients[first + 3 * i + 2];
        }
        colors[to] = Math.max(r, 0);
        colors[to + 1] = Math.max(g, 0);
        colors[to + 2] = Math.max(b, 0);
      }
    }
    this.#colors.needsUpdate = true;
  }

  dispose(): void {
    this.mesh.removeFromParent();
    this.mesh.geometry.dispose();
    this.mesh.material.dispose();
  }
}

function unitSphere(detail: number): BufferGeometry {
  const sphere = new IcosahedronGeometry(1, detail);
  sphere.deleteAttribute('normal');
  sphere.deleteAttribute('uv');
  return mergeVertices(sphere, 1e-4);
}

/** What a white diffuse surface with these normals reflects, as weights of the nine L2 coefficients. */
export function irradianceWeights(normals: Float32Array): Float32Array {
  const weights: number[] = [];
  // The clamped cosine's bands over π.
  const [a0, a1, a2] = [1, 2 / 3, 1 / 4];
  for (let i = 0; i < normals.length; i += 3) {
    const [x, y, z] = normals.subarray(i, i + 3);
    weights.push(
      a0 * 0.282095,
      ...[y, z, x].map((axis) => a1 * 0.488603 * axis),
      ...[1.092548 * x * y, 1.092548 * y * z, 0.315392 * (3 * z * z - 1)].map((basis) => a2 * basis),
      ...[1.092548 * x * z, 0.546274 * (x * x - y * y)].map((basis) => a2 * basis),
    );
  }
  return new Float32Array(weights);
}

/** A sphere's points at every probe of a field, in world space. */
function placed({ shape }: VolumeLight['field'], points: ArrayLike<number>, radius: number): Float32Array {
  const { center, rotation, size, resolution } = shape.grid;
  const [nx, ny, nz] = resolution;
  const out = new Float32Array(nx * ny * nz * points.length);
  const turn = new Quaternion(...rotation);
  for (let probe = 0, to = 0; probe < nx * ny * nz; probe++) {
    const cell = [probe % nx, Math.floor(probe / nx) % ny, Math.floor(probe / (nx * ny))];
    const [x, y, z] = cell.map((c, axis) => ((c + 0.5) / resolution[axis] - 0.5) * size[axis]);
    const at = new Vector3(x, y, z).applyQuaternion(turn).add(new Vector3(...center));
    for (let i = 0; i < points.length; i++) out[to++] = at.getComponent(i % 3) + radius * points[i];
  }
  return out;
}

function repeated(index: readonly number[], points: number, times: number): BufferAttribute {
  const out = new Uint32Array(index.length * times);
  for (let i = 0; i < out.length; i++)
    out[i] = index[i % index.length] + Math.floor(i / index.length) * points;
  return new BufferAttribute(out, 1);
}
