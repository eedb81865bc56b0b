// What a pass sees from where it looks.

#import shade/pass_bindings

// Unit vector from a point towards the eye.
fn towards_eye(position: vec3f) -> vec3f {
    return normalize(mix(-view.forward, view.eye - position, view.perspective));
}

// Metres along the axis of sight that a depth stands for.
fn distance_of(depth: f32) -> f32 {
    let rows = view.view_from_clip;
    return -(rows[2].z * depth + rows[3].z) / (rows[2].w * depth + rows[3].w);
}

// How far a depth that was drawn (0 where nothing was) is that of a surface which is expected to have
// another one, 0 to 1: not at all from an eighth of occlusion's radius on.
fn same_surface(drawn: f32, expected: f32, radius: f32) -> f32 {
    if drawn <= 0.0 || expected <= 0.0 {
        return 0.0;
    }
    return saturate(1.0 - 8.0 / radius * abs(distance_of(drawn) - distance_of(expected)));
}
