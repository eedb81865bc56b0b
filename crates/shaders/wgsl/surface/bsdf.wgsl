// How surfaces scatter light: the twin of `gather::bsdf`, in world space.

#import common/math

// What a surface is made of, textures looked up already.
struct Substance {
    base_color: vec3f,
    metallic: f32,
    specular_color: vec3f,
    roughness: f32,
    transmission: f32,
    ior: f32,
    specular: f32,
}

struct Bsdf {
    diffuse: vec3f,
    alpha: f32,
    transmission: vec3f,
    // The specular lobe is one of dielectric and metal, mixed.
    f90: f32,
    f0: vec3f,
    // The lobes underneath lose what the dielectric alone reflects.
    dielectric_f0: f32,
    dielectric_f90: f32,
}

// Below it the lobe is narrower than f32 can hold.
const MIN_ALPHA: f32 = 1e-3;

fn lambert(albedo: vec3f) -> Bsdf {
    return Bsdf(albedo, 1.0, vec3f(0.0), 0.0, vec3f(0.0), 0.0, 0.0);
}

fn bsdf_of(s: Substance) -> Bsdf {
    let r = (s.ior - 1.0) / (s.ior + 1.0);
    let by_ior = select(r * r, 1.0, s.ior == 0.0);
    let f0 = min(by_ior * s.specular_color, vec3f(1.0)) * s.specular;
    let dielectric = s.base_color * (1.0 - s.metallic);
    return Bsdf(
        dielectric * (1.0 - s.transmission),
        max(s.roughness * s.roughness, MIN_ALPHA),
        dielectric * s.transmission,
        s.specular + (1.0 - s.specular) * s.metallic,
        mix(f0, s.base_color, s.metallic),
        max(max(f0.x, f0.y), f0.z),
        s.specular,
    );
}

fn schlick(cosine: f32) -> f32 {
    let m = clamp(1.0 - cosine, 0.0, 1.0);
    return m * m * m * m * m;
}

// Schlick's Fresnel term of the specular lobe.
fn fresnel(b: Bsdf, cosine: f32) -> vec3f {
    return b.f0 + (vec3f(b.f90) - b.f0) * schlick(cosine);
}

// What the dielectric's surface takes from the lobes underneath.
fn reflectance(b: Bsdf, cosine: f32) -> f32 {
    return b.dielectric_f0 + (b.dielectric_f90 - b.dielectric_f0) * schlick(cosine);
}

// What is left for the diffuse lobe, relative to Lambert.
fn coupling(b: Bsdf, n_v: f32, n_l: f32) -> f32 {
    let mean = b.dielectric_f0 + (b.dielectric_f90 - b.dielectric_f0) / 21.0;
    let left = (1.0 - reflectance(b, n_v)) * (1.0 - reflectance(b, n_l));
    return select(left / (1.0 - mean), 0.0, mean >= 1.0);
}

// Smith's Λ at a direction whose cosine with the normal is c.
fn smith_lambda(c: f32, alpha: f32) -> f32 {
    let tan2 = max(1.0 - c * c, 0.0) / (c * c);
    return 0.5 * (sqrt(1.0 + alpha * alpha * tan2) - 1.0);
}

// D·G₂/(4 n·v n·l)·n·l of GGX, Fresnel left out, and v·h.
fn ggx_lobe(n: vec3f, v: vec3f, l: vec3f, n_v: f32, n_l: f32, alpha: f32) -> vec2f {
    let sum = v + l;
    let h = select(n, normalize(sum), dot(sum, sum) > 0.0);
    let a2 = alpha * alpha;
    // Written so, it keeps its digits near the peak.
    let across = cross(n, h);
    let n_h = dot(n, h);
    let t = dot(across, across) / a2 + n_h * n_h;
    let d = 1.0 / (PI * a2 * t * t);
    let shadowing = 1.0 + smith_lambda(n_v, alpha) + smith_lambda(n_l, alpha);
    return vec2f(d / (4.0 * n_v * shadowing), dot(v, h));
}

// f(v, l)·|n·l| for unit vectors; n lies on the viewer's side.
fn scattered(b: Bsdf, n: vec3f, v: vec3f, l: vec3f) -> vec3f {
    let n_v = dot(n, v);
    let n_l = dot(n, l);
    if n_v <= 0.0 || n_l == 0.0 {
        return vec3f(0.0);
    }
    if n_l > 0.0 {
        let lobe = ggx_lobe(n, v, l, n_v, n_l, b.alpha);
        let specular = fresnel(b, lobe.y) * lobe.x;
        return specular + b.diffuse * (coupling(b, n_v, n_l) * n_l / PI);
    }
    let mirrored = l - 2.0 * n_l * n;
    let lobe = ggx_lobe(n, v, mirrored, n_v, -n_l, b.alpha);
    return b.transmission * ((1.0 - reflectance(b, lobe.y)) * lobe.x);
}
