// Direct light, scattered by surfaces.

#import common/punctual
#import shade/frame_bindings
#import shade/shadows
#import surface/bsdf
#import surface/site

// Light that arrives at a point. Lights are told by their number: a light that is passed as a whole is read
// as a whole, which takes an eighth of a picture's time in software.
fn incident(light: u32, at: vec3f) -> Incident {
    if lights[light].kind == LIGHT_DIRECTIONAL {
        return Incident(-lights[light].direction, 0.0, lights[light].intensity);
    }
    let to_light = lights[light].position - at;
    let distance = length(to_light);
    if distance == 0.0 {
        return Incident(vec3f(0.0, 1.0, 0.0), 0.0, vec3f(0.0));
    }
    let direction = to_light / distance;
    let square = distance * distance;
    var falloff = saturate(1.0 - square * square * lights[light].window);
    if lights[light].kind == LIGHT_SPOT {
        let cosine = dot(direction, -lights[light].direction);
        let t = saturate(cosine * lights[light].cone_scale + lights[light].cone_offset);
        falloff *= t * t;
    }
    // Within the sphere the light is as bright as on it.
    let outside = max(distance, lights[light].size);
    return Incident(direction, distance, lights[light].intensity * (falloff / outside / outside));
}

// Light of punctual lights scattered once.
fn direct_light(b: Bsdf, at: Site, turn: f32) -> vec3f {
    var sum = vec3f(0.0);
    for (var i = 0u; i < frame.light_count; i++) {
        let arriving = incident(i, at.position);
        let scattered_light = scattered(b, at.normal, at.view, arriving.direction) * arriving.irradiance;
        if max(max(scattered_light.x, scattered_light.y), scattered_light.z) > 0.0 {
            // Light through a thin surface arrives at its other side.
            let side = select(at.geometric, -at.geometric, dot(at.normal, arriving.direction) < 0.0);
            sum += scattered_light * visibility(i, arriving, at.position, side, turn);
        }
    }
    return sum;
}
