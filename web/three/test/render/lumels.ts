/** Draws two floors side by side, of which one or both have lumels, and reads them back after each change. */
import {
  type Charts,
  halfBits,
  type LightmapLayout,
  type LightmapLight,
  type LightmapSurface,
  type LumelPicture,
  type LumelRegion,
} from '@lumencast/client';
import {
  DataTexture,
  DoubleSide,
  InstancedMesh,
  Matrix4,
  Mesh,
  MeshLambertMaterial,
  PlaneGeometry,
  Scene,
} from 'three';
import { WebGPURenderer } from 'three/webgpu';
import {
  fromAbove,
  type Kind,
  lit,
  middleRow,
  type Radiance,
  rendererOf,
  session,
  volumeLight,
} from './stage.js';

/** Renderers, and WebGPURenderer without WebGPU. */
export type Drawer = Kind | 'fallback';

/** Lumels along both sides of the page, and of each of its four tiles. */
export const PAGE = 16;
export const TILE = PAGE / 2;

/** What changes from one picture to the next; what is not told stays. */
export interface Step {
  /** Pictures of tiles by number, and how far along the way to them one is. */
  readonly tiles?: Readonly<Record<number, { picture: Picture; revision: number; shown?: number }>>;
  /** The same of slopes. */
  readonly slopes?: Step['tiles'];
  /** A normal map, the same all over, by its codes; that of the first step. */
  readonly bump?: readonly [number, number, number];
  readonly strengths?: { static: number; dynamic: number };
  readonly preExposure?: number;
  readonly show?: 'both' | 'direct';
  /** Milliseconds since the last picture, a frame's unless told. */
  readonly after?: number;
  /** Whether the layout names the left floor. */
  readonly named?: boolean;
  /** Metres that the left floor is moved along z, though nobody has told the server. */
  readonly moved?: number;
  /** The left floor is seen from below, where it has the lumels of its back. */
  readonly turned?: boolean;
  readonly look?: 'light' | 'lumels';
}

/** Irradiance of each lumel of a tile, row after row, or the codes of planes. */
export type Picture =
  | { readonly kind: 'halves'; readonly scale: number; readonly irradiance: readonly (readonly number[])[] }
  | {
      readonly kind: 'planes';
      readonly scale: number;
      readonly toe: number;
      readonly octaves: number;
      readonly y: readonly number[];
      readonly co: readonly number[];
      readonly cg: readonly number[];
      readonly chroma: number;
    };

/**
 * Radiance along x of both floors: the volume's is 1 everywhere. As copies of one mesh, drawn in one go, the
 * right one has lumels, too, in the second tile, but none on its back.
 */
export async function lumels(kind: Drawer, steps: readonly Step[], areCopies = false): Promise<Radiance[][]> {
  const renderer = kind === 'fallback' ? new WebGPURenderer({ forceWebGL: true }) : await rendererOf(kind);
  if (kind === 'fallback') await (renderer as WebGPURenderer).init();
  const scene = new Scene();
  // One material for what has lumels and for what has none.
  const material = new MeshLambertMaterial({ color: 0xffffff, side: DoubleSide });
  const bump = steps.find((step) => step.bump)?.bump;
  if (bump) {
    material.normalMap = new DataTexture(Uint8Array.from([...bump, 255]), 1, 1);
    material.normalMap.needsUpdate = true;
  }
  const floor = new PlaneGeometry(2, 4);
  const copies = new InstancedMesh(floor, material, 2);
  const meshes = [-1, 1].map((x, i) => {
    copies.setMatrixAt(i, new Matrix4().makeTranslation(x, 0, 0));
    const mesh = new Mesh(floor, material);
    mesh.position.x = x;
    return mesh;
  });
  const floors = areCopies ? [copies] : meshes;
  for (const mesh of floors) {
    mesh.rotation.x = -Math.PI / 2;
    scene.add(mesh);
  }
  const coefficients = Array.from({ length: 24 * 27 }, (_, i) => (i % 27 < 3 ? 1 / 0.282095 : 0));
  const volume = volumeLight(coefficients, { id: 1, size: [8, 4, 8] });
  const field = {
    id: 0,
    use: 'static',
    kind: 'lightmap',
    shape: {
      ...({ coding: 'halves', pageSize: PAGE, pages: 1, layout: '0'.repeat(64) } as const),
      ...(steps.some((step) => step.slopes) && { slopes: true as const }),
    },
  } as const;
  const nothing: LightmapLayout = { pageSize: PAGE, pages: 1, surfaces: [] };
  const surface = (copy: number, back: boolean, x: number, y: number): LightmapSurface => ({
    ...{ node: 0, copy, primitive: 0, back, charts: CHARTS },
    rectangles: [{ page: 0, x, y }],
  });
  const both: LightmapLayout = {
    ...nothing,
    // The back's lumels lie in the last tile. Without copies, the second one is nobody's.
    surfaces: [surface(0, false, 0, 0), surface(0, true, TILE, TILE), surface(1, false, TILE, 0)],
  };
  let layout = both;
  let lightmap: LightmapLight | undefined;
  let now = 0;
  const fields = () => (lightmap ? [lightmap, volume] : [volume]);
  const of = {
    ...session({ fields: [], age: 0 }, [field, volume.field]),
    light: () => ({ fields: fields(), age: 0 }),
  };
  const camera = fromAbove();
  const light = lit(kind === 'fallback' ? 'webgpu' : kind, renderer, of, { scene });
  light.setNode(floors[0], 0);
  const regions = new Map<number, LumelRegion>();
  const rows: Radiance[][] = [];
  for (const step of steps) {
    for (const tiles of [step.tiles, step.slopes]) {
      for (const [tile, { picture, revision, shown = 1 }] of Object.entries(tiles ?? {})) {
        const number = Number(tile);
        const isSlopes = tiles === step.slopes;
        const region = isSlopes ? 4 + number : number;
        regions.set(region, {
          region,
          page: 0,
          ...(isSlopes && { slopes: true }),
          min: [(number % 2) * TILE, Math.floor(number / 2) * TILE],
          size: [TILE, TILE],
          revision,
          shown,
          picture: pictureOf(picture),
        });
      }
    }
    const all = [...regions.values()];
    const scale = Math.max(...all.filter(({ slopes }) => !slopes).map(({ picture }) => picture.scale));
    if (step.named !== undefined) layout = step.named ? both : nothing;
    if (all.length > 0)
      lightmap = {
        ...{ kind: 'lightmap', field, layout, regions: all, scale },
        ...{ age: 0, tick: 1, sceneVersion: 1 },
      };
    Object.assign(light.strengths, step.strengths);
    if (step.preExposure !== undefined) light.preExposure = step.preExposure;
    if (step.show) light.show = step.show;
    if (step.look) light.look = step.look;
    if (step.moved !== undefined) floors[0].position.z = step.moved;
    if (step.turned !== undefined) {
      camera.position.y = step.turned ? -5 : 5;
      camera.lookAt(0, 0, 0);
      camera.updateMatrixWorld();
    }
    // What has moved is known by its matrix, which is the last picture's.
    scene.updateMatrixWorld();
    light.update(camera, (now += step.after ?? 1000 / 60));
    rows.push(await middleRow(renderer, scene, camera));
  }
  light.dispose();
  rows.push(await middleRow(renderer, scene, camera));
  renderer.dispose();
  return rows;
}

/** The floor's two triangles on a square: the middles of its outermost lumels are its corners. */
const CHARTS: Charts = {
  sizes: [[TILE, TILE]],
  sources: new Uint32Array([0, 1, 2, 3]),
  rectangle: new Uint32Array(4),
  // Both coordinates grow along x alone: the middle row then goes from the first lumel to the last.
  at: new Float32Array([0.5, 0.5, TILE - 0.5, TILE - 0.5, 0.5, 0.5, TILE - 0.5, TILE - 0.5]),
  triangles: new Int32Array([0, 2, 1, 2, 3, 1]),
};

function pictureOf(picture: Picture): LumelPicture {
  const { scale } = picture;
  if (picture.kind === 'halves') {
    const texels = picture.irradiance.flatMap((rgb) => [...rgb.map((value) => value / scale), 1]);
    return { kind: 'halves', scale, texels: Uint16Array.from(texels, halfBits) };
  }
  const { toe, octaves, chroma, y, co, cg } = picture;
  const planes = { y: Uint8Array.from(y), co: Uint8Array.from(co), cg: Uint8Array.from(cg) };
  const sizes = { width: TILE, height: TILE, chromaWidth: chroma, chromaHeight: chroma };
  return { kind: 'planes', scale, toe, octaves, ...planes, ...sizes };
}
