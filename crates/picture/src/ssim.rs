//! Structural similarity.

use crate::plane::{Plane, gaussian, single};
use crate::{Pair, Picture};

/// Standard deviation of the window, pixels.
const SIGMA: f64 = 1.5;
/// The window has 11 × 11 pixels.
const RADIUS: usize = 5;
/// (K₁ L)² and (K₂ L)² for K₁ = 0.01, K₂ = 0.03 and codes of range L = 1.
const C1: f64 = 0.01 * 0.01;
const C2: f64 = 0.03 * 0.03;

/// Mean structural similarity of display codes, clamped to 0 to 1: at most 1, which equal pictures
/// have. Wang et al., *Image quality assessment: from error visibility to structural similarity*
/// (2004), equation 13, with the paper's Gaussian window of 11 × 11 pixels; the mean over the
/// three channels, each separately, and over the windows that lie within the picture. So does
/// scikit-image's `structural_similarity` with `gaussian_weights=True, sigma=1.5,
/// use_sample_covariance=False, data_range=1, channel_axis=2`.
///
/// Nothing for pictures that are smaller than the window.
pub fn ssim(codes: &Pair<'_>) -> Option<f64> {
    let (width, height) = (codes.reference().width() as usize, codes.reference().height() as usize);
    if width.min(height) < 2 * RADIUS + 1 {
        return None;
    }
    let window = single(&gaussian(SIGMA, RADIUS));
    Some((0..3).map(|channel| of_channel(codes, channel, &window)).sum::<f64>() / 3.0)
}

fn of_channel(codes: &Pair<'_>, channel: usize, window: &[f32]) -> f64 {
    let plane = |of: &Picture| Plane::of(of, |p| p[channel].clamp(0.0, 1.0) - 0.5);
    let (a, b) = (plane(codes.reference()), plane(codes.picture()));
    let mean = |of: &Plane| of.across(window).down(window);
    let mean_of_product = |a: &Plane, b: &Plane| {
        let values = a.values.iter().zip(&b.values).map(|(a, b)| a * b).collect();
        mean(&Plane { width: a.width, values })
    };
    let (mean_a, mean_b) = (mean(&a), mean(&b));
    let (aa, bb, ab) = (mean_of_product(&a, &a), mean_of_product(&b, &b), mean_of_product(&a, &b));

    let width = a.width;
    let height = a.values.len() / width;
    let mut sum = 0.0;
    for y in RADIUS..height - RADIUS {
        for i in y * width + RADIUS..(y + 1) * width - RADIUS {
            let [ma, mb, aa, bb, ab] =
                [&mean_a, &mean_b, &aa, &bb, &ab].map(|plane| f64::from(plane.values[i]));
            // Variances do not mind that codes were shifted by a half, which keeps them exact.
            let (va, vb, covariance) = (aa - ma * ma, bb - mb * mb, ab - ma * mb);
            let (ma, mb) = (ma + 0.5, mb + 0.5);
            sum += (2.0 * ma * mb + C1) * (2.0 * covariance + C2)
                / ((ma * ma + mb * mb + C1) * (va + vb + C2));
        }
    }
    sum / ((width - 2 * RADIUS) * (height - 2 * RADIUS)) as f64
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    #[test]
    fn flat_pictures_have_the_similarity_of_their_means() {
        let a = Picture::from_fn(16, 12, |_, _| Vec3::splat(0.5));
        let b = a.map(|p| p * 0.5);
        let of = |a, b| ssim(&Pair::new(a, b).expect("of one size")).expect("large enough");
        let expected = (2.0 * 0.5 * 0.25 + C1) / (0.25 + 0.0625 + C1);
        assert!((of(&a, &b) - expected).abs() < 1e-5);
        assert_eq!(of(&a, &a), 1.0);
        // Codes are clamped.
        let (white, brighter) = (a.map(|_| Vec3::ONE), a.map(|_| Vec3::splat(7.0)));
        assert_eq!(of(&white, &brighter), 1.0);
        let small = Picture::from_fn(10, 40, |_, _| Vec3::ZERO);
        assert_eq!(ssim(&Pair::new(&small, &small).expect("the same")), None);
    }
}
