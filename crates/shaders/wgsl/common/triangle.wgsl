// A triangle over the whole target.

// The corner of a number, 0 to 2, in clip coordinates.
fn corner_of(index: u32) -> vec2f {
    return vec2f(f32(index & 1u), f32(index >> 1u)) * 4.0 - 1.0;
}
