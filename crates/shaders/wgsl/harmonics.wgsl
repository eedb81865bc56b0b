// Spherical and zonal harmonics: twins of `light::sh` and `light::zh`.
//
// Coefficients come in groups of four, as the atlas packs them: a group is three texels.

// Y_lm(d) times a multiplier a band, in groups of four coefficients.
struct Lobe {
    g0: vec4f,
    g1: vec4f,
    g2: vec4f,
    g3: vec4f,
    g4: vec4f,
    g5: vec4f,
    g6: f32,
}

// Multipliers of bands 0 to 4.
struct Bands {
    b0: f32,
    b1: f32,
    b2: f32,
    b3: f32,
    b4: f32,
}

fn lobe(d: vec3f, bands: Bands) -> Lobe {
    let x = d.x;
    let y = d.y;
    let z = d.z;
    let x2 = x * x;
    let y2 = y * y;
    let z2 = z * z;
    return Lobe(
        vec4f(0.2820948 * bands.b0, 0.48860252 * bands.b1 * vec3f(y, z, x)),
        bands.b2 * vec4f(1.0925484 * x * y, 1.0925484 * y * z, 0.31539157 * (3.0 * z2 - 1.0), 1.0925484 * x * z),
        vec4f(
            bands.b2 * 0.5462742 * (x2 - y2),
            bands.b3 * 0.5900436 * y * (3.0 * x2 - y2),
            bands.b3 * 2.8906114 * x * y * z,
            bands.b3 * 0.4570458 * y * (5.0 * z2 - 1.0),
        ),
        bands.b3 * vec4f(
            0.37317633 * z * (5.0 * z2 - 3.0),
            0.4570458 * x * (5.0 * z2 - 1.0),
            1.4453057 * z * (x2 - y2),
            0.5900436 * x * (x2 - 3.0 * y2),
        ),
        bands.b4 * vec4f(
            2.503343 * x * y * (x2 - y2),
            1.7701308 * y * z * (3.0 * x2 - y2),
            0.9461747 * x * y * (7.0 * z2 - 1.0),
            0.6690465 * y * z * (7.0 * z2 - 3.0),
        ),
        bands.b4 * vec4f(
            0.10578555 * (35.0 * z2 * z2 - 30.0 * z2 + 3.0),
            0.6690465 * x * z * (7.0 * z2 - 3.0),
            0.47308735 * (x2 - y2) * (7.0 * z2 - 1.0),
            1.7701308 * x * z * (x2 - 3.0 * y2),
        ),
        bands.b4 * 0.6258357 * (x2 * (x2 - 3.0 * y2) - y2 * (3.0 * x2 - y2)),
    );
}

// The clamped cosine: turns radiance into irradiance.
fn cosine_bands() -> Bands {
    return Bands(PI, 2.0943951, 0.7853982, 0.0, -0.1308997);
}

// The specular lobe of GGX, normalised, for a perceptual roughness: the second paper's appendix A.
fn ggx_bands(roughness: f32) -> Bands {
    let r = vec4f(clamp(roughness, 0.0, 1.0));
    let offset = vec4f(0.27793123, 0.5937202, 0.2400839, 0.0002507005);
    let first = vec4f(0.90550125, 10.575183, 21.648092, 5.533406)
        * cos(r * vec4f(2.4922082, 3.4913207, 3.9251013, 3.9890213) + vec4f(2.8875563, 0.5667296, 0.50116944, 0.7050972));
    let second = vec4f(1.9874332, 9.528553, 19.906906, 3.233481)
        * cos(r * vec4f(1.7953715, 3.5860846, 4.01505, 4.63842) + vec4f(0.6362613, 3.606898, 3.5555115, 3.2514422));
    let slope = vec4f(1.5405431, 4.351719, 7.5814686, 9.844106);
    let linear = vec4f(-4.7317914e-4, -3.5867841, -6.4756713, -8.768045);
    let squared = vec4f(0.32961586, 0.29109984, 0.25094584, 0.21165547);
    let bands = offset + first + second + r * (slope * inverseSqrt(squared + r * r) + linear);
    return Bands(1.0, bands.x, bands.y, bands.z, bands.w);
}
