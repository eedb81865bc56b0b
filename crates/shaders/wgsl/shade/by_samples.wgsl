// Surfaces are shaded once a sample, at its place.

struct Varying {
    @builtin(position) @invariant clip: vec4f,
    @location(0) @interpolate(perspective, sample) position: vec3f,
    @location(1) @interpolate(perspective, sample) normal: vec3f,
    @location(2) @interpolate(perspective, sample) tangent: vec4f,
    @location(3) @interpolate(perspective, sample) uv: vec4f,
    @location(4) @interpolate(perspective, sample) color: vec4f,
    @location(5) @interpolate(flat) instance: u32,
    // 1 at every vertex, see `point_at`.
    @location(6) @interpolate(perspective, sample) one: f32,
    // Lumels from the corner of the front's rectangle, and of the back's.
    @location(7) @interpolate(perspective, sample) lumels: vec4f,
    // These rectangles, see `shade/lumels`.
    @location(8) @interpolate(flat) rectangles: vec2u,
}

struct Facing {
    @builtin(front_facing) front: bool,
    @builtin(sample_index) sample: u32,
}

// How far the pattern of a pixel's shadow samples is turned, parts of a turn: its samples together fill
// the circle, by the golden section.
fn turn_of(facing: Facing) -> f32 {
    return 0.618034 * f32(facing.sample);
}
