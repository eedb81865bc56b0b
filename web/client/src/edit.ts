/**
 * Edits of a scene as plain data: the twin of `lumencast_scene::Edit`, checked against
 * `vectors/edits.json` by both languages.
 *
 * Space is glTF's: right-handed, +Y up, metres. Colours are linear Rec. 709. Parts left out stay as
 * they are. Where an edit creates a node, leave `node` out: the server fills it in.
 */

export type Vec3 = [x: number, y: number, z: number];
export type Vec4 = [x: number, y: number, z: number, w: number];

/** Parts of a local transform: parent_from_node = translation · rotation · scale. */
export interface Transform {
  /** Metres. */
  translation?: Vec3;
  /** Quaternion x, y, z, w; normalised by the server, refused when its length is near zero. */
  rotation?: Vec4;
  /** Factors along the node's axes, none of them zero. */
  scale?: Vec3;
}

/** A punctual light as in KHR_lights_punctual. It shines along its node's −Z. */
export type Light = (
  | {
      type: 'point';
      /** Of the sphere that shines, metres; a point when absent. */
      radius?: number;
    }
  | {
      type: 'spot';
      /** Half-angle where falloff begins, radians, 0 ≤ inner < outer. */
      inner: number;
      /** Half-angle where the light ends, radians, at most π/2. */
      outer: number;
      /** Of the sphere that shines, metres; a point when absent. */
      radius?: number;
    }
  | {
      type: 'directional';
      /** Angle that the shining disc spans, radians, at most π; parallel light when absent. */
      angle?: number;
    }
) & {
  /** Linear colour, each channel ≥ 0; white when absent. */
  color?: Vec3;
  /** Candela (point, spot) or lux on a surface that faces it (directional), ≥ 0; 1 when absent. */
  intensity?: number;
  /** Distance in metres past which the light is cut off smoothly; infinite when absent. */
  range?: number;
};

/** Parts of a light; see {@link Light} for units and ranges. */
export interface LightSpec {
  color?: Vec3;
  intensity?: number;
  range?: number;
  /** Spot lights only. */
  inner?: number;
  /** Spot lights only. */
  outer?: number;
  /** Point and spot lights only. */
  radius?: number;
  /** Directional lights only. */
  angle?: number;
}

/** Factors of a material. */
export interface MaterialChange {
  /** Linear base colour and opacity. */
  base_color?: Vec4;
  /** 0 to 1. */
  metallic?: number;
  /** 0 to 1. */
  roughness?: number;
  /** Emitted radiance, cd/m². */
  emissive?: Vec3;
  /** 0 to 1. */
  transmission?: number;
  /** Index of refraction, 1 or more; 0 means infinite. */
  ior?: number;
  /** 0 to 1. */
  specular?: number;
  /** Linear, each channel 0 to 10⁹. */
  specular_color?: Vec3;
  /** Below 0 turns the normal map's x and y around. */
  normal_scale?: number;
  /** Masked materials only: 0 or more; above 1 nothing is covered. */
  alpha_cutoff?: number;
}

/** Playback of an animation. */
export interface Playback {
  /** Runs or stands. */
  playing?: boolean;
  /** Jumps to this time of the animation, seconds. */
  time?: number;
  /** Rate, 1 unless set; negative runs backwards. */
  speed?: number;
}

/** Radiance (cd/m²) from infinitely far, as a function of direction. */
export type Environment =
  | { type: 'constant'; radiance: Vec3 }
  /** Linear in sin(elevation) from horizon to zenith above, and from horizon to ground below. */
  | { type: 'sky'; zenith: Vec3; horizon: Vec3; ground: Vec3 }
  /** An equirectangular HDR picture in the scene's folder, turned about +Y by `rotation` radians. */
  | { type: 'image'; uri: string; intensity?: number; rotation?: number };

/** What an added instance shows: a mesh of the scene, or a glTF file that the server may read. */
export type InstanceSource = { mesh: number } | { file: string };

/** The node that an edit adds. */
export interface AddedNode {
  /** Its number, which the server fills in. */
  node?: number;
  /** 1 to 64 bytes of UTF-8 without control characters. */
  name?: string;
  /** The scene's root when absent. */
  parent?: number;
  transform?: Transform;
}

/** A change of the scene, applied whole or refused with a reason, in the server's order. */
export type Edit =
  | ({ edit: 'move_node'; node: number } & Transform)
  | ({ edit: 'add_instance'; source: InstanceSource } & AddedNode)
  | { edit: 'remove_node'; node: number }
  | ({ edit: 'add_light'; light: Light } & AddedNode)
  | ({ edit: 'set_light'; node: number } & LightSpec)
  | { edit: 'remove_light'; node: number }
  | ({ edit: 'set_material'; material: number } & MaterialChange)
  | ({ edit: 'set_animation'; animation: number } & Playback)
  | { edit: 'set_environment'; environment: Environment };
