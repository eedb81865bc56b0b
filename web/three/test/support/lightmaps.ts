/** Lightmaps that tests make up. */
import type {
  Charts,
  FieldInfo,
  LightmapLayout,
  LightmapLight,
  LightmapSurface,
  LumelPicture,
  LumelRegion,
} from '@lumencast/client';

export function lightmapField(id = 0, pageSize = 8, pages = 1): FieldInfo<'lightmap'> {
  const shape = { coding: 'halves', pageSize, pages, layout: '0'.repeat(64) } as const;
  return { id, use: 'static', kind: 'lightmap', shape };
}

export function halves(value: number, lumels = 64, scale = 1): LumelPicture {
  return { kind: 'halves', scale, texels: new Uint16Array(4 * lumels).fill(value) };
}

export function region(changes: Partial<LumelRegion> = {}): LumelRegion {
  const picture = halves(0);
  return { region: 0, page: 0, min: [0, 0], size: [8, 8], revision: 1, shown: 1, picture, ...changes };
}

export function lightmapLight(
  regions: readonly LumelRegion[],
  layout?: LightmapLayout,
  field = lightmapField(),
): LightmapLight {
  const scale = Math.max(...regions.map(({ picture }) => picture.scale));
  return { kind: 'lightmap', field, layout, regions, scale, age: 0, sceneVersion: 1, tick: 1 };
}

/** Of a square or a triangle whose vertices are numbered as here: one rectangle, two lumels across. */
export function chartsOf(triangles: readonly number[]): Charts {
  const count = Math.max(...triangles) + 1;
  return {
    sizes: [[2, 2]],
    sources: Uint32Array.from({ length: count }, (_, i) => i),
    rectangle: new Uint32Array(count),
    at: new Float32Array(2 * count).fill(1),
    triangles: Int32Array.from(triangles),
  };
}

export function surface(
  changes: Partial<LightmapSurface> & Pick<LightmapSurface, 'charts'>,
): LightmapSurface {
  return {
    ...{ node: 0, copy: 0, primitive: 0, back: false, rectangles: [{ page: 0, x: 2, y: 4 }] },
    ...changes,
  };
}

export function layout(...surfaces: LightmapSurface[]): LightmapLayout {
  return { pageSize: 8, pages: 1, surfaces };
}
