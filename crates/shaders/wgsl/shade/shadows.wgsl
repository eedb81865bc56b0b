// Shadows of punctual lights. Lights and maps are told by their number, and of each no more is read than
// is needed.

#import common/punctual
#import common/math
#import shade/frame_bindings

// How far in front of a surface that faces the light shadows are looked up, texels.
const OFF: f32 = 0.125;

const NO_MAP: u32 = 0xffffffffu;

// The map that sees a point, of those of one light: of a point light's cube the face that it lies in, of
// cascades the first that reaches it.
fn map_of(light: u32, point: vec3f) -> u32 {
    let kind = lights[light].kind;
    let first = lights[light].first_shadow;
    let count = lights[light].shadow_count;
    if kind == LIGHT_DIRECTIONAL {
        for (var map = first; map < first + count; map++) {
            let clip = shadow_views[map].clip_from_world * vec4f(point, 1.0);
            if all(abs(clip.xy) < shadow_views[map].reach) {
                return map;
            }
        }
        return NO_MAP;
    }
    if count < 6u {
        return first;
    }
    let d = point - lights[light].position;
    let a = abs(d);
    if a.x >= a.y && a.x >= a.z {
        return first + select(1u, 0u, d.x > 0.0);
    }
    if a.y >= a.z {
        return first + select(3u, 2u, d.y > 0.0);
    }
    return first + select(5u, 4u, d.z > 0.0);
}

// Where a point lies in a map: texture coordinates, depth, and the clip w.
fn in_map(map: u32, point: vec3f) -> vec4f {
    let clip = shadow_views[map].clip_from_world * vec4f(point, 1.0);
    let w = max(clip.w, 1e-6);
    return vec4f(0.5 + 0.5 * clip.x / w, 0.5 - 0.5 * clip.y / w, clip.z / w, w);
}

// Point i of n on a disc, evenly spread (Vogel 1979).
fn disc_point(i: u32, n: u32, turn: f32) -> vec2f {
    let radius = sqrt((f32(i) + 0.5) / f32(n));
    let angle = TAU * turn + 2.3999632 * f32(i);
    return radius * vec2f(cos(angle), sin(angle));
}

// A surface's plane: a point of it, and axes.
struct SurfacePlane {
    start: vec3f,
    u: vec3f,
    v: vec3f,
    // How large a texel is there, metres.
    texel: f32,
}

// What a surface's plane is in a map: depths there are affine in texture coordinates, in perspective
// too.
struct PlaneInMap {
    // Texture coordinates and depth of its point.
    at: vec3f,
    // How depth grows along both texture coordinates.
    gradient: vec2f,
    // Texture coordinates of a metre along each of the plane's axes; in perspective only near the point.
    axes: mat2x2f,
}

// What a surface's plane is in a map, about a point of it.
fn plane_in_map(map: u32, point: vec3f, surface: SurfacePlane) -> PlaneInMap {
    let at = in_map(map, point).xyz;
    let texel = surface.texel;
    let dx = in_map(map, point + texel * surface.u).xyz - at;
    let dy = in_map(map, point + texel * surface.v).xyz - at;
    let area = dx.x * dy.y - dx.y * dy.x;
    let gradient = vec2f(dx.z * dy.y - dy.z * dx.y, dy.z * dx.x - dx.z * dy.x);
    let axes = mat2x2f(dx.xy / texel, dy.xy / texel);
    return PlaneInMap(at, select(vec2f(0.0), gradient / area, area != 0.0), axes);
}

// Share of the four texels about a place that nothing lies before, each compared with the plane's own
// depth at its middle: so a plane does not shadow itself, however low the light stands.
fn filtered(map: u32, plane: PlaneInMap, at: vec2f) -> f32 {
    let size = vec2f(textureDimensions(shadow_maps));
    let place = at * size - 0.5;
    let low = floor(place);
    let part = place - low;
    // Where the four meet, so that it is clear which they are.
    let corner = (low + 1.0) / size;
    let step = plane.gradient / size;
    let depth = plane.at.z + dot(plane.gradient, corner - plane.at.xy);
    // The four are those at the lower left, the lower right, the upper right and the upper left.
    let stored = textureGather(shadow_maps, shadow_sampler, corner, i32(map));
    let own = depth + 0.5 * vec4f(step.y - step.x, step.x + step.y, step.x - step.y, -step.x - step.y);
    let lit = select(vec4f(0.0), vec4f(1.0), stored <= own);
    let rows = mix(lit.wx, lit.zy, part.x);
    return mix(rows.x, rows.y, part.y);
}

// Where a point of a surface's plane is looked up.
struct ShadowSample {
    map: u32,
    plane: PlaneInMap,
    at: vec2f,
}

// Metres `o` along the plane's axes from where it is known in a map.
fn sample_of(light: u32, known: u32, plane: PlaneInMap, surface: SurfacePlane, o: vec2f) -> ShadowSample {
    if lights[light].kind == LIGHT_DIRECTIONAL {
        return ShadowSample(known, plane, plane.at.xy + plane.axes * o);
    }
    let point = surface.start + o.x * surface.u + o.y * surface.v;
    let map = map_of(light, point);
    if map == known {
        return ShadowSample(map, plane, in_map(map, point).xy);
    }
    let other = plane_in_map(map, point, surface);
    return ShadowSample(map, other, other.at.xy);
}

// Share of a light that reaches a point of a surface with the given geometric normal, 0 to 1.
//
// Percentage-closer soft shadows (Fernando 2005): how far what casts the shadow is from the point
// tells how wide the edge is; the edge is then filtered (Reeves et al. 1987). Samples lie in the
// surface's own plane rather than across the light's direction, so that a surface does not shadow
// itself however wide the edge.
fn visibility(light: u32, arriving: Incident, position: vec3f, normal: vec3f, turn: f32) -> f32 {
    if lights[light].shadow_count == 0u {
        return 1.0;
    }
    let map = map_of(light, position);
    if map == NO_MAP {
        return 1.0;
    }
    let parallel = lights[light].kind == LIGHT_DIRECTIONAL;
    let texel = shadow_views[map].texel * select(arriving.distance, 1.0, parallel);
    let surface = shadowed_plane(arriving.direction, position, normal, texel);
    let plane = plane_in_map(map, surface.start, surface);
    let radius = edge_radius(light, map, plane, surface, turn);
    var lit = 0.0;
    for (var i = 0u; i < frame.filter_samples; i++) {
        let o = radius * disc_point(i, frame.filter_samples, turn);
        let s = sample_of(light, map, plane, surface, o);
        lit += filtered(s.map, s.plane, s.at);
    }
    return lit / f32(frame.filter_samples);
}

// The plane of a surface that light comes to along −l, a little in front of the surface. Its axes lie
// across l where they are seen along it.
fn shadowed_plane(l: vec3f, position: vec3f, normal: vec3f, texel: f32) -> SurfacePlane {
    let facing = dot(normal, l);
    // What lies at the back of a surface is shadowed by it; coarse meshes are lit a little beyond.
    let cosine = max(facing, 0.05);
    // Surfaces are not quite planes: within a texel they leave them, the more the lower the light stands.
    let start = position + normal * (texel * OFF / cosine);
    let x = tangent_of(l);
    let y = cross(l, x);
    // How much depth the plane gains along x and y.
    let slope = clamp(vec2f(dot(normal, x), dot(normal, y)) / cosine, vec2f(-8.0), vec2f(8.0));
    return SurfacePlane(start, x - l * slope.x, y - l * slope.y, texel);
}

// How wide the shadow's edge is, metres from its middle. A light with a size is searched for what hides
// it.
fn edge_radius(light: u32, map: u32, plane: PlaneInMap, surface: SurfacePlane, turn: f32) -> f32 {
    let least = frame.filter_radius * surface.texel;
    let light_size = lights[light].size;
    if light_size <= 0.0 || frame.search_samples == 0u {
        return least;
    }
    let parallel = lights[light].kind == LIGHT_DIRECTIONAL;
    let size = vec2f(textureDimensions(shadow_maps));
    let search = max(shadow_views[map].search, least);
    let depth_range = shadow_views[map].depth_range;
    var sum = 0.0;
    var found = 0.0;
    for (var i = 0u; i < frame.search_samples; i++) {
        // More of them near the middle, where they count whatever casts the shadow.
        let toward = disc_point(i, frame.search_samples, turn);
        let o = search * length(toward) * toward;
        let s = sample_of(light, map, plane, surface, o);
        let texel_at = clamp(vec2i(s.at * size), vec2i(0), vec2i(size) - 1);
        let depth = textureLoad(shadow_maps, texel_at, i32(s.map), 0);
        let here = s.plane.at.z + dot(s.plane.gradient, (vec2f(texel_at) + 0.5) / size - s.plane.at.xy);
        // How far from the light what is there lies, as a share of this point's distance; in
        // parallel light, how many metres before the point.
        let place = select(here / depth, (depth - here) * depth_range, parallel);
        // Only what lies between the point and the light's disc casts a shadow here. At a steep angle
        // the surface's plane may reach behind the light within the search.
        let reach = light_size * select((1.0 - place) / max(place, 1e-3), place, parallel);
        if (parallel || here > 0.0) && depth > here && length(o) <= reach + surface.texel {
            sum += place;
            found += 1.0;
        }
    }
    // Where nothing was found the light is seen, or what hides it is too near to have been met.
    if found == 0.0 {
        return least;
    }
    let mean = sum / found;
    let penumbra = select(light_size * (1.0 - mean) / max(mean, 0.05), light_size * mean, parallel);
    return max(least, penumbra);
}
