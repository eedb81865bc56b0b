// Draws surfaces: direct light of punctual lights, indirect light of the field, emission. `Varying`,
// `Facing` and `turn_of` are those of `shade/by_pixels` or `shade/by_samples`: who draws chooses.

#import common/math
#import shade/ambient
#import shade/direct
#import shade/frame
#import shade/frame_bindings
#import shade/indirect
#import shade/look
#import shade/lumels
#import shade/pass_bindings
#import shade/sampling
#import shade/sight
#import surface/bindings
#import surface/bsdf
#import surface/material
#import surface/site
#import surface/textures

struct Vertex {
    @location(0) position: vec3f,
    @location(1) normal: vec3f,
    @location(2) tangent: vec4f,
    @location(3) uv0: vec2f,
    @location(4) uv1: vec2f,
    @location(5) color: vec4f,
    @location(6) lumels: vec4f,
    @location(7) rectangles: vec2u,
    @builtin(instance_index) instance: u32,
}

@vertex
fn forward_vertex(in: Vertex) -> Varying {
    let index = visible[in.instance];
    var out: Varying;
    out.position = transform_point(instances[index].world_from_object, in.position);
    out.clip = view.clip_from_world * vec4f(out.position, 1.0);
    // They stay in object space, where the tracer interpolates them.
    out.normal = in.normal;
    out.tangent = in.tangent;
    out.uv = vec4f(in.uv0, in.uv1);
    out.color = in.color;
    out.instance = index;
    out.one = 1.0;
    out.lumels = in.lumels;
    let own = in.rectangles + instances[index].lumels;
    out.rectangles = select(own, vec2u(NO_LUMELS), in.rectangles == vec2u(NO_LUMELS));
    return out;
}

// Interleaved gradient noise (Jimenez 2014): a value a pixel, well spread among neighbours.
fn pattern(pixel: vec2f) -> f32 {
    return fract(52.9829189 * fract(dot(floor(pixel), vec2f(0.06711056, 0.00583715))) + view.turn);
}

// Whether blended surfaces are mixed with what lies behind them, which then has to be drawn before.
override BLENDED: bool = false;

struct Shaded {
    @location(0) color: vec4f,
    @builtin(sample_mask) coverage: u32,
}

// The samples that a surface of so much opacity covers: as many as it should on average, others for
// every surface, so that one that lies behind shows through (Enderton et al. 2010).
fn covered(alpha: f32, pixel: vec2f, layer: u32) -> u32 {
    let n = frame.sample_count;
    let key = hash(u32(pixel.x) + hash(u32(pixel.y) + hash(layer + hash(frame.frame))));
    let first = key % n;
    let dither = unit(hash(key));
    var mask = 0u;
    for (var i = 0u; i < n; i++) {
        let threshold = (f32((i + first) % n) + dither) / f32(n);
        mask |= select(0u, 1u << i, threshold < alpha);
    }
    return mask;
}

// What is read at a point before anything is decided, since textures choose their mips by the pixels
// beside.
struct Point {
    position: vec3f,
    // Across the surface, of any length.
    geometry: vec3f,
    // How much depth changes from a pixel to the next.
    slopes: vec2f,
    base_color: vec4f,
    substance: Substance,
    emission: vec3f,
    occlusion: f32,
    tangent_normal: vec3f,
}

// Lavapipe (Mesa 25.0) interpolates a sample's attributes over the depth of the sample but divides by the
// depth of the pixel's middle: what `one` has become tells by how much the others are wrong, up to some
// parts in a hundred where surfaces are seen at an angle.
fn point_at(in: Varying) -> Point {
    var p: Point;
    p.position = in.position / in.one;
    p.geometry = cross(dpdx(p.position), dpdy(p.position));
    p.slopes = vec2f(dpdx(in.clip.z), dpdy(in.clip.z));
    let uv = in.uv / in.one;
    let at = Coordinates(uv.xy, uv.zw);
    p.base_color = base_color_at(at, in.color / in.one);
    p.substance = substance_at(at, p.base_color);
    p.emission = emission_at(at);
    p.occlusion = occlusion_at(at);
    p.tangent_normal = mapped_normal(at);
    return p;
}

// Surfaces that cover all. Nothing here takes samples away, so that what lies behind what has been
// drawn is never shaded.
@fragment
fn solid_fragment(in: Varying, facing: Facing) -> @location(0) vec4f {
    let p = point_at(in);
    let radiance = radiance_of(in, p, facing.front, pattern(in.clip.xy) + turn_of(facing));
    return vec4f(radiance * frame.pre_exposure, 1.0);
}

// Surfaces with holes, and those that cover in part.
@fragment
fn holed_fragment(in: Varying, facing: Facing) -> Shaded {
    let p = point_at(in);
    var out: Shaded;
    out.coverage = 0xffffffffu;
    var alpha = 1.0;
    if p.base_color.a < material.cutoff {
        discard;
    }
    if (material.flags & MATERIAL_BLEND) != 0u {
        alpha = saturate(p.base_color.a);
        if BLENDED {
            if alpha == 0.0 {
                discard;
            }
        } else {
            // Layers of one surface differ in their side, or by a hundredth of their distance.
            let depth = u32(i32(64.0 * log2(in.clip.w)) + 8192);
            let side = select(0u, 1u, facing.front);
            out.coverage = covered(alpha, in.clip.xy, hash(in.instance + hash(2u * depth + side)));
            if out.coverage == 0u {
                discard;
            }
            alpha = 1.0;
        }
    }
    let radiance = radiance_of(in, p, facing.front, pattern(in.clip.xy) + turn_of(facing));
    out.color = vec4f(radiance * frame.pre_exposure * alpha, alpha);
    return out;
}

// The shading normal in world space, of any length; by the normal map where that is wanted.
fn shading_normal(in: Varying, p: Point, by_map: bool) -> vec3f {
    let n = normalize_or_zero(in.normal);
    var object_normal = n;
    let t = in.tangent.xyz;
    if is_there(material.normal_map) && by_map && dot(t, t) > 0.0 {
        let bitangent = cross(n, t) * sign(in.tangent.w);
        object_normal = p.tangent_normal.x * t + p.tangent_normal.y * bitangent + p.tangent_normal.z * n;
    }
    return transform_vector(instances[in.instance].normal_from_object, object_normal);
}

// How bright what one looks into lumels by is shown on surfaces seen edge on: their shapes stay visible.
const EDGE_ON: f32 = 0.6;

// What a point sends to the eye. The pattern of shadow samples is turned by `turn`.
fn radiance_of(in: Varying, p: Point, faces_front: bool, turn: f32) -> vec3f {
    let plain = (material.flags & MATERIAL_LAMBERT) != 0u;
    var occlusion = p.occlusion;
    let front = faces_front != (instances[in.instance].mirrors == 1u);
    let v = towards_eye(p.position);
    // The normal of the side that is seen.
    var geometric = v;
    if dot(p.geometry, p.geometry) > 0.0 {
        geometric = normalize(p.geometry);
        geometric = select(geometric, -geometric, dot(geometric, v) < 0.0);
    }

    let rectangle = select(in.rectangles.y, in.rectangles.x, front);
    let lumels = select(in.lumels.zw, in.lumels.xy, front) / in.one;
    if frame.look != LOOK_LIGHT && rectangle != NO_LUMELS {
        let page = rectangles[rectangle];
        let color = look_color(page.layer, page.corner + lumels);
        return color * mix(EDGE_ON, 1.0, dot(geometric, v)) / frame.pre_exposure;
    }

    var radiance = vec3f(0.0);
    let two_sided = (material.flags & MATERIAL_DOUBLE_SIDED) != 0u;
    let unlit = (material.flags & MATERIAL_UNLIT) != 0u;
    if (frame.parts & PART_EMISSION) != 0u {
        if unlit && !plain {
            radiance += select(vec3f(0.0), saturate(p.base_color.rgb), front || two_sided) / frame.pre_exposure;
        } else if !unlit && (front || (two_sided && !plain)) {
            radiance += p.emission;
        }
    }
    let scatters = plain || (!unlit && (front || two_sided));
    if scatters {
        let shading = shading_normal(in, p, !plain);
        let site = Site(p.position, visible_normal(shading, geometric, v), geometric, v);
        var b = bsdf_of(p.substance);
        if plain {
            b = lambert(p.substance.base_color);
            occlusion = 1.0;
        }
        if (frame.parts & PART_DIRECT) != 0u {
            radiance += direct_light(b, site, turn);
        }
        if (frame.parts & PART_INDIRECT) != 0u {
            var visible = 1.0;
            if OCCLUDED {
                visible = ambient_visibility(in.clip, p.slopes);
            }
            let own = visible_normal(shading_normal(in, p, false), geometric, v);
            let arriving = Lumels(rectangle, lumels, own);
            let strength = select(frame.moving, frame.still, instances[in.instance].still == 1u);
            radiance +=
                strength * indirect_light(b, site, arriving, p.substance.roughness, occlusion, visible);
        }
    }
    return radiance;
}
