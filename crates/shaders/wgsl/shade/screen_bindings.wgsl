// What showing a picture binds.

struct Screen {
    // What the picture is multiplied by before it is mapped.
    factor: f32,
    // One of the tone maps.
    tone_map: u32,
    // The step between two codes of the target, which are rounded at random; 0 rounds to the nearest.
    step: f32,
    _pad: u32,
}

@group(0) @binding(0) var<uniform> screen: Screen;
@group(0) @binding(1) var picture: texture_2d<f32>;
