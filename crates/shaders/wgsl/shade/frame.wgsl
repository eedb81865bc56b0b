// What holds for all passes of a frame.

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
    // Ambient occlusion ends at this distance, metres.
    occlusion_radius: f32,
    // Indirect light of what is still, and of what moves, is multiplied by these.
    still: f32,
    moving: f32,
    // What surfaces with lumels show, see LOOK_*.
    look: u32,
}

// Which light is drawn.
const PART_EMISSION: u32 = 1u;
const PART_DIRECT: u32 = 2u;
const PART_INDIRECT: u32 = 4u;

// What surfaces with lumels show: their light, their lumels, or how long ago the light of these came.
const LOOK_LIGHT: u32 = 0u;
const LOOK_LUMELS: u32 = 1u;
const LOOK_AGE: u32 = 2u;

// A shadow map: one layer of the array.
struct ShadowView {
    clip_from_world: mat4x4f,
    // How large a texel is, metres: in perspective at a distance of one metre from the light.
    texel: f32,
    // A clip depth stands for the distance near/depth in perspective, and for
    // near + (1 − depth)·depth_range where rays are parallel.
    near: f32,
    depth_range: f32,
    // Half the widest edge that is looked for, metres.
    search: f32,
    // How far this view reaches, in clip units, before the next cascade takes over.
    reach: vec2f,
    _pad0: f32,
    _pad1: f32,
}
