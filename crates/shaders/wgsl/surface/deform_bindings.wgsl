// What the deforming of a primitive binds.

struct Deform {
    vertices: u32,
    // How many of `morphs` there are.
    morphs: u32,
    // Joints of the skin. One transform more is in `pose`, for whatever has no joint.
    joints: u32,
    // Each vertex has so many, one after the other.
    influences: u32,
    flags: u32,
}

const DEFORM_SKINNED: u32 = 1u;
// Each triangle has three vertices of its own, and its normal.
const DEFORM_FLAT: u32 = 2u;

// Four of the joints that a vertex hangs on.
struct Influence {
    weights: vec4f,
    // Four numbers of 16 bits, the first in the lower half of x.
    joints: vec2u,
    _pad: vec2u,
}

// A morph target that displaces.
struct Morph {
    number: u32,
    weight: f32,
}

@group(0) @binding(0) var<uniform> deform: Deform;
@group(0) @binding(1) var<storage, read> rest: array<f32>;
@group(0) @binding(2) var<storage, read> influences: array<Influence>;
@group(0) @binding(3) var<storage, read> displacements: array<f32>;
@group(0) @binding(4) var<storage, read> morphs: array<Morph>;
@group(0) @binding(5) var<storage, read> pose: array<array<vec4f, 3>>;
@group(0) @binding(6) var<storage, read_write> deformed: array<f32>;
