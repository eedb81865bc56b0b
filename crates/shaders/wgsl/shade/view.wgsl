// Where a pass looks from, and what it draws.

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
    // Where its rectangles of lumels begin in the list of all.
    lumels: u32,
    // 1 where it neither moves nor deforms.
    still: u32,
    _pad0: u32,
}

// A rectangle of lumels: charts of one side of a primitive of an instance.
struct Rectangle {
    // Its first lumel, on a layer of the pages' texture.
    corner: vec2f,
    layer: u32,
    // How much of the light its lumels make; the rest is the probes'.
    share: f32,
    // The layer that tells how its light depends on the normal, or that of its light where none does.
    slopes: u32,
    _pad0: u32,
}
