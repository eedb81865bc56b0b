// Shows a picture: exposed, tone mapped, as display codes. A triangle over the whole target, which
// has the picture's size.

struct Screen {
    // What the picture is multiplied by before it is mapped.
    factor: f32,
    // One of the tone maps.
    tone_map: u32,
    // Of the codes that the target holds, for rounding them at random; 0 rounds to the nearest.
    step: f32,
    _pad: u32,
}

@group(0) @binding(0) var<uniform> screen: Screen;
@group(0) @binding(1) var picture: texture_2d<f32>;

@vertex
fn screen_vertex(@builtin(vertex_index) index: u32) -> @builtin(position) vec4f {
    let at = vec2f(f32(index & 1u), f32(index >> 1u)) * 4.0 - 1.0;
    return vec4f(at, 0.0, 1.0);
}

@fragment
fn screen_fragment(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let pixel = vec2u(at.xy);
    let linear = textureLoad(picture, pixel, 0).rgb * screen.factor;
    let code = display_code(linear, screen.tone_map);
    // Smooth gradients have no steps where neighbours round differently; black stays black.
    let noise = unit(hash(pixel.x + 65536u * pixel.y)) - 0.5;
    return vec4f(select(vec3f(0.0), code + noise * screen.step, code > vec3f(0.0)), 1.0);
}
