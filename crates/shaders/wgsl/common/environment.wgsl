// The environment: the twin of `gather::lights::environment`'s radiance.

#import common/math

struct Environment {
    // Straight up (of a picture: its factor), straight down, at the horizon; cd/m².
    zenith: vec3f,
    // 0: by elevation, 1: a picture.
    kind: u32,
    ground: vec3f,
    // A picture is turned so far about +Y, in full turns.
    turn: f32,
    horizon: vec3f,
    _pad: u32,
}

fn environment_radiance(e: Environment, picture: texture_2d<f32>, d: vec3f) -> vec3f {
    if e.kind == 0u {
        let end = select(e.ground, e.zenith, d.y >= 0.0);
        return mix(e.horizon, end, min(abs(d.y), 1.0));
    }
    let size = vec2f(textureDimensions(picture));
    let u = fract(0.5 + atan2(d.x, -d.z) / TAU + e.turn);
    // acos(y), but with all its digits near the poles too.
    let v = atan2(length(d.xz), d.y) / PI;
    let texel = min(vec2u(vec2f(u, v) * size), vec2u(size) - 1u);
    return e.zenith * textureLoad(picture, texel, 0).rgb;
}
