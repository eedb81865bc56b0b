import type { LightmapLayout, LightmapSurface } from '@lumencast/client';
import { type BufferGeometry, Matrix4, type Mesh, type Object3D } from 'three';
import {
  canHaveLumels,
  chartedGeometry,
  type Corners,
  disposeCharted,
  isCharted,
  lumelsAttribute,
  part,
  type Parted,
  type Sides,
  withoutCharts,
} from './charted.js';
import type { Content } from './content.js';
import { materialsOf } from './patch.js';

/** Where surfaces lie in the texture of all pages. */
export interface PlacedLayout {
  readonly layout: LightmapLayout;
  /** The first lumel of a page there. */
  readonly corner: (page: number) => readonly [x: number, y: number];
}

/** Milliseconds of a frame in which geometries are made, beyond the first one. */
const BUDGET = 1;
/**
 * Milliseconds without a frame after which meshes count as placed anew. The server gives what rests its
 * lumels again after two seconds: on a page that was hidden, nobody saw that they were gone.
 */
const GAP = 1500;

/** A primitive of a node that is to have lumels. */
interface Wanted {
  readonly node: number;
  readonly primitive: number;
  readonly sides: Sides;
  readonly corners: readonly [front: Corners, back: Corners];
}

/** A mesh that has lumels for as long as it stands where it stood when it got them. */
interface Lit {
  readonly wanted: Wanted;
  readonly mesh: Mesh;
  readonly original: BufferGeometry;
  readonly charted: BufferGeometry;
  readonly kept: Kept;
  readonly worldFromObject: Matrix4;
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
 * when layouts name them no more or when they begin to move: lumels are where the mesh was.
 */
export class LumelSurfaces {
  /** By node and primitive. */
  #wanted: ReadonlyMap<string, Wanted> = new Map();
  readonly #lit = new Map<string, Lit>();
  readonly #lumelsOf = new WeakMap<Mesh, Lit>();
  /** Those whose geometry is to be made. */
  readonly #waiting = new Set<string>();
  /** Those whose mesh is not here yet. */
  readonly #missing = new Set<string>();
  readonly #kept: Kept[] = [];
  #revision = -1;
  #updatedAt = -Infinity;
  #hasWarned = false;

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
    for (const [key, lit] of this.#lit) {
      const wanted = this.#wanted.get(key);
      if (!wanted) this.#release(key, lit);
      else if (!isSame(wanted, lit.wanted)) this.#waiting.add(key);
    }
    for (const set of [this.#waiting, this.#missing]) {
      for (const key of set) if (!this.#wanted.has(key)) set.delete(key);
    }
    for (const [key, wanted] of this.#wanted) {
      const before = former.get(key);
      if (!before || !isSame(wanted, before)) this.#waiting.add(key);
    }
  }

  /**
   * To be called each frame, after objects were moved. `revision`: another one when objects have come, gone
   * or changed; `now` in milliseconds. Makes geometries for at most so many milliseconds, and at least one
   * that waits.
   */
  update(revision: number, now: number, budget = BUDGET): void {
    const wasHidden = now - this.#updatedAt > GAP;
    this.#updatedAt = now;
    if (this.#wanted.size === 0) return;
    if (wasHidden) this.#placeAnew();
    if (revision !== this.#revision) {
      this.#revision = revision;
      for (const key of this.#missing) this.#waiting.add(key);
      this.#missing.clear();
      for (const [key, lit] of this.#lit) if (this.#meshOf(lit.wanted) !== lit.mesh) this.#leave(key, lit);
    }
    this.#make(budget);
    for (const [key, lit] of this.#lit) this.#follow(key, lit);
    if (this.#lit.size > 0) this.scene.traverse((object) => this.#clean(object));
  }

  /** Gives all meshes their own geometries back. */
  dispose(): void {
    this.setLayouts([]);
  }

  #placeAnew(): void {
    for (const { mesh, worldFromObject } of this.#lit.values()) {
      mesh.updateWorldMatrix(true, false);
      worldFromObject.copy(mesh.matrixWorld);
    }
  }

  #make(budget: number): void {
    if (this.#waiting.size === 0) return;
    const end = performance.now() + budget;
    for (const key of this.#waiting) {
      this.#waiting.delete(key);
      if (this.#light(key, this.#wanted.get(key)!) && performance.now() >= end) return;
    }
  }

  /** Gives a mesh its lumels; whether a geometry had to be made. */
  #light(key: string, wanted: Wanted): boolean {
    const before = this.#lit.get(key);
    const mesh = this.#meshOf(wanted);
    if (before) this.#release(key, before);
    if (!mesh) {
      this.#missing.add(key);
      return false;
    }
    if (!canHaveLumels(mesh) || materialsOf(mesh).some(isTransmissive)) return false;
    const original = withoutCharts(mesh.geometry);
    const kept = this.#keep(original, wanted.sides);
    if (!kept) {
      this.#warnOf(mesh);
      return true;
    }
    kept.users++;
    const lumels = lumelsAttribute(kept.parted, wanted.sides, wanted.corners);
    const charted = chartedGeometry(original, kept.parted, lumels);
    mesh.updateWorldMatrix(true, false);
    const worldFromObject = before?.mesh === mesh ? before.worldFromObject : mesh.matrixWorld.clone();
    const lit = { wanted, mesh, original, charted, kept, worldFromObject };
    this.#lit.set(key, lit);
    this.#lumelsOf.set(mesh, lit);
    mesh.geometry = charted;
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
    const { mesh, original, charted, worldFromObject } = lit;
    if (mesh.geometry !== original && mesh.geometry !== charted) return this.#leave(key, lit);
    const isInPlace = mesh.matrixWorld.equals(worldFromObject);
    mesh.geometry = isInPlace ? charted : original;
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
    this.#missing.add(key);
  }

  #release(key: string, { mesh, original, charted, kept }: Lit): void {
    this.#lit.delete(key);
    this.#lumelsOf.delete(mesh);
    if (mesh.geometry === charted) mesh.geometry = original;
    const isLast = --kept.users === 0;
    if (isLast) this.#kept.splice(this.#kept.indexOf(kept), 1);
    disposeCharted(charted, isLast);
  }

  #warnOf({ name }: Mesh): void {
    if (this.#hasWarned) return;
    this.#hasWarned = true;
    this.warn(
      `meshes whose triangles are not those of the server's file are lit by probes alone${name && `, such as ${name}`}`,
    );
  }
}

function wantedBy(layouts: readonly PlacedLayout[]): ReadonlyMap<string, Wanted> {
  const sides = new Map<string, [PlacedSurface | undefined, PlacedSurface | undefined]>();
  for (const { layout, corner } of layouts) {
    for (const surface of layout.surfaces) {
      // Further instances of a node are drawn in one go, with one geometry.
      if (surface.copy !== 0 || surface.rectangles.length !== surface.charts.sizes.length) continue;
      const key = `${surface.node}/${surface.primitive}`;
      const of = sides.get(key) ?? [undefined, undefined];
      of[Number(surface.back)] ??= { surface, corners: cornersOf(surface, corner) };
      sides.set(key, of);
    }
  }
  return new Map([...sides].map(([key, of]) => [key, wanted(of)]));
}

interface PlacedSurface {
  readonly surface: LightmapSurface;
  readonly corners: Corners;
}

function wanted([front, back]: readonly [PlacedSurface | undefined, PlacedSurface | undefined]): Wanted {
  const { node, primitive } = (front ?? back)!.surface;
  const sides = [front?.surface.charts, back?.surface.charts] as const;
  return { node, primitive, sides, corners: [front?.corners ?? [], back?.corners ?? []] };
}

function cornersOf({ rectangles }: LightmapSurface, corner: PlacedLayout['corner']): Corners {
  return rectangles.map(({ page, x, y }) => {
    const [left, top] = corner(page);
    return [left + x, top + y] as const;
  });
}

function isSame(a: Wanted, b: Wanted): boolean {
  return (
    a.sides.every((charts, side) => charts === b.sides[side]) &&
    a.corners.every((corners, side) => corners.flat().join() === b.corners[side].flat().join())
  );
}

/** Light goes through it, and what it scatters is little of what arrives. */
function isTransmissive(material: object): boolean {
  return ((material as { transmission?: number }).transmission ?? 0) > 0;
}
