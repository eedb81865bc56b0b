// The light field: probe volumes in one 3D texture, sampled as `light::LightField` does.

struct Volume {
    // World positions to cells: the first probe lies at 0, the next along x at (1, 0, 0).
    cell_from_world: array<vec4f, 3>,
    // Size of a cell along the box's axes, metres.
    spacing: vec3f,
    // Light is so much times what the texture holds.
    scale: f32,
    resolution: vec3f,
    // Of a probe: 3, 7, 12 or 19.
    texels: u32,
    // Texel of the atlas where the volume begins.
    origin: vec3f,
    _pad0: f32,
    // How far along a normal light is read, in cells along each of the box's axes.
    offset: vec3f,
    _pad1: f32,
}

struct Field {
    count: u32,
}

@group(2) @binding(0) var<uniform> field: Field;
@group(2) @binding(1) var<storage, read> volumes: array<Volume>;
@group(2) @binding(2) var atlas: texture_3d<f32>;
@group(2) @binding(3) var atlas_sampler: sampler;

// Light of two lobes.
struct TwoLobes {
    a: vec3f,
    b: vec3f,
}

// Volumes are told by their number, and of each no more is read than is needed: a shader that reads
// all of a volume at every step spends most of its time on that.

fn cell_of(number: u32, position: vec3f) -> vec3f {
    return transform_point(volumes[number].cell_from_world, position);
}

// A normal along the box's axes.
fn out_of(number: u32, normal: vec3f) -> vec3f {
    return transform_vector(volumes[number].cell_from_world, normal) * volumes[number].spacing;
}

// Where a surface's point counts as lying when volumes share it (ProbeVolume::place).
fn place_of(number: u32, position: vec3f, normal: vec3f) -> vec3f {
    let cells = max(volumes[number].offset, vec3f(0.5));
    return cell_of(number, position) + cells * out_of(number, normal);
}

// How much a place in cells belongs to the box (Grid::weight).
fn weight_in(resolution: vec3f, cell: vec3f) -> f32 {
    let t = clamp(2.0 * min(cell + 0.5, resolution - 0.5 - cell), vec3f(0.0), vec3f(1.0));
    let s = t * t * (3.0 - 2.0 * t);
    return s.x * s.y * s.z;
}

// By how many cells a place lies outside the box.
fn outside(resolution: vec3f, cell: vec3f) -> vec3f {
    return max(max(-0.5 - cell, cell + 0.5 - resolution), vec3f(0.0));
}

// How much of what no box claims belongs to this one (Grid::reach).
fn reach_of(resolution: vec3f, cell: vec3f) -> f32 {
    let near = max(1.0 - 2.0 * outside(resolution, cell), vec3f(0.0));
    return near.x * near.y * near.z;
}

// Where the texture is read for a surface: in cells, clamped to the outermost probes.
fn sampled_cell(number: u32, position: vec3f, normal: vec3f) -> vec3f {
    let cell = cell_of(number, position) + volumes[number].offset * out_of(number, normal);
    return clamp(cell, vec3f(0.0), volumes[number].resolution - 1.0);
}

// A group of four coefficients, three texels of four channels each, weighed.
fn weighed(t0: vec4f, t1: vec4f, t2: vec4f, w: vec4f) -> vec3f {
    return t0.xyz * w.x + vec3f(t0.w, t1.xy) * w.y + vec3f(t1.zw, t2.x) * w.z + t2.yzw * w.w;
}

// Adds group `number` of four coefficients, weighed for both lobes.
fn add_group(light: ptr<function, TwoLobes>, first: vec3f, step: vec3f, number: f32, a: vec4f, b: vec4f) {
    let at = first + 3.0 * number * step;
    let t0 = textureSampleLevel(atlas, atlas_sampler, at, 0.0);
    let t1 = textureSampleLevel(atlas, atlas_sampler, at + step, 0.0);
    let t2 = textureSampleLevel(atlas, atlas_sampler, at + 2.0 * step, 0.0);
    (*light).a += weighed(t0, t1, t2, a);
    (*light).b += weighed(t0, t1, t2, b);
}

// Adds the last coefficient of an even order, which has a group to itself.
fn add_last(light: ptr<function, TwoLobes>, first: vec3f, step: vec3f, number: f32, a: f32, b: f32) {
    let t = textureSampleLevel(atlas, atlas_sampler, first + 3.0 * number * step, 0.0);
    (*light).a += t.xyz * a;
    (*light).b += t.xyz * b;
}

// What two lobes see from a cell of a volume. A texel is read once for both, and what it brings is
// added at once: no probe's coefficients are ever held together, so that order 4 needs no more
// registers than order 1.
fn volume_light(number: u32, cell: vec3f, a: Lobe, b: Lobe) -> TwoLobes {
    let texel = 1.0 / vec3f(textureDimensions(atlas));
    let first = (volumes[number].origin + cell + vec3f(0.5, 0.5, 1.5)) * texel;
    let step = vec3f(0.0, 0.0, (volumes[number].resolution.z + 2.0) * texel.z);
    let texels = volumes[number].texels;
    var light: TwoLobes;
    add_group(&light, first, step, 0.0, a.g0, b.g0);
    if texels > 3u {
        add_group(&light, first, step, 1.0, a.g1, b.g1);
    }
    if texels == 7u {
        add_last(&light, first, step, 2.0, a.g2.x, b.g2.x);
    }
    if texels > 7u {
        add_group(&light, first, step, 2.0, a.g2, b.g2);
        add_group(&light, first, step, 3.0, a.g3, b.g3);
    }
    if texels > 12u {
        add_group(&light, first, step, 4.0, a.g4, b.g4);
        add_group(&light, first, step, 5.0, a.g5, b.g5);
        add_last(&light, first, step, 6.0, a.g6, b.g6);
    }
    let scale = volumes[number].scale;
    return TwoLobes(light.a * scale, light.b * scale);
}

// What two lobes see at a point of a surface (LightField::sample): the finest volume counts, passing
// smoothly into the next; beyond all of them the nearest one's border does. Negative light, which
// truncated expansions have, is none. Each volume is read once at most, whatever of the point it has.
fn field_light(position: vec3f, normal: vec3f, a: Lobe, b: Lobe) -> TwoLobes {
    if field.count == 1u {
        // All that there is has all of every point.
        let light = volume_light(0u, sampled_cell(0u, position, normal), a, b);
        return TwoLobes(max(light.a, vec3f(0.0)), max(light.b, vec3f(0.0)));
    }
    var unclaimed = 1.0;
    for (var i = 0u; i < field.count && unclaimed > 0.0; i++) {
        unclaimed -= unclaimed * weight_in(volumes[i].resolution, place_of(i, position, normal));
    }
    var reach = 0.0;
    var nearest = 0u;
    if unclaimed > 0.0 {
        var least = 3.4e38;
        for (var i = 0u; i < field.count; i++) {
            let resolution = volumes[i].resolution;
            let place = place_of(i, position, normal);
            reach += reach_of(resolution, place);
            // Metres (Grid::beyond).
            let distance = length(outside(resolution, place) * volumes[i].spacing);
            if distance < least {
                nearest = i;
                least = distance;
            }
        }
    }
    var sum = TwoLobes(vec3f(0.0), vec3f(0.0));
    var left = 1.0;
    for (var i = 0u; i < field.count && left + unclaimed > 0.0; i++) {
        let resolution = volumes[i].resolution;
        let place = place_of(i, position, normal);
        let claimed = left * weight_in(resolution, place);
        left -= claimed;
        var share = select(0.0, 1.0, i == nearest);
        if reach > 0.0 {
            share = reach_of(resolution, place) / reach;
        }
        let weight = claimed + unclaimed * share;
        if weight > 0.0 {
            let light = volume_light(i, sampled_cell(i, position, normal), a, b);
            sum.a += weight * light.a;
            sum.b += weight * light.b;
        }
    }
    return TwoLobes(max(sum.a, vec3f(0.0)), max(sum.b, vec3f(0.0)));
}
