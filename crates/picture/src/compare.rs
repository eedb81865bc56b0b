//! All figures of two files.

use glam::Vec3;

use crate::tone::gamma_code;
use crate::{CompareError, ErrorMap, HdrFlip, Loaded, Pair, Picture};
use crate::{exposure, flip, hdr_flip, mse, psnr, relative_mse, ssim};

/// How far a picture is from its reference.
#[derive(Clone, Debug, PartialEq)]
pub struct Comparison {
    /// The factor that linear values were multiplied by; 1 where there were none.
    pub exposure: f32,
    /// Of display codes clamped to 0 to 1, dB; infinite for equal pictures.
    pub psnr: f64,
    /// Of display codes as they are, dB.
    pub psnr_unclamped: f64,
    /// Of display codes; nothing for pictures under 11 × 11.
    pub ssim: Option<f64>,
    /// Of display codes.
    pub flip: ErrorMap,
    /// Of linear values, if both files have them.
    pub flip_hdr: Option<HdrFlip>,
    /// Of linear values times the exposure.
    pub mse: f64,
    /// Of linear values times the exposure.
    pub relative_mse: f64,
}

/// Compares files. Without an `exposure` it is that of the reference ([`crate::exposure`]), or 1
/// where the reference holds codes.
///
/// Display codes are v^(1/2.2) of linear values times the exposure. Two files of codes are compared
/// by their codes as they are; codes against linear values are decoded by the curve of sRGB and
/// encoded like the others, and the exposure, which they went through already, is left out.
///
/// # Errors
/// As [`Pair::new`].
pub fn compare(
    reference: &Loaded,
    picture: &Loaded,
    exposure: Option<f32>,
    pixels_per_degree: f32,
) -> Result<Comparison, CompareError> {
    let stored = Pair::new(reference.stored(), picture.stored())?;
    let exposure = match (reference, picture) {
        (Loaded::Coded(_), Loaded::Coded(_)) => 1.0,
        (Loaded::Coded(_), Loaded::Linear(_)) => exposure.unwrap_or(1.0),
        (Loaded::Linear(linear), _) => exposure.unwrap_or_else(|| self::exposure(linear)),
    };
    let [a, b] = [reference, picture].map(|of| exposed(of, exposure));
    let linear = Pair::new(&a, &b)?;
    let [a, b] = match (reference, picture) {
        (Loaded::Coded(a), Loaded::Coded(b)) => [a.clone(), b.clone()],
        _ => [&a, &b].map(|of| of.map(gamma_code)),
    };
    let codes = Pair::new(&a, &b)?;
    let [a, b] = [&a, &b].map(|of| of.map(|code| code.clamp(Vec3::ZERO, Vec3::ONE)));
    let clamped = Pair::new(&a, &b)?;

    let both_linear = matches!((reference, picture), (Loaded::Linear(_), Loaded::Linear(_)));
    Ok(Comparison {
        exposure,
        psnr: psnr(&clamped),
        psnr_unclamped: psnr(&codes),
        ssim: ssim(&clamped),
        flip: flip(&clamped, pixels_per_degree),
        flip_hdr: both_linear.then(|| hdr_flip(&stored, pixels_per_degree)),
        mse: mse(&linear),
        relative_mse: relative_mse(&linear),
    })
}

/// Linear values, 1 of them white.
fn exposed(of: &Loaded, exposure: f32) -> Picture {
    match of {
        Loaded::Coded(_) => of.linear(),
        Loaded::Linear(picture) => picture.map(|p| p * exposure),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{PIXELS_PER_DEGREE, ToneMap};

    fn compared(a: &Loaded, b: &Loaded, exposure: Option<f32>) -> Comparison {
        compare(a, b, exposure, PIXELS_PER_DEGREE).expect("of one size")
    }

    #[test]
    fn kinds_of_files_meet_at_their_display_codes() {
        let light = Picture::from_fn(32, 24, |x, y| Vec3::new(x as f32, y as f32, 9.0) * 100.0);
        let linear = Loaded::Linear(light.clone());
        let same = compared(&linear, &linear, None);
        assert_eq!((same.psnr, same.flip.mean(), same.ssim), (f64::INFINITY, 0.0, Some(1.0)));
        assert_eq!(same.flip_hdr.as_ref().map(|f| f.map.mean()), Some(0.0));
        assert!((same.exposure - exposure(&light)).abs() < 1e-9);

        // The picture as a PNG of sRGB would store it, but for rounding.
        let coded = Loaded::Coded(light.map(|p| ToneMap::Srgb.encode(p * same.exposure)));
        let mixed = compared(&linear, &coded, None);
        assert!(mixed.psnr > 80.0 && mixed.flip_hdr.is_none(), "{}", mixed.psnr);
        let other_way = compared(&coded, &linear, Some(same.exposure));
        assert!((mixed.psnr - other_way.psnr).abs() < 1e-6);
        assert!(compared(&coded, &linear, None).psnr < 20.0, "exposure 1 is far too bright");
        assert_eq!(compared(&coded, &coded, Some(7.0)).exposure, 1.0);
    }

    #[test]
    fn what_is_too_bright_for_the_display_counts_unclamped_only() {
        let [a, b] =
            [4.0, 9.0].map(|v| Loaded::Linear(Picture::from_fn(12, 12, |_, _| Vec3::splat(v))));
        let found = compared(&a, &b, Some(1.0));
        assert_eq!(found.psnr, f64::INFINITY);
        // Codes are 4^(1/2.2) = 1.87787 and 2.71492.
        assert!((found.psnr_unclamped - 1.5455).abs() < 1e-3, "{}", found.psnr_unclamped);
        assert_eq!(found.mse, 25.0);
        assert!(found.flip_hdr.is_some_and(|f| f.map.mean() > 0.05));
    }
}
