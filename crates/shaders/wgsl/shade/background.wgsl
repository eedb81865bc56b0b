// Draws the environment where there is no surface: a triangle over the whole target.

#import common/environment
#import common/triangle
#import shade/frame_bindings
#import shade/pass_bindings

struct Background {
    @invariant @builtin(position) clip: vec4f,
    @location(0) @interpolate(linear, center) at: vec2f,
}

@vertex
fn background_vertex(@builtin(vertex_index) index: u32) -> Background {
    let at = corner_of(index);
    return Background(vec4f(at, 0.0, 1.0), at);
}

@fragment
fn background_fragment(in: Background) -> @location(0) vec4f {
    var direction = view.forward;
    if view.perspective > 0.0 {
        let far = view.world_from_clip * vec4f(in.at, 0.5, 1.0);
        direction = normalize(far.xyz / far.w - view.eye);
    }
    let radiance = environment_radiance(environment, environment_picture, direction);
    return vec4f(radiance * frame.pre_exposure, 1.0);
}
