// Surfaces are shaded once a pixel: at its middle, for all samples that they cover.

struct Varying {
    @builtin(position) @invariant clip: vec4f,
    @location(0) @interpolate(perspective, center) position: vec3f,
    @location(1) @interpolate(perspective, center) normal: vec3f,
    @location(2) @interpolate(perspective, center) tangent: vec4f,
    @location(3) @interpolate(perspective, center) uv: vec4f,
    @location(4) @interpolate(perspective, center) color: vec4f,
    @location(5) @interpolate(flat) instance: u32,
    // 1 at every vertex, see `point_at`.
    @location(6) @interpolate(perspective, center) one: f32,
    // Lumels from the corner of the front's rectangle, and of the back's.
    @location(7) @interpolate(perspective, center) lumels: vec4f,
    // These rectangles, see `shade/lumels`.
    @location(8) @interpolate(flat) rectangles: vec2u,
}

struct Facing {
    @builtin(front_facing) front: bool,
}

// How far the pattern of a pixel's shadow samples is turned, parts of a turn.
fn turn_of(facing: Facing) -> f32 {
    return 0.0;
}
