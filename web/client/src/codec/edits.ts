import type {
  Edit,
  Environment,
  InstanceSource,
  Light,
  LightSpec,
  MaterialChange,
  Transform,
  Vec3,
} from '../edit.js';
import { WireError } from '../wire-error.js';
import {
  isObject,
  type Json,
  label,
  object,
  shown,
  single,
  text,
  usable,
  vec3,
  vec4,
  whole,
} from './json.js';
import { LIMITS } from './limits.js';

/** Reads one member, or throws a {@link WireError}. */
type Read<T> = (value: unknown, what: string) => T;
type Readers<T> = { readonly [K in keyof T]-?: Read<NonNullable<T[K]>> };

const real: Read<number> = (value, what) => single(value, what);
const id: Read<number> = (value, what) => whole(value, what, 0xffff_ffff);
const vector: Read<Vec3> = (value, what) => vec3(value, what, real);
const flag: Read<boolean> = (value, what) => {
  if (typeof value !== 'boolean') throw new WireError('malformed', `${what} is not true or false`);
  return value;
};

/** Those members of `json` that there are, each by its reader; what has no reader is left out. */
function some<T>(json: Json, readers: Readers<T>): T {
  const found: Record<string, unknown> = {};
  for (const [name, read] of Object.entries(readers) as [string, Read<unknown>][]) {
    const value = json[name];
    if (value !== undefined && value !== null) found[name] = read(value, name);
  }
  return found as T;
}

const transformParts: Readers<Transform> = { translation: vector, rotation: vec4, scale: vector };
const transform: Read<Transform> = (value, what) => some<Transform>(object(value, what), transformParts);
const lightParts: Readers<Pick<LightSpec, 'color' | 'intensity' | 'range'>> = {
  color: vector,
  intensity: real,
  range: real,
};
const coneParts = { inner: real, outer: real };
const radiusPart = { radius: real };
const anglePart = { angle: real };

const light: Read<Light> = (value, what) => {
  const json = object(value, what);
  const parts = some(json, lightParts);
  switch (json.type) {
    case 'point':
      return { type: 'point', ...some(json, radiusPart), ...parts };
    case 'directional':
      return { type: 'directional', ...some(json, anglePart), ...parts };
    case 'spot':
      return {
        type: 'spot',
        inner: real(json.inner, 'inner'),
        outer: real(json.outer, 'outer'),
        ...some(json, radiusPart),
        ...parts,
      };
    default:
      throw new WireError('malformed', `a light of type ${shown(json.type)}`);
  }
};

const source: Read<InstanceSource> = (value, what) => {
  const json = object(value, what);
  if (json.mesh !== undefined) return { mesh: id(json.mesh, 'mesh') };
  return { file: text(json.file, 'file') };
};

const environment: Read<Environment> = (value, what) => {
  const json = object(value, what);
  switch (json.type) {
    case 'constant':
      return { type: 'constant', radiance: vector(json.radiance, 'radiance') };
    case 'sky':
      return {
        type: 'sky',
        zenith: vector(json.zenith, 'zenith'),
        horizon: vector(json.horizon, 'horizon'),
        ground: vector(json.ground, 'ground'),
      };
    case 'image':
      return {
        type: 'image',
        uri: text(json.uri, 'uri'),
        ...some(json, { intensity: real, rotation: real }),
      };
    default:
      throw new WireError('malformed', `an environment of type ${shown(json.type)}`);
  }
};

const materialParts: Readers<MaterialChange> = {
  base_color: vec4,
  metallic: real,
  roughness: real,
  emissive: vector,
  transmission: real,
  ior: real,
  specular: real,
  specular_color: vector,
  normal_scale: real,
  alpha_cutoff: real,
};

const name: Read<string> = (value, what) => {
  if (value === '') throw new WireError('malformed', `${what} is empty`);
  return label(value, what, LIMITS.nameBytes);
};

const created = { node: id, name, parent: id, transform };
const node = (json: Json) => id(json.node, 'node');

/** How each edit is read. */
const EDITS: { readonly [name: string]: (json: Json) => Edit } = {
  move_node: (json) => ({ edit: 'move_node', node: node(json), ...some(json, transformParts) }),
  add_instance: (json) => ({
    edit: 'add_instance',
    source: source(json.source, 'source'),
    ...some(json, created),
  }),
  remove_node: (json) => ({ edit: 'remove_node', node: node(json) }),
  add_light: (json) => ({ edit: 'add_light', light: light(json.light, 'light'), ...some(json, created) }),
  set_light: (json) => ({
    edit: 'set_light',
    node: node(json),
    ...some(json, { ...lightParts, ...coneParts, ...radiusPart, ...anglePart }),
  }),
  remove_light: (json) => ({ edit: 'remove_light', node: node(json) }),
  set_material: (json) => ({
    edit: 'set_material',
    material: id(json.material, 'material'),
    ...some(json, materialParts),
  }),
  set_animation: (json) => ({
    edit: 'set_animation',
    animation: id(json.animation, 'animation'),
    ...some(json, { playing: flag, time: real, speed: real }),
  }),
  set_environment: (json) => ({
    edit: 'set_environment',
    environment: environment(json.environment, 'environment'),
  }),
};

/** Reads an edit; `undefined` when it is none that this client knows, which is to be skipped. */
export function parseEdit(value: unknown): Edit | undefined {
  if (!isObject(value) || typeof value.edit !== 'string' || !Object.hasOwn(EDITS, value.edit))
    return undefined;
  const read = EDITS[value.edit];
  return usable(() => read(value));
}
