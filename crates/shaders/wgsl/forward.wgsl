// Draws surfaces: direct light of punctual lights, indirect light of the field, emission.

struct Vertex {
    @location(0) position: vec3f,
    @location(1) normal: vec3f,
    @location(2) tangent: vec4f,
    @location(3) uv0: vec2f,
    @location(4) uv1: vec2f,
    @location(5) color: vec4f,
    @builtin(instance_index) instance: u32,
}

struct Varying {
    @builtin(position) @invariant clip: vec4f,
    @location(0) @interpolate(perspective, center) position: vec3f,
    @location(1) @interpolate(perspective, center) normal: vec3f,
    @location(2) @interpolate(perspective, center) tangent: vec4f,
    @location(3) @interpolate(perspective, center) uv: vec4f,
    @location(4) @interpolate(perspective, center) color: vec4f,
    @location(5) @interpolate(flat) instance: u32,
    // 1 at every vertex. Lavapipe (Mesa 25.0) interpolates a sample's attributes over the depth of the
    // sample but divides by the depth of the pixel's middle: what this has become tells by how much
    // the others are wrong, up to some parts in a hundred where surfaces are seen at an angle.
    @location(6) @interpolate(perspective, center) one: f32,
}

@vertex
fn forward_vertex(in: Vertex) -> Varying {
    let index = visible[in.instance];
    var out: Varying;
    out.position = transform_point(instances[index].world_from_object, in.position);
    out.clip = view.clip_from_world * vec4f(out.position, 1.0);
    // In object space, as the tracer interpolates them.
    out.normal = in.normal;
    out.tangent = in.tangent;
    out.uv = vec4f(in.uv0, in.uv1);
    out.color = in.color;
    out.instance = index;
    out.one = 1.0;
    return out;
}

// The shading normal on the viewer's side, bent as little as makes it face the viewer
// (`gather::surface`).
fn visible_normal(shading: vec3f, geometric: vec3f, v: vec3f) -> vec3f {
    const LEAST: f32 = 1e-3;
    if dot(shading, shading) == 0.0 {
        return geometric;
    }
    let n = normalize(select(shading, -shading, dot(shading, geometric) < 0.0));
    let cosine = dot(n, v);
    if cosine >= LEAST {
        return n;
    }
    return normalize(n + (2.0 * LEAST - cosine) * v);
}

// Interleaved gradient noise (Jimenez 2014): a value a pixel, well spread among neighbours.
fn pattern(pixel: vec2f) -> f32 {
    return fract(52.9829189 * fract(dot(floor(pixel), vec2f(0.06711056, 0.00583715))) + view.turn);
}

// Whether blended surfaces are mixed with what lies behind them, which then has to be drawn before.
override BLENDED: bool = false;
// Whether there is ambient occlusion in screen space.
override OCCLUDED: bool = false;

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
    // By how much depth changes from a pixel to the next.
    slopes: vec2f,
    base_color: vec4f,
    substance: Substance,
    emission: vec3f,
    occlusion: f32,
    tangent_normal: vec3f,
}

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
fn solid_fragment(
    in: Varying,
    @builtin(front_facing) faces_front: bool,
    /*SAMPLE*/
) -> @location(0) vec4f {
    let p = point_at(in);
    let radiance = radiance_of(in, p, faces_front, pattern(in.clip.xy)/*ITS TURN*/);
    return vec4f(radiance * frame.pre_exposure, 1.0);
}

// Surfaces with holes, and those that cover in part.
@fragment
fn holed_fragment(
    in: Varying,
    @builtin(front_facing) faces_front: bool,
    /*SAMPLE*/
) -> Shaded {
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
            let side = select(0u, 1u, faces_front);
            out.coverage = covered(alpha, in.clip.xy, hash(in.instance + hash(2u * depth + side)));
            if out.coverage == 0u {
                discard;
            }
            alpha = 1.0;
        }
    }
    let radiance = radiance_of(in, p, faces_front, pattern(in.clip.xy)/*ITS TURN*/);
    out.color = vec4f(radiance * frame.pre_exposure * alpha, alpha);
    return out;
}

// What a point sends to the eye; `turn`: of the pattern of a shadow's samples.
fn radiance_of(in: Varying, p: Point, faces_front: bool, turn: f32) -> vec3f {
    let plain = (material.flags & MATERIAL_LAMBERT) != 0u;
    var occlusion = p.occlusion;
    let front = faces_front != (instances[in.instance].mirrors == 1u);
    let v = towards_eye(p.position);
    // Of the side that is seen.
    var geometric = v;
    if dot(p.geometry, p.geometry) > 0.0 {
        geometric = normalize(p.geometry);
        geometric = select(geometric, -geometric, dot(geometric, v) < 0.0);
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
        let n0 = normalize_or_zero(in.normal);
        var object_normal = n0;
        if is_there(material.normal_map) && !plain && dot(in.tangent.xyz, in.tangent.xyz) > 0.0 {
            let bitangent = cross(n0, in.tangent.xyz) * sign(in.tangent.w);
            object_normal = p.tangent_normal.x * in.tangent.xyz + p.tangent_normal.y * bitangent + p.tangent_normal.z * n0;
        }
        let shading = transform_vector(instances[in.instance].normal_from_object, object_normal);
        let n = visible_normal(shading, geometric, v);
        var b = bsdf_of(p.substance);
        if plain {
            b = lambert(p.substance.base_color);
            occlusion = 1.0;
        }
        if (frame.parts & PART_DIRECT) != 0u {
            radiance += direct_light(b, n, v, p.position, geometric, turn);
        }
        if (frame.parts & PART_INDIRECT) != 0u {
            var visible = 1.0;
            if OCCLUDED {
                visible = ambient_visibility(in.clip, p.slopes);
            }
            radiance += indirect_light(b, n, v, p.position, p.substance.roughness, occlusion, visible);
        }
    }
    return radiance;
}

fn normalize_or_zero(v: vec3f) -> vec3f {
    let square = dot(v, v);
    return select(vec3f(0.0), v * inverseSqrt(max(square, 1e-38)), square > 0.0);
}

// Light of punctual lights scattered once.
fn direct_light(b: Bsdf, n: vec3f, v: vec3f, position: vec3f, geometric: vec3f, turn: f32) -> vec3f {
    var sum = vec3f(0.0);
    for (var i = 0u; i < frame.light_count; i++) {
        let arriving = incident(i, position);
        let scattered_light = scattered(b, n, v, arriving.direction) * arriving.irradiance;
        if max(max(scattered_light.x, scattered_light.y), scattered_light.z) > 0.0 {
            // Light through a thin surface arrives at its other side.
            let side = select(geometric, -geometric, dot(n, arriving.direction) < 0.0);
            sum += scattered_light * visibility(i, arriving.direction, arriving.distance, position, side, turn);
        }
    }
    return sum;
}

// Light of the field, chapter 4.2.2 of the second paper: diffuse by convolution with its lobe, specular by
// the split sum, the mean radiance under the lobe times the environment BRDF. Light through a thin surface
// comes from the mirror image of that lobe. The material's occlusion is of the side that is seen: light
// from behind it leaves alone. So is `visible`, what ambient occlusion leaves; both tell of the same
// crevices, of which each counts once.
fn indirect_light(
    b: Bsdf, n: vec3f, v: vec3f, position: vec3f, roughness: f32, occlusion: f32, visible: f32,
) -> vec3f {
    let n_v = dot(n, v);
    let table = table_at(n_v, roughness);
    let by = textureSampleLevel(environment_brdf, table_sampler, table, 0.0);
    let toward = mean_direction(n, v, by.zw);
    let bands = specular_bands(length(by.zw), table);
    let light = field_light(position, n, lobe(n, diffuse_bands(b)), lobe(toward, bands));
    let under = 1.0 - reflectance(b, n_v);
    var of_diffuse = vec3f(occlusion);
    var of_specular = occlusion;
    if OCCLUDED {
        of_diffuse = min(of_diffuse, many_bounces(visible, b.diffuse));
        of_specular = min(of_specular, visible);
    }
    var sum = b.diffuse * under * of_diffuse * light.a / PI;
    sum += (b.f0 * by.x + b.f90 * by.y) * specular_occlusion(n_v, of_specular, b.alpha) * light.b;
    if any(b.transmission > vec3f(0.0)) {
        let through = lobe(reflect(toward, n), bands);
        let behind = field_light(position, -n, through, through);
        let share = (1.0 - b.dielectric_f0) * by.x + (1.0 - b.dielectric_f90) * by.y;
        sum += b.transmission * share * behind.a;
    }
    return sum;
}

// The diffuse lobe's share of light by its direction, `coupling` times the clamped cosine, as multipliers of
// bands, times what the direction of sight leaves: exact for light of any order. Schlick's term has the
// bands 2π ∫ c (1 − c)⁵ P_l(c) dc over 0 ≤ c ≤ 1.
fn diffuse_bands(b: Bsdf) -> Bands {
    let grazing = b.dielectric_f90 - b.dielectric_f0;
    let mean = b.dielectric_f0 + grazing / 21.0;
    if mean >= 1.0 {
        return Bands();
    }
    let straight = (1.0 - b.dielectric_f0) / (1.0 - mean);
    let lost = grazing / (1.0 - mean);
    let cosine = cosine_bands();
    return Bands(
        straight * cosine.b0 - lost * 0.14959965,
        straight * cosine.b1 - lost * 0.037399913,
        straight * cosine.b2 + lost * 0.05609987,
        lost * 0.043633231,
        straight * cosine.b4 - lost * 0.019266622,
    );
}

// The direction about which the specular lobe is round, its mean, of which the parts along the mirrored
// direction and across it are given.
fn mean_direction(n: vec3f, v: vec3f, mean: vec2f) -> vec3f {
    let mirrored = reflect(-v, n);
    let across = n - dot(n, mirrored) * mirrored;
    return normalize(mean.x * mirrored + mean.y * across * inverseSqrt(max(dot(across, across), 1e-8)));
}

// The specular lobe's bands, of which 1 is the length of its mean.
fn specular_bands(length_of_mean: f32, table: vec2f) -> Bands {
    let higher = textureSampleLevel(environment_brdf, table_sampler, table + vec2f(0.5, 0.0), 0.0);
    return Bands(1.0, length_of_mean, higher.x, higher.y, higher.z);
}

// What ambient occlusion leaves of the light at a place of the picture whose depth changes so much from
// a pixel to the next. Where the pixel shows another surface, those beside it are asked: so edges between
// samples of a pixel have no seams, and blended surfaces, of which no depth was drawn, are left alone.
fn ambient_visibility(at: vec4f, slopes: vec2f) -> f32 {
    let pixel = vec2i(at.xy);
    if depth_share(pixel, at, slopes, frame.occlusion_radius) > 0.0 {
        return textureLoad(occlusion_visibility, pixel, 0).r;
    }
    var sum = 0.0;
    var weights = 0.0;
    for (var i = 0; i < 9; i++) {
        let beside = pixel + vec2i(i % 3 - 1, i / 3 - 1);
        // Surfaces bend: now what lies within the radius will do, the more the nearer it is.
        let share = depth_share(beside, at, slopes, 8.0 * frame.occlusion_radius);
        let weight = share * share;
        if weight > 0.0 {
            sum += weight * textureLoad(occlusion_visibility, beside, 0).r;
            weights += weight;
        }
    }
    return select(1.0, sum / weights, weights > 0.0);
}

fn depth_share(pixel: vec2i, at: vec4f, slopes: vec2f, radius: f32) -> f32 {
    if any(pixel < vec2i(0)) || any(pixel >= vec2i(textureDimensions(occlusion_depths))) {
        return 0.0;
    }
    let expected = at.z + dot(slopes, vec2f(pixel) + 0.5 - at.xy);
    return same_surface(textureLoad(occlusion_depths, pixel, 0), expected, radius);
}

// The share of light that arrives at a place of which so much is visible, when what hides it has the
// same albedo and scatters light itself: the fit of Jiménez et al. 2016.
fn many_bounces(visible: f32, albedo: vec3f) -> vec3f {
    let a = 2.0404 * albedo - 0.3324;
    let b = -4.7951 * albedo + 0.6417;
    let c = 2.7552 * albedo + 0.6903;
    return clamp(((visible * a + b) * visible + c) * visible, vec3f(visible), vec3f(1.0));
}

// What occlusion leaves of the specular lobe: of a smooth surface seen from above more than of the
// diffuse one, at grazing angles less. An empirical formula, Lagarde and de Rousiers 2014 ("Moving
// Frostbite to PBR"), of α; three.js puts perceptual roughness there. 1 where nothing is occluded.
fn specular_occlusion(n_v: f32, occlusion: f32, alpha: f32) -> f32 {
    return saturate(pow(n_v + occlusion, exp2(-16.0 * alpha - 1.0)) - 1.0 + occlusion);
}

// Where the left half of the table has a cosine and a roughness: its outermost texels stand for 0 and 1.
fn table_at(cosine: f32, roughness: f32) -> vec2f {
    let side = f32(textureDimensions(environment_brdf).y);
    return (saturate(vec2f(cosine, roughness)) * (side - 1.0) + 0.5) / side * vec2f(0.5, 1.0);
}
