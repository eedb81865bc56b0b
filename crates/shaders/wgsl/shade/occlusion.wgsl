// Ambient occlusion of short range in screen space, from the depth that a camera sees: slices through
// the ray of sight, and cosine-weighted arcs in them, of Jiménez et al. 2016 ("Practical Realtime
// Strategies for Accurate Indirect Occlusion"); each arc weighed by the distance of what hides it, as
// Bavoil and Sainz 2008 ("Image-Space Horizon-Based Ambient Occlusion") do. Triangles over the whole
// target, which has the depth's size.

#import common/math
#import common/triangle
#import shade/occlusion_bindings
#import shade/pass_bindings
#import shade/sight

@vertex
fn occlusion_vertex(@builtin(vertex_index) index: u32) -> @builtin(position) vec4f {
    let at = corner_of(index);
    return vec4f(at, 0.0, 1.0);
}

// 0, infinitely far, outside the picture.
fn depth_at(pixel: vec2i) -> f32 {
    if any(pixel < vec2i(0)) || any(pixel >= vec2i(textureDimensions(depths))) {
        return 0.0;
    }
    return textureLoad(depths, pixel, 0);
}

// The place of a pixel's surface in view space: x to the right, y up, z towards the eye.
fn position_at(pixel: vec2i, depth: f32) -> vec3f {
    let at = (vec2f(pixel) + 0.5) / vec2f(textureDimensions(depths));
    let h = view.view_from_clip * vec4f(2.0 * at.x - 1.0, 1.0 - 2.0 * at.y, depth, 1.0);
    return h.xyz / h.w;
}

// How much depth changes from a pixel to the next along an axis: on the side whose two pixels lie more
// nearly on a line with it, since planes have depths that are linear over the picture.
fn slope(pixel: vec2i, depth: f32, axis: vec2i) -> f32 {
    let before = depth_at(pixel - axis);
    let after = depth_at(pixel + axis);
    let bend_before = abs(depth - 2.0 * before + depth_at(pixel - 2 * axis));
    let bend_after = abs(depth - 2.0 * after + depth_at(pixel + 2 * axis));
    return select(after - depth, depth - before, bend_before < bend_after);
}

// A vector along the surface, towards the next pixel along an axis.
fn along_surface(pixel: vec2i, depth: f32, here: vec3f, axis: vec2i) -> vec3f {
    let change = slope(pixel, depth, axis);
    // The nearer side is taken: on the other one a surface may reach infinity within a pixel.
    let side = select(-1, 1, change >= 0.0);
    return f32(side) * (position_at(pixel + side * axis, depth + abs(change)) - here);
}

// The normal of the surface on the side of `v`.
fn normal_at(pixel: vec2i, depth: f32, here: vec3f, v: vec3f) -> vec3f {
    let right = along_surface(pixel, depth, here, vec2i(1, 0));
    let down = along_surface(pixel, depth, here, vec2i(0, 1));
    let n = normalize(cross(down, right));
    return select(n, -n, dot(n, v) < 0.0);
}

// Pixels that a metre along `d` takes at a point.
fn pixels_a_metre(here: vec3f, d: vec3f) -> vec2f {
    let scale = vec2f(view.view_from_clip[0].x, view.view_from_clip[1].y);
    let parallel = d.xy / scale;
    let converging = (d.xy - here.xy / here.z * d.z) / (-here.z * scale);
    let size = vec2f(textureDimensions(depths));
    return 0.5 * size * vec2f(1.0, -1.0) * mix(parallel, converging, view.perspective);
}

// ∫ cos(θ − tilt) sin θ dθ from 0 to `angle`, of Jiménez et al.: what the arc between the ray of sight
// and a horizon brings to a surface whose normal is tilted towards it.
fn arc(angle: f32, tilt: f32) -> f32 {
    return 0.25 * (cos(tilt) - cos(2.0 * angle - tilt) + 2.0 * angle * sin(tilt));
}

// A slice through the ray of sight, at a point.
struct Slice {
    // Unit vectors: towards the eye, at right angles to that along the slice, and across it.
    v: vec3f,
    d: vec3f,
    across: vec3f,
    // What moves points into the slice along the surface, for each metre that they are across it.
    into: vec3f,
    // The length of the normal's projection, and its angle from v towards d.
    weight: f32,
    tilt: f32,
}

fn slice_of(v: vec3f, d: vec3f, n: vec3f) -> Slice {
    let across = cross(d, v);
    let n_across = dot(n, across);
    let square = max(1.0 - n_across * n_across, 1e-4);
    let into = (n * n_across - across) / square;
    return Slice(v, d, across, into, sqrt(square), atan2(dot(n, d), dot(n, v)));
}

// What is hidden on one side of a slice, 1 towards d and −1 away from it: `arc`s, each weighed by
// 1 − (t/radius)² of the distance t of what hides it.
fn hidden(s: Slice, pixel: vec2i, here: vec3f, side: f32, offset: f32) -> f32 {
    let tilt = side * s.tilt;
    var horizon = 0.5 * PI + tilt;
    var horizon_cosine = cos(horizon);
    let reach = side * occlusion.radius * pixels_a_metre(here, s.d);
    let pixels = length(reach);
    if !(pixels >= 1.0) {
        return 0.0;
    }
    var sum = 0.0;
    for (var i = 0u; i < occlusion.steps; i++) {
        // Denser near the point, and none at the point itself.
        let part = (f32(i) + offset) / f32(occlusion.steps);
        let by = vec2i(round(reach / pixels * mix(1.0, pixels, part * sqrt(part))));
        let depth = depth_at(pixel + by);
        if depth == 0.0 {
            continue;
        }
        let towards = position_at(pixel + by, depth) - here;
        let remaining = 1.0 - dot(towards, towards) / (occlusion.radius * occlusion.radius);
        // Pixels lie beside the slice. Moved along the surface they rise above it as much as before, so
        // that a plane does not hide itself. What comes to lie on the other side is left out.
        let inside = towards + s.into * dot(towards, s.across);
        let along = vec2f(side * dot(inside, s.d), dot(inside, s.v));
        let cosine = along.y * inverseSqrt(dot(along, along));
        if remaining > 0.0 && along.x > 0.0 && cosine > horizon_cosine {
            let angle = acos(clamp(cosine, -1.0, 1.0));
            sum += remaining * (arc(horizon, tilt) - arc(angle, tilt));
            horizon = angle;
            horizon_cosine = cosine;
        }
    }
    return sum;
}

// Where the slices of a pixel and their samples begin, parts of a step: among 4×4 pixels all are
// different (Jiménez et al. 2016), and other ones in other frames.
fn beginning(pixel: vec2i) -> vec2f {
    let x = pixel.x & 3;
    let turn = f32(4 * ((pixel.x + pixel.y) & 3) + x) / 16.0;
    let offset = f32((pixel.y - pixel.x) & 3) / 4.0;
    return fract(vec2f(turn, offset) + view.turn * vec2f(1.0, 0.618034));
}

// The visible share of a surface's cosine-weighted half space.
@fragment
fn occlusion_fragment(@builtin(position) at: vec4f) -> @location(0) f32 {
    let pixel = vec2i(at.xy);
    let depth = depth_at(pixel);
    if depth == 0.0 {
        return 1.0;
    }
    let here = position_at(pixel, depth);
    let v = normalize(mix(vec3f(0.0, 0.0, 1.0), -here, view.perspective));
    let n = normal_at(pixel, depth, here, v);
    let right = tangent_of(v);
    let up = cross(v, right);
    let begin = beginning(pixel);
    var all = 0.0;
    var taken = 0.0;
    for (var i = 0u; i < occlusion.directions; i++) {
        let angle = PI * (f32(i) + begin.x) / f32(occlusion.directions);
        let s = slice_of(v, cos(angle) * right + sin(angle) * up, n);
        // Divided by what these slices would see of an open half space, planes are open exactly.
        all += s.weight * (arc(0.5 * PI + s.tilt, s.tilt) + arc(0.5 * PI - s.tilt, -s.tilt));
        taken += s.weight * (hidden(s, pixel, here, 1.0, begin.y) + hidden(s, pixel, here, -1.0, begin.y));
    }
    return 1.0 - taken / all;
}

// The mean over 4×4 pixels of the same surface: the outermost of 5×5 count half.
@fragment
fn blur_fragment(@builtin(position) at: vec4f) -> @location(0) f32 {
    let pixel = vec2i(at.xy);
    let depth = depth_at(pixel);
    if depth == 0.0 {
        return 1.0;
    }
    let slopes = vec2f(slope(pixel, depth, vec2i(1, 0)), slope(pixel, depth, vec2i(0, 1)));
    var sum = 0.0;
    var weights = 0.0;
    for (var y = -2; y <= 2; y++) {
        for (var x = -2; x <= 2; x++) {
            let other = depth_at(pixel + vec2i(x, y));
            let expected = depth + dot(slopes, vec2f(f32(x), f32(y)));
            let share = select(1.0, 0.5, abs(x) == 2) * select(1.0, 0.5, abs(y) == 2);
            let weight = share * same_surface(other, expected, occlusion.radius);
            if weight > 0.0 {
                sum += weight * textureLoad(rough, pixel + vec2i(x, y), 0).r;
                weights += weight;
            }
        }
    }
    return sum / weights;
}
