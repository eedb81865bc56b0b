// A place of a surface, seen from somewhere.

struct Site {
    position: vec3f,
    // Unit vectors on the viewer's side: of shading, and of the surface itself.
    normal: vec3f,
    geometric: vec3f,
    // Towards the viewer, unit.
    view: vec3f,
}

// The shading normal on the viewer's side, bent as little as makes it face the viewer
// (`gather::surface`).
fn visible_normal(shading: vec3f, geometric: vec3f, v: vec3f) -> vec3f {
    const LEAST: f32 = 1e-3;
    if dot(shading, shading) == 0.0 {
        return geometric;
    }
    let n = normalize(select(shading, -shading, dot(shading, geometric) < 0.0));
    let cosine = dot(n, v);
    if cosine >= LEAST {
        return n;
    }
    return normalize(n + (2.0 * LEAST - cosine) * v);
}
