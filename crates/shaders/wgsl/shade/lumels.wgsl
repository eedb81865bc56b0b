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
}

// Whether a point lies in one of every other lumel, as on a checkerboard.
fn is_dark_checker(lumels: Lumels) -> bool {
    let lumel = vec2i(floor(lumels.at));
    return lumels.rectangle != NO_LUMELS && ((lumel.x + lumel.y) & 1) == 1;
}

// How much of a point's light its lumels make: 0 where it has none.
fn lumel_share(lumels: Lumels) -> f32 {
    if lumels.rectangle == NO_LUMELS {
        return 0.0;
    }
    return rectangles[lumels.rectangle].share;
}

// Irradiance at a point that has lumels, lux.
fn lumel_light(lumels: Lumels) -> vec3f {
    let corner = rectangles[lumels.rectangle].corner;
    let layer = rectangles[lumels.rectangle].layer;
    let place = (corner + lumels.at) / vec2f(textureDimensions(pages));
    return textureSampleLevel(pages, atlas_sampler, place, layer, 0.0).rgb * fields.lumel_scale;
}
