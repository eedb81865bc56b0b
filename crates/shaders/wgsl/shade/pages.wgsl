// Pages of lumels, flat before the picture: as bright as white surfaces that they lit.

#import common/math
#import field/bindings
#import shade/frame_bindings
#import shade/look

struct FlatPage {
    @builtin(position) clip: vec4f,
    // Lumels from the page's corner.
    @location(0) @interpolate(linear, center) at: vec2f,
    @location(1) @interpolate(flat) layer: u32,
}

// Four vertices of a strip for each page. `corner` is its upper left one in clip coordinates, `size` goes
// from there to the lower right one; `lumels` lie along its side.
@vertex
fn pages_vertex(
    @builtin(vertex_index) index: u32,
    @location(0) corner: vec2f,
    @location(1) size: vec2f,
    @location(2) lumels: f32,
    @location(3) layer: u32,
) -> FlatPage {
    let part = vec2f(f32(index & 1u), f32(index >> 1u));
    return FlatPage(vec4f(corner + part * size, 0.0, 1.0), part * lumels, layer);
}

@fragment
fn pages_fragment(in: FlatPage) -> @location(0) vec4f {
    if frame.look != LOOK_LIGHT {
        return vec4f(look_color(in.layer, in.at), 1.0);
    }
    let place = in.at / vec2f(textureDimensions(pages));
    let held = textureSampleLevel(pages, atlas_sampler, place, in.layer, 0.0).rgb;
    let radiance = max(held, vec3f(0.0)) * fields.lumel_scale / PI;
    return vec4f(radiance * frame.pre_exposure, 1.0);
}
