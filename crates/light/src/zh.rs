//! Zonal harmonics: lobes that are symmetric about an axis, as one multiplier a band.
//!
//! Convolving light by a lobe multiplies all coefficients of band l by the lobe's number l
//! (Ramamoorthi and Hanrahan 2001, eq. 7, their factor √(4π/(2l+1)) already taken in).

/// Multipliers of bands 0 to 4.
pub type Bands = [f32; 5];

/// The clamped cosine: turns radiance (cd/m²) into irradiance (lux).
pub const COSINE: Bands = {
    use std::f32::consts::PI;
    [PI, 2.0 * PI / 3.0, PI / 4.0, 0.0, -PI / 24.0]
};

/// The specular lobe of GGX for a perceptual `roughness` from 0 (a mirror) to 1, normalised: the
/// fitted function of the second paper's appendix A.
///
/// The lobe is D(h)·cos θ with N = V = R and α = roughness²; the fit follows its numerical
/// integral to 3·10⁻⁴. At 1 it is the clamped cosine over π. Multiplied radiance is the mean
/// radiance that a surface with this lobe sees about the direction of reflection.
pub fn ggx(roughness: f32) -> Bands {
    const OFFSET: [f32; 4] = [0.277_931_23, 0.593_720_2, 0.240_083_9, 0.000_250_700_5];
    const FIRST: [[f32; 3]; 4] = [
        [0.905_501_25, 2.492_208_2, 2.887_556_3],
        [10.575_183, 3.491_320_7, 0.566_729_6],
        [21.648_092, 3.925_101_3, 0.501_169_44],
        [5.533_406, 3.989_021_3, 0.705_097_2],
    ];
    const SECOND: [[f32; 3]; 4] = [
        [1.987_433_2, 1.795_371_5, 0.636_261_3],
        [9.528_553, 3.586_084_6, 3.606_898],
        [19.906_906, 4.015_05, 3.555_511_5],
        [3.233_481, 4.638_42, 3.251_442_2],
    ];
    const LAST: [[f32; 3]; 4] = [
        [0.329_615_86, 1.540_543_1, -4.731_791_4e-4],
        [0.291_099_84, 4.351_719, -3.586_784_1],
        [0.250_945_84, 7.581_468_6, -6.475_671_3],
        [0.211_655_47, 9.844_106, -8.768_045],
    ];
    let r = roughness.clamp(0.0, 1.0);
    let wave = |[amplitude, frequency, phase]: [f32; 3]| amplitude * (r * frequency + phase).cos();
    let mut bands = [1.0; 5];
    for k in 0..4 {
        let [squared, slope, linear] = LAST[k];
        let rise = r * (slope / (squared + r * r).sqrt() + linear);
        bands[k + 1] = OFFSET[k] + wave(FIRST[k]) + wave(SECOND[k]) + rise;
    }
    bands
}

/// The Hann window of a width in bands, above 0: it falls from 1 at band 0 to 0 at that band, and
/// what lies beyond is cut off (Sloan 2008, "Stupid Spherical Harmonics (SH) Tricks"). Multiplied
/// radiance rings less, and is less sharp.
pub fn hann(width: f32) -> Bands {
    std::array::from_fn(|l| {
        let t = (l as f32 / width).min(1.0);
        0.5 + 0.5 * (std::f32::consts::PI * t).cos()
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f32::consts::PI;

    /// P_l(x), l = 0 to 4.
    fn legendre(x: f64) -> [f64; 5] {
        let x2 = x * x;
        [
            1.0,
            x,
            (3.0 * x2 - 1.0) / 2.0,
            (5.0 * x2 - 3.0) * x / 2.0,
            (35.0 * x2 * x2 - 30.0 * x2 + 3.0) / 8.0,
        ]
    }

    /// ∫ lobe(cos θ) P_l(cos θ) dω over the upper half of the sphere.
    fn integrate(lobe: impl Fn(f64) -> f64) -> [f64; 5] {
        const STEPS: usize = 20_000;
        let mut sums = [0.0; 5];
        for i in 0..STEPS {
            let x = (i as f64 + 0.5) / STEPS as f64;
            for (sum, p) in sums.iter_mut().zip(legendre(x)) {
                *sum += lobe(x) * p * std::f64::consts::TAU / STEPS as f64;
            }
        }
        sums
    }

    #[test]
    fn the_cosine_is_its_integral() {
        for (band, integral) in COSINE.into_iter().zip(integrate(|x| x)) {
            assert!((f64::from(band) - integral).abs() < 1e-6, "{band} {integral}");
        }
    }

    #[test]
    fn ggx_is_the_integral_of_its_lobe() {
        for roughness in [0.1_f64, 0.2, 0.35, 0.5, 0.7, 0.9, 1.0] {
            let alpha2 = roughness.powi(4);
            let lobe = |x: f64| {
                let half2 = (1.0 + x) / 2.0;
                x / (half2 * (alpha2 - 1.0) + 1.0).powi(2)
            };
            let integral = integrate(lobe);
            for (l, band) in ggx(roughness as f32).into_iter().enumerate() {
                let exact = integral[l] / integral[0];
                assert!((f64::from(band) - exact).abs() < 5e-4, "{roughness} {l}: {band} {exact}");
            }
        }
    }

    #[test]
    fn ggx_ends_at_an_impulse_and_at_the_cosine() {
        for (l, band) in ggx(0.0).into_iter().enumerate() {
            assert!((band - 1.0).abs() < 3e-4, "{l}: {band}");
        }
        for (l, (band, cosine)) in ggx(1.0).into_iter().zip(COSINE).enumerate() {
            assert!((band - cosine / PI).abs() < 5e-4, "{l}: {band}");
        }
    }

    /// Radiance of a distant light, cut off after band 2, is negative on its far side.
    #[test]
    fn a_window_takes_ringing_away() {
        let rings = |window: Bands| {
            let radiance = |x: f64| -> f64 {
                let terms = legendre(x).into_iter().zip(window).zip([1.0, 3.0, 5.0]);
                terms.map(|((p, w), degrees)| p * f64::from(w) * degrees).sum()
            };
            let least = (0..=200).map(|i| radiance(f64::from(i) / 100.0 - 1.0));
            least.fold(f64::INFINITY, f64::min) / radiance(1.0)
        };
        // By hand: (7.5 x² + 3 x − 1.5) / 9, and (1.875 x² + 2.25 x + 0.375) / 4.5.
        assert!((rings([1.0; 5]) + 0.2).abs() < 1e-3);
        assert!((rings(hann(3.0)) + 1.0 / 15.0).abs() < 1e-3);
        assert!((f64::from(hann(3.0)[1]) - 0.75).abs() < 1e-6);
        assert_eq!(hann(3.0)[3..], [0.0, 0.0]);
        assert!(hann(1e6).iter().all(|band| (band - 1.0).abs() < 1e-6));
    }

    #[test]
    fn ggx_falls_with_roughness_and_with_the_band() {
        // Figure 4.2 of the second paper. The fit wavers by less than its own error.
        let lobes: Vec<Bands> = (0..=100).map(|i| ggx(i as f32 / 100.0)).collect();
        for pair in lobes.windows(2) {
            assert!(pair[1].iter().zip(pair[0]).all(|(after, before)| *after <= before + 2e-4));
        }
        for lobe in &lobes[2..] {
            assert!(lobe.windows(2).all(|bands| bands[1] < bands[0]));
        }
    }
}
