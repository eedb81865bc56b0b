// Light of the field, scattered by surfaces.

#import common/harmonics
#import common/math
#import field/light
#import shade/ambient
#import shade/frame_bindings
#import shade/lumels
#import surface/bsdf
#import surface/site

// Light of the field, chapter 4.2.2 of the second paper: diffuse by convolution with its lobe, specular by
// the split sum, the mean radiance under the lobe times the environment BRDF. Light through a thin surface
// comes from the mirror image of that lobe. The material's occlusion is of the side that is seen: light
// from behind it leaves alone. So is `visible`, what ambient occlusion leaves; both tell of the same
// crevices, of which each counts once.
//
// Where the point has lumels, what arrives at them is scattered diffusely in place of the field's light.
// They know what hides light nearby: `visible` leaves it alone.
fn indirect_light(
    b: Bsdf,
    at: Site,
    lumels: Lumels,
    roughness: f32,
    occlusion: f32,
    visible: f32,
) -> vec3f {
    let n = at.normal;
    let n_v = dot(n, at.view);
    let table = table_at(n_v, roughness);
    let by = textureSampleLevel(environment_brdf, table_sampler, table, 0.0);
    let toward = mean_direction(n, at.view, by.zw);
    let bands = specular_bands(length(by.zw), table);
    var light = field_light(at.position, n, lobe(n, diffuse_bands(b)), lobe(toward, bands));
    let under = 1.0 - reflectance(b, n_v);
    var of_diffuse = vec3f(occlusion);
    var of_specular = occlusion;
    if OCCLUDED {
        of_specular = min(of_specular, visible);
    }
    let share = lumel_share(lumels);
    if OCCLUDED {
        of_diffuse = mix(min(of_diffuse, many_bounces(visible, b.diffuse)), of_diffuse, share);
    }
    if share > 0.0 {
        light.a = toward_lumels(light.a, lumel_light(lumels, n), share);
    }
    var sum = b.diffuse * under * of_diffuse * light.a / PI;
    sum += (b.f0 * by.x + b.f90 * by.y) * specular_occlusion(n_v, of_specular, b.alpha) * light.b;
    if any(b.transmission > vec3f(0.0)) {
        let through = lobe(reflect(toward, n), bands);
        let behind = field_light(at.position, -n, through, through);
        let share = (1.0 - b.dielectric_f0) * by.x + (1.0 - b.dielectric_f90) * by.y;
        sum += b.transmission * share * behind.a;
    }
    return sum;
}

// The diffuse lobe's share of light by its direction, `coupling` times the clamped cosine, as multipliers of
// bands, times what the direction of sight leaves: exact for light of any order. Schlick's term has the
// bands 2π ∫ c (1 − c)⁵ P_l(c) dc over 0 ≤ c ≤ 1.
fn diffuse_bands(b: Bsdf) -> Bands {
    let grazing = b.dielectric_f90 - b.dielectric_f0;
    let mean = b.dielectric_f0 + grazing / 21.0;
    if mean >= 1.0 {
        return Bands();
    }
    let straight = (1.0 - b.dielectric_f0) / (1.0 - mean);
    let lost = grazing / (1.0 - mean);
    let cosine = cosine_bands();
    return Bands(
        straight * cosine.b0 - lost * 0.14959965,
        straight * cosine.b1 - lost * 0.037399913,
        straight * cosine.b2 + lost * 0.05609987,
        lost * 0.043633231,
        straight * cosine.b4 - lost * 0.019266622,
    );
}

// The direction about which the specular lobe is round, its mean, of which the parts along the mirrored
// direction and across it are given.
fn mean_direction(n: vec3f, v: vec3f, mean: vec2f) -> vec3f {
    let mirrored = reflect(-v, n);
    let across = n - dot(n, mirrored) * mirrored;
    return normalize(mean.x * mirrored + mean.y * across * inverseSqrt(max(dot(across, across), 1e-8)));
}

// The specular lobe's bands, of which 1 is the length of its mean.
fn specular_bands(length_of_mean: f32, table: vec2f) -> Bands {
    let higher = textureSampleLevel(environment_brdf, table_sampler, table + vec2f(0.5, 0.0), 0.0);
    return Bands(1.0, length_of_mean, higher.x, higher.y, higher.z);
}

// The share of light that arrives at a place of which so much is visible, when what hides it has the
// same albedo and scatters light itself: the fit of Jiménez et al. 2016.
fn many_bounces(visible: f32, albedo: vec3f) -> vec3f {
    let a = 2.0404 * albedo - 0.3324;
    let b = -4.7951 * albedo + 0.6417;
    let c = 2.7552 * albedo + 0.6903;
    return clamp(((visible * a + b) * visible + c) * visible, vec3f(visible), vec3f(1.0));
}

// What occlusion leaves of the specular lobe: of a smooth surface seen from above more than of the
// diffuse one, at grazing angles less. An empirical formula, Lagarde and de Rousiers 2014 ("Moving
// Frostbite to PBR"), of α; three.js puts perceptual roughness there. 1 where nothing is occluded.
fn specular_occlusion(n_v: f32, occlusion: f32, alpha: f32) -> f32 {
    return saturate(pow(n_v + occlusion, exp2(-16.0 * alpha - 1.0)) - 1.0 + occlusion);
}

// Where the left half of the table has a cosine and a roughness: its outermost texels stand for 0 and 1.
fn table_at(cosine: f32, roughness: f32) -> vec2f {
    let side = f32(textureDimensions(environment_brdf).y);
    return (saturate(vec2f(cosine, roughness)) * (side - 1.0) + 0.5) / side * vec2f(0.5, 1.0);
}
