// From where a pass looks, and what it draws. The one group that every pass has.

struct View {
    clip_from_world: mat4x4f,
    world_from_clip: mat4x4f,
    // View space: x to the right, y up, z towards the eye.
    view_from_clip: mat4x4f,
    eye: vec3f,
    // 1 where all rays leave from the eye, 0 where they are parallel.
    perspective: f32,
    forward: vec3f,
    // Fraction of a turn added to patterns, so that frames of one picture differ.
    turn: f32,
}

struct Instance {
    world_from_object: array<vec4f, 3>,
    // Inverse transpose of its linear part.
    normal_from_object: array<vec4f, 3>,
    // 1 where the transform mirrors, so that windings are turned about.
    mirrors: u32,
    _pad0: u32,
    _pad1: u32,
    _pad2: u32,
}

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<storage, read> instances: array<Instance>;
// Indices of the instances that the pass draws, draw by draw.
@group(0) @binding(2) var<storage, read> visible: array<u32>;

// Unit vector from a point towards the eye.
fn towards_eye(position: vec3f) -> vec3f {
    return normalize(mix(-view.forward, view.eye - position, view.perspective));
}

// Metres along the axis of sight that a depth stands for.
fn distance_of(depth: f32) -> f32 {
    let rows = view.view_from_clip;
    return -(rows[2].z * depth + rows[3].z) / (rows[2].w * depth + rows[3].w);
}

// How far a depth that was drawn (0 where nothing was) is that of a surface which is expected to have
// another one, 0 to 1: not at all from an eighth of occlusion's radius on.
fn same_surface(drawn: f32, expected: f32, radius: f32) -> f32 {
    if drawn <= 0.0 || expected <= 0.0 {
        return 0.0;
    }
    return saturate(1.0 - 8.0 / radius * abs(distance_of(drawn) - distance_of(expected)));
}
