// What one looks into lumels by: colours in their light's place, as the page shows them
// (`web/three/src/lumel-pages.ts`).

#import field/bindings
#import shade/frame_bindings

// A bright and a dark lumel of the checkerboard.
const BRIGHT_LUMEL: f32 = 0.8;
const DARK_LUMEL: f32 = 0.08;

// Ages that are shown as young and as old, seconds.
const YOUNG: f32 = 0.1;
const OLD: f32 = 10.0;

// From green by yellow to red as light grows old, in even steps of its logarithm; black before any came.
fn age_color(seconds: f32) -> vec3f {
    if seconds < 0.0 {
        return vec3f(0.0);
    }
    let part = saturate(log(max(seconds, YOUNG) / YOUNG) / log(OLD / YOUNG));
    return vec3f(min(2.0 * part, 1.0), min(2.0 - 2.0 * part, 1.0), 0.0);
}

// Seconds since the light of a lumel came, on a layer of the pages.
fn age_of(layer: u32, lumel: vec2u) -> f32 {
    let square = lumel / fields.age_side;
    return ages[(layer * fields.age_columns + square.y) * fields.age_columns + square.x];
}

// The colour of a point of a page, lumels from its corner.
fn look_color(layer: u32, at: vec2f) -> vec3f {
    let lumel = vec2u(max(at, vec2f(0.0)));
    if frame.look == LOOK_AGE {
        return age_color(age_of(layer, lumel));
    }
    return vec3f(select(BRIGHT_LUMEL, DARK_LUMEL, ((lumel.x + lumel.y) & 1u) == 1u));
}
