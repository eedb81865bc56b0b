// Numbers and small functions that every module may use.

const PI: f32 = 3.14159265358979;
const TAU: f32 = 6.28318530717959;

// PCG's output function (O'Neill 2014) as a hash.
fn hash(x: u32) -> u32 {
    let state = x * 747796405u + 2891336453u;
    let word = ((state >> ((state >> 28u) + 4u)) ^ state) * 277803737u;
    return (word >> 22u) ^ word;
}

// 0 ≤ u < 1 of a hash's upper 24 bits.
fn unit(bits: u32) -> f32 {
    return f32(bits >> 8u) * 0x1p-24;
}

// A unit vector at right angles to the unit vector n (Duff et al. 2017).
fn tangent_of(n: vec3f) -> vec3f {
    let s = select(-1.0, 1.0, n.z >= 0.0);
    let a = -1.0 / (s + n.z);
    return vec3f(1.0 + s * n.x * n.x * a, s * n.x * n.y * a, -s * n.x);
}

// A row-major affine transform of a point.
fn transform_point(rows: array<vec4f, 3>, p: vec3f) -> vec3f {
    let h = vec4f(p, 1.0);
    return vec3f(dot(rows[0], h), dot(rows[1], h), dot(rows[2], h));
}

// The linear part of a row-major transform, applied to a vector.
fn transform_vector(rows: array<vec4f, 3>, v: vec3f) -> vec3f {
    return vec3f(dot(rows[0].xyz, v), dot(rows[1].xyz, v), dot(rows[2].xyz, v));
}

fn normalize_or_zero(v: vec3f) -> vec3f {
    let square = dot(v, v);
    return select(vec3f(0.0), v * inverseSqrt(max(square, 1e-38)), square > 0.0);
}
