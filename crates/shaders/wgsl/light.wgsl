// Punctual lights, exactly as KHR_lights_punctual states them, and their shadows.

struct Light {
    position: vec3f,
    // 0: point, 1: spot, 2: directional.
    kind: u32,
    // Along which it shines, unit.
    direction: vec3f,
    // Radius of its sphere, metres; of a directional light the tangent of half its angle.
    size: f32,
    // Candela, or lux.
    intensity: vec3f,
    // 1/range⁴; 0 where the range is infinite.
    window: f32,
    // The spot's falloff is clamp(cos·scale + offset)².
    cone_scale: f32,
    cone_offset: f32,
    // Its shadow views.
    first_shadow: u32,
    shadow_count: u32,
}

// A shadow map: one layer of the array.
struct ShadowView {
    clip_from_world: mat4x4f,
    // Of a perspective view from a light its texel at a distance of one metre; else its texel,
    // metres.
    texel: f32,
    // Distance that a clip depth stands for: near/depth in perspective, near + (1 − depth)·depth_range
    // where rays are parallel.
    near: f32,
    depth_range: f32,
    // How far this view reaches, in clip units, before the next cascade takes over.
    reach: f32,
    // Half the widest edge that is looked for, metres.
    search: f32,
    _pad0: f32,
    _pad1: f32,
    _pad2: f32,
}

struct Frame {
    light_count: u32,
    // Bits, see PART_*.
    parts: u32,
    // Samples of a shadow's edge, and of the search for what casts it.
    filter_samples: u32,
    search_samples: u32,
    pre_exposure: f32,
    // Samples of a pixel in the target.
    sample_count: u32,
    // How far maps and edges soften a light without a size, texels.
    filter_radius: f32,
    frame: u32,
    // Of ambient occlusion, metres.
    occlusion_radius: f32,
    _pad0: u32,
    _pad1: u32,
    _pad2: u32,
}

// Which light is drawn.
const PART_EMISSION: u32 = 1u;
const PART_DIRECT: u32 = 2u;
const PART_INDIRECT: u32 = 4u;

@group(1) @binding(0) var<uniform> frame: Frame;
@group(1) @binding(1) var<uniform> environment: Environment;
@group(1) @binding(2) var environment_picture: texture_2d<f32>;
@group(1) @binding(3) var<storage, read> lights: array<Light>;
@group(1) @binding(4) var<storage, read> shadow_views: array<ShadowView>;
@group(1) @binding(5) var shadow_maps: texture_depth_2d_array;
@group(1) @binding(6) var shadow_sampler: sampler_comparison;
// By cosine and roughness: on its left half what F0 and F90 are multiplied by, and the lobe's mean
// direction; on its right the lobe's bands.
@group(1) @binding(7) var environment_brdf: texture_2d<f32>;
@group(1) @binding(8) var table_sampler: sampler;
// Ambient occlusion: the share of indirect light that arrives, and the depths that it is of.
@group(1) @binding(9) var occlusion_visibility: texture_2d<f32>;
@group(1) @binding(10) var occlusion_depths: texture_depth_2d;

// Light arriving from a punctual light, were nothing in between.
struct Incident {
    // Towards the light, unit.
    direction: vec3f,
    // Metres.
    distance: f32,
    // On a surface that faces the light, lux.
    irradiance: vec3f,
}

fn incident(light: Light, at: vec3f) -> Incident {
    if light.kind == 2u {
        return Incident(-light.direction, 0.0, light.intensity);
    }
    let to_light = light.position - at;
    let distance = length(to_light);
    if distance == 0.0 {
        return Incident(vec3f(0.0, 1.0, 0.0), 0.0, vec3f(0.0));
    }
    let direction = to_light / distance;
    let square = distance * distance;
    var falloff = saturate(1.0 - square * square * light.window);
    if light.kind == 1u {
        let t = saturate(dot(direction, -light.direction) * light.cone_scale + light.cone_offset);
        falloff *= t * t;
    }
    // Within the sphere it is as bright as on it.
    let outside = max(distance, light.size);
    return Incident(direction, distance, light.intensity * (falloff / outside / outside));
}

const NO_VIEW: u32 = 0xffffffffu;

// Which of a light's views sees a point, counted from its first: the face of a point light's cube that
// it lies in, the first cascade that reaches it.
fn shadow_view_of(light: Light, point: vec3f) -> u32 {
    if light.shadow_count == 6u && light.kind != 2u {
        let d = point - light.position;
        let a = abs(d);
        if a.x >= a.y && a.x >= a.z {
            return select(1u, 0u, d.x > 0.0);
        }
        if a.y >= a.z {
            return select(3u, 2u, d.y > 0.0);
        }
        return select(5u, 4u, d.z > 0.0);
    }
    if light.kind != 2u {
        return 0u;
    }
    for (var i = 0u; i < light.shadow_count; i++) {
        let shadow = shadow_views[light.first_shadow + i];
        let clip = shadow.clip_from_world * vec4f(point, 1.0);
        if max(abs(clip.x), abs(clip.y)) < shadow.reach {
            return i;
        }
    }
    return NO_VIEW;
}

// Where a point lies in a map: texture coordinates, depth, and the clip w.
fn in_map(shadow: ShadowView, point: vec3f) -> vec4f {
    let clip = shadow.clip_from_world * vec4f(point, 1.0);
    let w = max(clip.w, 1e-6);
    return vec4f(0.5 + 0.5 * clip.x / w, 0.5 - 0.5 * clip.y / w, clip.z / w, w);
}

// Point i of n on a disc, evenly spread (Vogel 1979).
fn disc_point(i: u32, n: u32, turn: f32) -> vec2f {
    let radius = sqrt((f32(i) + 0.5) / f32(n));
    let angle = TAU * turn + 2.3999632 * f32(i);
    return radius * vec2f(cos(angle), sin(angle));
}

// Share of a light that reaches a point of a surface with the given geometric normal, 0 to 1.
//
// Percentage-closer soft shadows (Fernando 2005): how far what casts the shadow is from the point
// tells how wide the edge is; the edge is then filtered (Reeves et al. 1987). Samples lie in the
// surface's own plane rather than across the light's direction, so that a surface does not shadow
// itself however wide the edge.
fn visibility(light: Light, l: vec3f, distance: f32, position: vec3f, normal: vec3f, turn: f32) -> f32 {
    if light.shadow_count == 0u {
        return 1.0;
    }
    let index = shadow_view_of(light, position);
    if index == NO_VIEW {
        return 1.0;
    }
    let shadow = shadow_views[light.first_shadow + index];
    let parallel = light.kind == 2u;
    let facing = dot(normal, l);
    // What lies at the back of a surface is shadowed by it; coarse meshes are lit a little beyond.
    let cosine = max(facing, 0.05);
    let sine = sqrt(max(1.0 - cosine * cosine, 0.0));
    let texel = shadow.texel * select(distance, 1.0, parallel);
    // A texel stands for a piece of the surface of its own size.
    let start = position + normal * (texel * (0.5 + 1.5 * sine));
    let x = tangent_of(l);
    let y = cross(l, x);
    // How much depth the plane gains along x and y.
    let slope = clamp(vec2f(dot(normal, x), dot(normal, y)) / cosine, vec2f(-8.0), vec2f(8.0));

    var radius = frame.filter_radius * texel;
    if light.size > 0.0 && frame.search_samples > 0u {
        let search = max(shadow.search, radius);
        var sum = 0.0;
        var found = 0.0;
        for (var i = 0u; i < frame.search_samples; i++) {
            // More of them near the middle, where they count whatever casts the shadow.
            let toward = disc_point(i, frame.search_samples, turn);
            let o = search * length(toward) * toward;
            let point = start + o.x * x + o.y * y - l * dot(slope, o);
            var own = index;
            if !parallel {
                own = shadow_view_of(light, point);
            }
            let map = shadow_views[light.first_shadow + own];
            let at = in_map(map, point);
            let size = vec2f(textureDimensions(shadow_maps));
            let texel_at = clamp(vec2i(at.xy * size), vec2i(0), vec2i(size) - 1);
            let depth = textureLoad(shadow_maps, texel_at, i32(light.first_shadow + own), 0);
            // How far from the light what is there lies, as a share of this point's distance; in
            // parallel light, how many metres before the point.
            let place = select(map.near / depth / at.w, (depth - at.z) * map.depth_range, parallel);
            // Only what lies between the point and the light's disc casts a shadow here.
            let reach = light.size * select((1.0 - place) / max(place, 1e-3), place, parallel);
            if depth > at.z && length(o) <= reach + texel {
                sum += place;
                found += 1.0;
            }
        }
        // Where nothing was found the light is seen, or what hides it is too near to have been met.
        if found > 0.0 {
            let mean = sum / found;
            let penumbra = select(light.size * (1.0 - mean) / max(mean, 0.05), light.size * mean, parallel);
            radius = max(radius, penumbra);
        }
    }

    var lit = 0.0;
    for (var i = 0u; i < frame.filter_samples; i++) {
        let o = radius * disc_point(i, frame.filter_samples, turn);
        let point = start + o.x * x + o.y * y - l * dot(slope, o);
        var own = index;
        if !parallel {
            own = shadow_view_of(light, point);
        }
        let at = in_map(shadow_views[light.first_shadow + own], point);
        lit += textureSampleCompareLevel(shadow_maps, shadow_sampler, at.xy, i32(light.first_shadow + own), at.z);
    }
    return lit / f32(frame.filter_samples);
}
