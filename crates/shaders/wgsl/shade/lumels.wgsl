// Light at lumels, of surfaces that have some.

#import field/bindings
#import shade/pass_bindings

// The exponent of a display's codes.
const GAMMA: f32 = 2.2;
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

// How far a point has come from probes to its lumels: 0 where it has none.
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

// Light on the way from that of probes to that of lumels: its codes on a display of gamma 2.2 change evenly
// (`light::between`).
fn toward_lumels(probes: vec3f, lumels: vec3f, way: f32) -> vec3f {
    if way >= 1.0 {
        return lumels;
    }
    let inverse = vec3f(1.0 / GAMMA);
    let codes = mix(pow(max(probes, vec3f(0.0)), inverse), pow(max(lumels, vec3f(0.0)), inverse), way);
    return pow(codes, vec3f(GAMMA));
}
