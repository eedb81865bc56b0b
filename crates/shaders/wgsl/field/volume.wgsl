// A probe volume, and how its light is read from the atlas that holds it, as `light::ProbeVolume` does.

#import common/harmonics

struct Volume {
    // World positions to cells: the first probe lies at 0, the next along x at (1, 0, 0).
    cell_from_world: array<vec4f, 3>,
    // Size of a cell along the box's axes, metres.
    spacing: vec3f,
    // Light is what the texture holds times this.
    scale: f32,
    resolution: vec3f,
    // A probe has so many texels: 3, 7, 12 or 19.
    texels: u32,
    // The volume begins at this texel of the atlas.
    origin: vec3f,
    _pad0: f32,
    // Light is read so far along a normal, in cells along each of the box's axes.
    offset: vec3f,
    _pad1: f32,
}

// Light of two lobes.
struct TwoLobes {
    a: vec3f,
    b: vec3f,
}

// How much a place in cells belongs to the box (Grid::weight).
fn weight_in(resolution: vec3f, cell: vec3f) -> f32 {
    let t = clamp(2.0 * min(cell + 0.5, resolution - 0.5 - cell), vec3f(0.0), vec3f(1.0));
    let s = t * t * (3.0 - 2.0 * t);
    return s.x * s.y * s.z;
}

// How many cells a place lies outside the box.
fn outside(resolution: vec3f, cell: vec3f) -> vec3f {
    return max(max(-0.5 - cell, cell + 0.5 - resolution), vec3f(0.0));
}

// How much of what no box claims belongs to this one (Grid::reach).
fn reach_of(resolution: vec3f, cell: vec3f) -> f32 {
    let near = max(1.0 - 2.0 * outside(resolution, cell), vec3f(0.0));
    return near.x * near.y * near.z;
}

// Where the coefficients of a probe, or of a place between probes, lie in the atlas.
struct Texels {
    // The texture coordinates of the first one, and the step from one to the next.
    first: vec3f,
    step: vec3f,
    // There are so many of them.
    count: u32,
}

// The texels of a cell. Its volume begins at the texel `origin` of the atlas, and has `slices` cells along
// z.
fn texels_at(atlas: texture_3d<f32>, origin: vec3f, slices: f32, cell: vec3f, count: u32) -> Texels {
    let texel = 1.0 / vec3f(textureDimensions(atlas));
    let first = (origin + cell + vec3f(0.5, 0.5, 1.5)) * texel;
    return Texels(first, vec3f(0.0, 0.0, (slices + 2.0) * texel.z), count);
}

// A group of four coefficients: three texels of four channels each.
struct Group {
    t0: vec4f,
    t1: vec4f,
    t2: vec4f,
}

fn group_at(atlas: texture_3d<f32>, linear: sampler, texels: Texels, number: f32) -> Group {
    let at = texels.first + 3.0 * number * texels.step;
    return Group(
        textureSampleLevel(atlas, linear, at, 0.0),
        textureSampleLevel(atlas, linear, at + texels.step, 0.0),
        textureSampleLevel(atlas, linear, at + 2.0 * texels.step, 0.0),
    );
}

// The last coefficient of an even order has a group to itself.
fn last_at(atlas: texture_3d<f32>, linear: sampler, texels: Texels, number: f32) -> vec3f {
    return textureSampleLevel(atlas, linear, texels.first + 3.0 * number * texels.step, 0.0).xyz;
}

fn weighed(g: Group, w: vec4f) -> vec3f {
    return g.t0.xyz * w.x + vec3f(g.t0.w, g.t1.xy) * w.y + vec3f(g.t1.zw, g.t2.x) * w.z + g.t2.yzw * w.w;
}

fn add_group(light: ptr<function, TwoLobes>, g: Group, a: vec4f, b: vec4f) {
    (*light).a += weighed(g, a);
    (*light).b += weighed(g, b);
}

fn add_last(light: ptr<function, TwoLobes>, last: vec3f, a: f32, b: f32) {
    (*light).a += last * a;
    (*light).b += last * b;
}

// What two lobes see, as the atlas has it. A texel is read once for both, and what it brings is added at
// once: no probe's coefficients are ever held together, so that order 4 needs no more registers than
// order 1.
fn stored_light(atlas: texture_3d<f32>, linear: sampler, texels: Texels, a: Lobe, b: Lobe) -> TwoLobes {
    var light: TwoLobes;
    add_group(&light, group_at(atlas, linear, texels, 0.0), a.g0, b.g0);
    if texels.count > 3u {
        add_group(&light, group_at(atlas, linear, texels, 1.0), a.g1, b.g1);
    }
    if texels.count == 7u {
        add_last(&light, last_at(atlas, linear, texels, 2.0), a.g2.x, b.g2.x);
    }
    if texels.count > 7u {
        add_group(&light, group_at(atlas, linear, texels, 2.0), a.g2, b.g2);
        add_group(&light, group_at(atlas, linear, texels, 3.0), a.g3, b.g3);
    }
    if texels.count > 12u {
        add_group(&light, group_at(atlas, linear, texels, 4.0), a.g4, b.g4);
        add_group(&light, group_at(atlas, linear, texels, 5.0), a.g5, b.g5);
        add_last(&light, last_at(atlas, linear, texels, 6.0), a.g6, b.g6);
    }
    return light;
}
