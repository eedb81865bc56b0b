// Draws the depth that a light or a camera sees. Masked surfaces leave their holes open; of blended
// ones, of which cameras want no depth, as many texels stay open as light passes, which the filter of
// the shadow's edge averages.

#import common/math
#import shade/pass_bindings
#import surface/bindings
#import surface/material
#import surface/textures

struct DepthVertex {
    @location(0) position: vec3f,
    @location(3) uv0: vec2f,
    @location(4) uv1: vec2f,
    @location(5) color: vec4f,
    @builtin(instance_index) instance: u32,
}

struct DepthVarying {
    @builtin(position) clip: vec4f,
    @location(0) uv: vec4f,
    @location(1) color: vec4f,
    @location(2) @interpolate(flat) instance: u32,
}

@vertex
fn depth_vertex(@location(0) position: vec3f, @builtin(instance_index) instance: u32) -> @builtin(position) @invariant vec4f {
    let point = transform_point(instances[visible[instance]].world_from_object, position);
    return view.clip_from_world * vec4f(point, 1.0);
}

// Nothing but depth, into pictures.
@fragment
fn depth_fragment() {}

@vertex
fn masked_depth_vertex(in: DepthVertex) -> DepthVarying {
    let index = visible[in.instance];
    let point = transform_point(instances[index].world_from_object, in.position);
    return DepthVarying(view.clip_from_world * vec4f(point, 1.0), vec4f(in.uv0, in.uv1), in.color, index);
}

@fragment
fn masked_depth_fragment(in: DepthVarying) {
    let alpha = base_color_at(Coordinates(in.uv.xy, in.uv.zw), in.color).a;
    var cutoff = material.cutoff;
    if (material.flags & MATERIAL_BLEND) != 0u {
        let texel = vec2u(in.clip.xy);
        // Another number for every layer of a surface.
        let layer = hash(in.instance + hash(bitcast<u32>(in.clip.z)));
        cutoff = unit(hash(texel.x + hash(texel.y + layer))) + 1e-6;
    }
    if alpha < cutoff {
        discard;
    }
}
