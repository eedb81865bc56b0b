//! Mean squared errors.

use glam::Vec3;
use rayon::prelude::*;

use crate::Pair;

/// Mean of (picture − reference)² over pixels and channels, in the unit of the values squared.
pub fn mse(pair: &Pair<'_>) -> f64 {
    mean(pair, |_| Vec3::ONE)
}

/// Mean of (picture − reference)² / (reference² + 0.01) over pixels and channels, as Rousselle et
/// al. (*Adaptive sampling and reconstruction using greedy error minimization*, 2011) and many after
/// them; the 0.01 is meant for pictures whose white is 1, so bring them to that
/// ([`crate::exposure`]) first.
pub fn relative_mse(pair: &Pair<'_>) -> f64 {
    mean(pair, |reference| (reference * reference + 0.01).recip())
}

/// Peak signal-to-noise ratio for a peak of 1, dB: −10 log₁₀ of the mean squared error. Infinite
/// for equal pictures. Meant for display codes.
pub fn psnr(pair: &Pair<'_>) -> f64 {
    -10.0 * mse(pair).log10()
}

fn mean(pair: &Pair<'_>, weight: impl Fn(Vec3) -> Vec3 + Sync) -> f64 {
    let (reference, picture) = (pair.reference().pixels(), pair.picture().pixels());
    let width = pair.reference().width() as usize;
    // Sums of rows, added in their order, so that a figure does not depend on the threads.
    let rows: Vec<f64> = reference
        .par_chunks(width)
        .zip(picture.par_chunks(width))
        .map(|(reference, picture)| {
            let of = |(&r, &p): (&Vec3, &Vec3)| {
                let difference = (p - r).as_dvec3();
                (difference * difference * weight(r).as_dvec3()).element_sum()
            };
            reference.iter().zip(picture).map(of).sum()
        })
        .collect();
    rows.iter().sum::<f64>() / (3 * reference.len()) as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Picture;

    #[test]
    fn figures_follow_their_definitions() {
        let reference = Picture::from_fn(3, 2, |_, _| Vec3::new(0.5, 0.25, 0.0));
        let picture = reference.map(|p| p + Vec3::new(0.1, 0.0, -0.2));
        let pair = Pair::new(&reference, &picture).expect("of one size");
        assert!((mse(&pair) - 0.05 / 3.0).abs() < 1e-8);
        assert!((psnr(&pair) - 17.781_512_5).abs() < 1e-5);
        let relative = (0.01 / 0.26 + 0.04 / 0.01) / 3.0;
        assert!((relative_mse(&pair) - relative).abs() < 1e-5 * relative);
        let same = Pair::new(&reference, &reference).expect("the same");
        assert_eq!((mse(&same), psnr(&same), relative_mse(&same)), (0.0, f64::INFINITY, 0.0));
    }
}
