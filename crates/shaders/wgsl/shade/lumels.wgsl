// Light at lumels, of surfaces that have some.

#import field/bindings
#import shade/pass_bindings

// What a vertex has in place of a rectangle where it has no lumels.
const NO_LUMELS: u32 = 0xffffffffu;

// Where the lumels of a point lie.
struct Lumels {
    // The number of a rectangle, or NO_LUMELS.
    rectangle: u32,
    // Lumels from its corner.
    at: vec2f,
    // The surface's unit normal there, without a normal map, on the side that is seen.
    normal: vec3f,
}

// How much of a point's light its lumels make: 0 where it has none.
fn lumel_share(lumels: Lumels) -> f32 {
    if lumels.rectangle == NO_LUMELS {
        return 0.0;
    }
    return rectangles[lumels.rectangle].share;
}

// Irradiance at a point that has lumels on a unit normal of shading, lux (`light::slope`).
fn lumel_light(lumels: Lumels, shading: vec3f) -> vec3f {
    let rectangle = rectangles[lumels.rectangle];
    let place = (rectangle.corner + lumels.at) / vec2f(textureDimensions(pages));
    let light = textureSampleLevel(pages, atlas_sampler, place, rectangle.layer, 0.0).rgb;
    var share = 1.0;
    if rectangle.slopes != rectangle.layer {
        let slope = textureSampleLevel(pages, atlas_sampler, place, rectangle.slopes, 0.0).rgb;
        share = max(0.0, 1.0 + dot(slope, shading - lumels.normal));
    }
    return light * share * fields.lumel_scale;
}
