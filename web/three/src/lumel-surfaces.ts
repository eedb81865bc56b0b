import { type BufferGeometry, type InstancedMesh, Matrix4, type Mesh, type Object3D } from 'three';
import {
  canHaveLumels,
  chartedGeometry,
  disposeCharted,
  isCharted,
  lumelsAttribute,
  part,
  type Parted,
  setLumelShare,
  type Sides,
  withoutCharts,
} from './charted.js';
import type { Content } from './content.js';
import { laterWay } from './handover.js';
import { type Copies, lumelsOfCopies } from './lumel-copies.js';
import { isSame, type Placed, type PlacedLayout, type Wanted, wantedBy } from './lumel-wanted.js';
import { materialsOf } from './patch.js';
import { isSamePlace } from './same-place.js';

/** Milliseconds of a frame in which geometries are made, beyond the first one. */
const BUDGET = 1;
/**
 * Milliseconds without a frame after which meshes count as placed anew. The server gives what rests its
 * lumels again after two seconds: on a page that was hidden, nobody saw that they were gone.
 */
const GAP = 1500;

/** A mesh that has lumels, or is on its way to them or back. */
interface Lit {
  readonly wanted: Wanted;
  readonly mesh: Mesh;
  readonly original: BufferGeometry;
  readonly charted: BufferGeometry;
  readonly kept: Kept;
  /** Where the mesh stood when it got its lumels: elsewhere they do not show its light. */
  readonly worldFromObject: Matrix4;
  /** How far it has come from probes to lumels. At 0 it shows its own geometry. */
  way: number;
  /** Whether that grows, or falls. */
  comes: boolean;
}

/** What geometries with the same charts share. */
interface Kept {
  readonly original: BufferGeometry;
  readonly sides: Sides;
  readonly parted: Parted;
  users: number;
}

/**
 * Gives still meshes geometries that know where their lumels lie, as layouts say, and their own ones back
 * when layouts name them no more or when they begin to move: lumels are where the mesh was. Both take
 * half a second, in which light passes from probes to lumels or back. What has not been seen by probes
 * has its lumels at once: meshes of the first layouts, and those that come later than their layout.
 */
export class LumelSurfaces {
  /** By node and primitive. */
  #wanted: ReadonlyMap<string, Wanted> = new Map();
  readonly #lit = new Map<string, Lit>();
  readonly #lumelsOf = new WeakMap<Mesh, Lit>();
  /** Those whose geometry is to be made, and how far on their way those begin that have none. */
  readonly #waiting = new Map<string, number>();
  /** Those whose mesh is not here yet. */
  readonly #missing = new Set<string>();
  readonly #kept: Kept[] = [];
  #revision = -1;
  #updatedAt = -Infinity;
  #hasLayouts = false;
  readonly #warned = new Set<string>();

  constructor(
    private readonly scene: Object3D,
    private readonly content: Content,
    private readonly warn: (message: string) => void,
  ) {}

  /** Meshes that have lumels now. */
  get count(): number {
    let count = 0;
    for (const { mesh, charted } of this.#lit.values()) if (mesh.geometry === charted) count++;
    return count;
  }

  /** Takes over what has changed of where surfaces lie; geometries are made in {@link update}. */
  setLayouts(layouts: readonly PlacedLayout[]): void {
    const former = this.#wanted;
    this.#wanted = wantedBy(layouts);
    const way = this.#hasLayouts ? 0 : 1;
    this.#hasLayouts ||= layouts.length > 0;
    for (const keys of [this.#waiting, this.#missing]) {
      for (const key of keys.keys()) if (!this.#wanted.has(key)) keys.delete(key);
    }
    for (const [key, wanted] of this.#wanted) {
      const lit = this.#lit.get(key);
      // It rests again, wherever it was before.
      if (lit && !former.has(key)) place(lit);
      const known = lit?.wanted ?? former.get(key);
      if (!known || !isSame(wanted, known)) this.#waiting.set(key, this.#waiting.get(key) ?? way);
    }
  }

  /** Gives all meshes their own geometries back at once, and takes the next layouts for the first. */
  clear(): void {
    this.#wanted = new Map();
    this.#hasLayouts = false;
    this.#waiting.clear();
    this.#missing.clear();
    for (const [key, lit] of this.#lit) this.#release(key, lit);
  }

  /**
   * To be called each frame, after objects were moved. `revision`: another one when objects have come, gone
   * or changed; `now` in milliseconds. Makes geometries for at most so many milliseconds, and at least one
   * that waits.
   */
  update(revision: number, now: number, budget = BUDGET): void {
    const elapsed = now - this.#updatedAt;
    this.#updatedAt = now;
    if (this.#wanted.size === 0 && this.#lit.size === 0) return;
    for (const lit of this.#lit.values()) lit.way = laterWay(lit.way, lit.comes, elapsed);
    if (elapsed > GAP) for (const lit of this.#lit.values()) place(lit);
    if (revision !== this.#revision) {
      this.#revision = revision;
      for (const key of this.#missing) this.#waiting.set(key, 1);
      this.#missing.clear();
      for (const [key, lit] of this.#lit) if (this.#meshOf(lit.wanted) !== lit.mesh) this.#leave(key, lit);
    }
    this.#make(budget);
    for (const [key, lit] of this.#lit) this.#follow(key, lit);
    if (this.#lit.size > 0) this.scene.traverse((object) => this.#clean(object));
  }

  #make(budget: number): void {
    if (this.#waiting.size === 0) return;
    const end = performance.now() + budget;
    for (const [key, way] of this.#waiting) {
      this.#waiting.delete(key);
      if (this.#light(key, this.#wanted.get(key)!, way) && performance.now() >= end) return;
    }
  }

  /** Gives a mesh its lumels, so far on its way if it has none yet; whether a geometry had to be made. */
  #light(key: string, wanted: Wanted, firstWay: number): boolean {
    const before = this.#lit.get(key);
    const mesh = this.#meshOf(wanted);
    if (before) this.#release(key, before);
    if (!mesh) {
      this.#missing.add(key);
      return false;
    }
    if (!canHaveLumels(mesh) || materialsOf(mesh).some(isTransmissive)) return false;
    const original = withoutCharts(mesh.geometry);
    const of = lumelsOf(mesh, wanted);
    if (of?.isWhole === false) this.#warnOf(mesh, 'copies whose charts are not those of most others');
    if (!of?.sides.some((charts) => charts)) return false;
    const kept = this.#keep(original, of.sides);
    if (!kept) {
      this.#warnOf(mesh, "meshes whose triangles are not those of the server's file");
      return true;
    }
    kept.users++;
    const lumels = lumelsAttribute(kept.parted, of.sides, of.corners);
    const known = before?.mesh === mesh ? before : undefined;
    const way = known?.way ?? firstWay;
    const charted = chartedGeometry(original, kept.parted, lumels, way, of.each);
    const worldFromObject = new Matrix4();
    const lit = { wanted, mesh, original, charted, kept, worldFromObject, way, comes: true };
    if (known) worldFromObject.copy(known.worldFromObject);
    else place(lit);
    this.#lit.set(key, lit);
    this.#lumelsOf.set(mesh, lit);
    return true;
  }

  #meshOf({ node, primitive }: Wanted): Mesh | undefined {
    return this.content.mesh(node, primitive);
  }

  /** `undefined` where the charts are not those of the geometry. */
  #keep(original: BufferGeometry, sides: Sides): Kept | undefined {
    const isIt = (kept: Kept) => kept.original === original && kept.sides.every((of, i) => of === sides[i]);
    const found = this.#kept.find(isIt);
    if (found) return found;
    const parted = part(original, sides);
    if (!parted) return undefined;
    const kept = { original, sides, parted, users: 0 };
    this.#kept.push(kept);
    return kept;
  }

  /** Lumels show a mesh's light only where they were gathered at. */
  #follow(key: string, lit: Lit): void {
    const { mesh, original, charted, way, worldFromObject } = lit;
    if (mesh.geometry !== original && mesh.geometry !== charted) return this.#leave(key, lit);
    const isWanted = this.#wanted.has(key);
    lit.comes = isWanted && isSamePlace(mesh.matrixWorld, worldFromObject);
    if (way === 0 && !isWanted) return this.#release(key, lit);
    mesh.geometry = way > 0 || lit.comes ? charted : original;
    setLumelShare(charted, way);
  }

  /** A copy that the program has made of a mesh with lumels has none of its own. */
  #clean(object: Object3D): void {
    const mesh = object as Mesh;
    if (!isCharted(mesh.geometry) || this.#lumelsOf.get(mesh)?.charted === mesh.geometry) return;
    mesh.geometry = withoutCharts(mesh.geometry);
  }

  /** The mesh is no longer the one that is wanted. */
  #leave(key: string, lit: Lit): void {
    this.#release(key, lit);
    if (this.#wanted.has(key)) this.#missing.add(key);
  }

  #release(key: string, { mesh, original, charted, kept }: Lit): void {
    this.#lit.delete(key);
    this.#lumelsOf.delete(mesh);
    if (mesh.geometry === charted) mesh.geometry = original;
    const isLast = --kept.users === 0;
    if (isLast) this.#kept.splice(this.#kept.indexOf(kept), 1);
    disposeCharted(charted, isLast);
  }

  /** Says, once, what is lit by probes alone. */
  #warnOf({ name }: Mesh, what: string): void {
    if (this.#warned.has(what)) return;
    this.#warned.add(what);
    this.warn(`${what} are lit by probes alone${name && `, such as ${name}`}`);
  }
}

/** The lumels of a mesh, or of its copies. */
function lumelsOf(mesh: Mesh, wanted: Wanted): (Placed & Partial<Copies>) | undefined {
  const { instanceMatrix } = mesh as Partial<InstancedMesh>;
  return instanceMatrix ? lumelsOfCopies(wanted, instanceMatrix.count) : wanted.copies.get(0);
}

/** Says that a mesh has its lumels where it now stands. */
function place({ mesh, worldFromObject }: Lit): void {
  mesh.updateWorldMatrix(true, false);
  worldFromObject.copy(mesh.matrixWorld);
}

/** Light goes through it, and what it scatters is little of what arrives. */
function isTransmissive(material: object): boolean {
  return ((material as { transmission?: number }).transmission ?? 0) > 0;
}
