// Punctual lights, exactly as KHR_lights_punctual states them.

struct PunctualLight {
    position: vec3f,
    // One of LIGHT_*.
    kind: u32,
    // Along which it shines, unit.
    direction: vec3f,
    // Radius of its sphere, metres; of a directional light the tangent of half its angle.
    size: f32,
    // Candela, or lux.
    intensity: vec3f,
    // 1/range⁴; 0 where the range is infinite.
    window: f32,
    // The spot's falloff is clamp(cos·scale + offset)².
    cone_scale: f32,
    cone_offset: f32,
    // Its shadow maps have these numbers.
    first_shadow: u32,
    shadow_count: u32,
}

const LIGHT_POINT: u32 = 0u;
const LIGHT_SPOT: u32 = 1u;
const LIGHT_DIRECTIONAL: u32 = 2u;

// Light arriving from a punctual light, were nothing in between.
struct Incident {
    // Towards the light, unit.
    direction: vec3f,
    // Metres.
    distance: f32,
    // On a surface that faces the light, lux.
    irradiance: vec3f,
}
