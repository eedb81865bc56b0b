// Ambient occlusion as pictures read it.

#import shade/frame_bindings
#import shade/sight

// Whether there is ambient occlusion in screen space.
override OCCLUDED: bool = false;

// What ambient occlusion leaves of the light at a place of the picture whose depth changes so much from
// a pixel to the next. Where the pixel shows another surface, those beside it are asked: so edges between
// samples of a pixel have no seams, and blended surfaces, of which no depth was drawn, are left alone.
fn ambient_visibility(at: vec4f, slopes: vec2f) -> f32 {
    let pixel = vec2i(at.xy);
    if depth_share(pixel, at, slopes, frame.occlusion_radius) > 0.0 {
        return textureLoad(occlusion_visibility, pixel, 0).r;
    }
    var sum = 0.0;
    var weights = 0.0;
    for (var i = 0; i < 9; i++) {
        let beside = pixel + vec2i(i % 3 - 1, i / 3 - 1);
        // Surfaces bend: now what lies within the radius will do, the more the nearer it is.
        let share = depth_share(beside, at, slopes, 8.0 * frame.occlusion_radius);
        let weight = share * share;
        if weight > 0.0 {
            sum += weight * textureLoad(occlusion_visibility, beside, 0).r;
            weights += weight;
        }
    }
    return select(1.0, sum / weights, weights > 0.0);
}

fn depth_share(pixel: vec2i, at: vec4f, slopes: vec2f, radius: f32) -> f32 {
    if any(pixel < vec2i(0)) || any(pixel >= vec2i(textureDimensions(occlusion_depths))) {
        return 0.0;
    }
    let expected = at.z + dot(slopes, vec2f(pixel) + 0.5 - at.xy);
    return same_surface(textureLoad(occlusion_depths, pixel, 0), expected, radius);
}
