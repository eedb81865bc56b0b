// Spherical and zonal harmonics: twins of `light::sh` and `light::zh`.
//
// Coefficients come in groups of four, as the atlas packs them: a group is three texels.

#import common/math

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
