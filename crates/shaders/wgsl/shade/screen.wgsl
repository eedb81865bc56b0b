// Shows a picture: exposed, tone mapped, as display codes. A triangle over the whole target, which
// has the picture's size.

#import common/math
#import common/tone
#import common/triangle
#import shade/screen_bindings

@vertex
fn screen_vertex(@builtin(vertex_index) index: u32) -> @builtin(position) vec4f {
    let at = corner_of(index);
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
