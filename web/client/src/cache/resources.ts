/** Layouts and charts that have come, and those to be asked for (docs/wire.md, "Resources"). */
import { type Catalog, isLightmap } from '../codec/catalog.js';
import { type Charts, readCharts } from '../codec/charts.js';
import { layOut, type LayoutResource, type LightmapLayout, readLayout } from '../codec/layout.js';
import type { LightmapShape } from '../codec/lightmap-shape.js';
import { LIMITS } from '../codec/limits.js';
import { sha256 } from '../codec/sha256.js';
import { WireError } from '../wire-error.js';

/** A resource that something names: it is wanted, here, or makes no sense and is not asked for again. */
type State<T> = 'wanted' | 'unreadable' | { readonly value: T; readonly bytes: number };
type States<T> = Map<string, State<T>>;

/** All resources that the catalog and known layouts name, by their hashes. */
export class Resources {
  private layouts: States<LayoutResource> = new Map();
  private charts: States<Charts> = new Map();
  /** Layouts of all surfaces whose charts have come; an entry goes when it is no longer right. */
  private readonly laidOut = new Map<string, LightmapLayout>();

  /** `most`: bytes of all that are kept. */
  constructor(private readonly most: number = LIMITS.resourceBytesInAll) {}

  /** Those that have not come yet: layouts, then charts. */
  wanted(): string[] {
    const wanted = <T>(states: States<T>) => [...states].filter(([, state]) => state === 'wanted');
    return [...wanted(this.layouts), ...wanted(this.charts)].map(([hash]) => hash);
  }

  /** Wants the layouts that a catalog names, and forgets all that nothing names. */
  follow(catalog: Catalog): void {
    const named = new Set(catalog.fields.filter(isLightmap).map(({ shape }) => shape.layout));
    this.layouts = only(this.layouts, named);
    for (const hash of this.laidOut.keys()) if (!named.has(hash)) this.laidOut.delete(hash);
    this.followLayouts();
  }

  /** Wants the charts that known layouts name. The others go once all layouts have told what they name. */
  private followLayouts(): void {
    const named = values(this.layouts).flatMap(({ surfaces }) => surfaces.map(({ charts }) => charts));
    const isWaiting = [...this.layouts.values()].includes('wanted');
    this.charts = only(this.charts, new Set([...(isWaiting ? this.charts.keys() : []), ...named]));
  }

  /**
   * Takes a resource in; returns whether it was wanted.
   * @throws WireError where it was, and cannot be read or is too much; it is then wanted no longer.
   */
  add(bytes: Uint8Array): boolean {
    const hash = sha256(bytes);
    if (this.layouts.get(hash) === 'wanted') {
      try {
        this.settle(this.layouts, hash, bytes, readLayout);
      } finally {
        this.followLayouts();
      }
    } else if (this.charts.get(hash) === 'wanted') {
      this.settle(this.charts, hash, bytes, readCharts);
      for (const layout of this.laidOut.keys()) {
        const isNamed = valueOf(this.layouts.get(layout))?.surfaces.some(({ charts }) => charts === hash);
        if (isNamed) this.laidOut.delete(layout);
      }
    } else {
      return false;
    }
    return true;
  }

  private settle<T>(states: States<T>, hash: string, bytes: Uint8Array, read: (bytes: Uint8Array) => T): T {
    states.set(hash, 'unreadable');
    const all = bytesOf(this.layouts) + bytesOf(this.charts) + bytes.length;
    if (all > this.most) throw new WireError('limit', `resources of ${all} bytes`);
    const value = read(bytes);
    states.set(hash, { value, bytes: bytes.length });
    return value;
  }

  /** The layout of a lightmap, where it is known and of its pages: the same object until it changes. */
  layoutOf({ layout: hash, pageSize, pages }: LightmapShape): LightmapLayout | undefined {
    const resource = valueOf(this.layouts.get(hash));
    if (resource?.pageSize !== pageSize || resource.pages !== pages) return undefined;
    let layout = this.laidOut.get(hash);
    if (!layout) {
      layout = layOut(resource, (charts) => valueOf(this.charts.get(charts)));
      this.laidOut.set(hash, layout);
    }
    return layout;
  }

  /** Whether all is here that a lightmap's surfaces are read by. */
  hasAllOf(shape: LightmapShape): boolean {
    const resource = valueOf(this.layouts.get(shape.layout));
    const isHere = (charts: string) => valueOf(this.charts.get(charts)) !== undefined;
    return this.layoutOf(shape) !== undefined && resource!.surfaces.every(({ charts }) => isHere(charts));
  }
}

/** The states of those hashes alone that are named; those that were not there are wanted. */
function only<T>(states: States<T>, named: ReadonlySet<string>): States<T> {
  return new Map([...named].map((hash) => [hash, states.get(hash) ?? 'wanted']));
}

function valueOf<T>(state: State<T> | undefined): T | undefined {
  return typeof state === 'object' ? state.value : undefined;
}

function values<T>(states: States<T>): T[] {
  return [...states.values()].map(valueOf).filter((value) => value !== undefined);
}

function bytesOf<T>(states: States<T>): number {
  return [...states.values()].reduce((sum, state) => sum + (typeof state === 'object' ? state.bytes : 0), 0);
}
