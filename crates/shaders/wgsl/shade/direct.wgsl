// Direct light, scattered by surfaces.

#import common/punctual
#import shade/frame_bindings
#import shade/shadows
#import surface/bsdf
#import surface/site

// Light of punctual lights scattered once.
fn direct_light(b: Bsdf, at: Site, turn: f32) -> vec3f {
    var sum = vec3f(0.0);
    for (var i = 0u; i < frame.light_count; i++) {
        let arriving = incident(lights[i], at.position);
        let scattered_light = scattered(b, at.normal, at.view, arriving.direction) * arriving.irradiance;
        if max(max(scattered_light.x, scattered_light.y), scattered_light.z) > 0.0 {
            // Light through a thin surface arrives at its other side.
            let side = select(at.geometric, -at.geometric, dot(at.normal, arriving.direction) < 0.0);
            sum += scattered_light * visibility(i, arriving, at.position, side, turn);
        }
    }
    return sum;
}
