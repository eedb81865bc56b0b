// What the passes of ambient occlusion bind.

struct Occlusion {
    // From here on nothing is hidden, metres.
    radius: f32,
    // Slices of a pixel, and samples to either side of a slice.
    directions: u32,
    steps: u32,
    _pad: u32,
}

@group(1) @binding(0) var<uniform> occlusion: Occlusion;
@group(1) @binding(1) var depths: texture_depth_2d;
// What is blurred.
@group(1) @binding(2) var rough: texture_2d<f32>;
