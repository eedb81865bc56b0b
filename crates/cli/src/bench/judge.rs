//! How pictures are judged by the protocol of the published implementation's figures: codes, where
//! surfaces are seen, as they are and after a filter that takes most of the reference's noise away.

use std::fmt;
use std::sync::Arc;

use anyhow::{Result, ensure};
use glam::{UVec2, Vec3};
use lumencast_gather::reference::Film;
use lumencast_picture::{Pair, Picture, gamma_code, psnr};
use lumencast_scene::{Environment, Material, Snapshot, View};
use lumencast_shade::{Lighting, Renderer, Settings};
use serde::Serialize;

use super::drawing::draw;

/// Side of the filter that takes the reference's noise away, pixels.
const FILTER: u32 = 4;

/// How near a picture is to its reference, dB.
#[derive(Clone, Copy, Debug, Serialize)]
pub(super) struct Psnr {
    /// The PSNR of pixels as they are.
    pub(super) sharp: f64,
    /// The PSNR after the filter.
    pub(super) filtered: f64,
}

impl fmt::Display for Psnr {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:.1} ({:.1}) dB", self.sharp, self.filtered)
    }
}

/// What pictures are compared with, and where.
pub(super) struct Judge {
    reference: Picture,
    /// Which pixels show nothing but surfaces, row by row.
    covered: Vec<bool>,
    exposure: f32,
}

/// How a part of a picture differs from the reference, after the filter, in codes of 0 to 255.
#[derive(Clone, Copy, Debug, serde::Serialize)]
pub(super) struct Deviation {
    /// The mean of what is too much in each channel.
    pub(super) mean: Vec3,
    /// The root of the mean square over pixels and channels.
    pub(super) rms: f32,
}

impl Judge {
    /// # Errors
    /// The mask is of another size, or nothing is covered.
    pub(super) fn new(reference: Picture, covered: Vec<bool>, exposure: f32) -> Result<Self> {
        ensure!(covered.len() == reference.pixels().len(), "a mask of another size");
        ensure!(covered.contains(&true), "the camera sees no surface");
        Ok(Self { reference, covered, exposure })
    }

    pub(super) fn reference(&self) -> &Picture {
        &self.reference
    }

    /// PSNR over covered pixels, and over blocks of the filter that are covered all.
    pub(super) fn psnr(&self, picture: &Picture) -> Result<Psnr> {
        let everything = [UVec2::ZERO, self.size()];
        let of = |a: Vec<Vec3>, b: Vec<Vec3>| -> Result<f64> {
            let [a, b] = [a, b].map(|codes| Picture::new(codes.len() as u32, 1, codes));
            Ok(psnr(&Pair::new(&a?, &b?)?))
        };
        let shown = |p: &Picture| -> Vec<Vec3> {
            let covered = p.pixels().iter().zip(&self.covered).filter(|(_, covered)| **covered);
            covered.map(|(p, _)| self.code(*p)).collect()
        };
        let filtered = |p: &Picture| self.filtered(p, everything);
        Ok(Psnr {
            sharp: of(shown(&self.reference), shown(picture))?,
            filtered: of(filtered(&self.reference), filtered(picture))?,
        })
    }

    /// How a picture differs at a place.
    pub(super) fn deviation(&self, picture: &Picture, at: [UVec2; 2]) -> Deviation {
        let [a, b] = [&self.reference, picture].map(|p| self.filtered(p, at));
        let differences: Vec<Vec3> = a.iter().zip(&b).map(|(a, b)| 255.0 * (b - a)).collect();
        let mean = |of: &dyn Fn(&Vec3) -> Vec3| {
            differences.iter().map(of).sum::<Vec3>() / differences.len() as f32
        };
        Deviation {
            mean: mean(&|d| *d),
            rms: mean(&|d| *d * *d).dot(Vec3::splat(1.0 / 3.0)).sqrt(),
        }
    }

    /// How a picture's codes differ, twice enlarged: grey where they do not.
    pub(super) fn difference(&self, picture: &Picture) -> Picture {
        Picture::from_fn(picture.width(), picture.height(), |x, y| {
            let [a, b] = [&self.reference, picture]
                .map(|p| p.pixel(x, y).map_or(Vec3::ZERO, |p| self.code(p)));
            (0.5 + 2.0 * (b - a)).clamp(Vec3::ZERO, Vec3::ONE).powf(2.2)
        })
    }

    /// PSNR that a film's noise would leave by itself after the filter, were the film what is judged;
    /// infinite where it has none.
    pub(super) fn noise(&self, film: &Film) -> Result<f64> {
        let size = self.size();
        let half = |(sums, samples): (&[Vec3], u32)| -> Result<Vec<Vec3>> {
            let mean = sums.iter().map(|sum| *sum / samples.max(1) as f32).collect();
            Ok(self.filtered(&Picture::new(size.x, size.y, mean)?, [UVec2::ZERO, size]))
        };
        let [a, b] = film.parts();
        let (a, b) = (half(a)?, half(b)?);
        // The mean of two halves errs by half of what they differ by.
        let squares = a.iter().zip(&b).map(|(a, b)| (0.5 * (a - b)).as_dvec3().length_squared());
        Ok(-10.0 * (squares.sum::<f64>() / (3.0 * a.len() as f64)).log10())
    }

    /// The code by which a picture is displayed: v^(1/2.2), clamped.
    fn code(&self, linear: Vec3) -> Vec3 {
        gamma_code(linear * self.exposure).clamp(Vec3::ZERO, Vec3::ONE)
    }

    fn size(&self) -> UVec2 {
        UVec2::new(self.reference.width(), self.reference.height())
    }

    /// Codes of means over blocks of pixels that are covered all.
    fn filtered(&self, picture: &Picture, [from, to]: [UVec2; 2]) -> Vec<Vec3> {
        let blocks = (to - from) / FILTER;
        let width = picture.width();
        let block = |b: u32| {
            let corner = from + FILTER * UVec2::new(b % blocks.x, b / blocks.x);
            let pixel = |i: u32| {
                let at = corner + UVec2::new(i % FILTER, i / FILTER);
                let index = (at.y * width + at.x) as usize;
                self.covered[index].then(|| picture.pixels()[index])
            };
            let sum: Vec3 = (0..FILTER * FILTER).map(pixel).sum::<Option<Vec3>>()?;
            Some(self.code(sum / (FILTER * FILTER) as f32))
        };
        (0..blocks.element_product()).filter_map(block).collect()
    }
}

/// Which pixels show nothing but surfaces: those where no environment is seen, were there nothing
/// else that shines. The renderer's scene is another one afterwards.
pub(super) fn covered(
    renderer: &mut Renderer,
    snapshot: &Snapshot,
    view: View,
    settings: &Settings,
) -> Result<Vec<bool>> {
    let dark = |m: &Material| Material { emissive: Vec3::ZERO, ..m.clone() };
    let silhouette = Snapshot {
        materials: snapshot.materials.iter().map(dark).collect(),
        environment: Environment::Constant { radiance: Vec3::ONE },
        ..snapshot.clone()
    };
    renderer.set_scene(&Arc::new(silhouette));
    let picture = draw(renderer, view, settings, Lighting::NONE)?;
    Ok(picture.pixels().iter().map(|p| *p == Vec3::ZERO).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIDE: u32 = 8;

    fn picture(pixel: impl FnMut(u32, u32) -> Vec3) -> Picture {
        Picture::from_fn(SIDE, SIDE, pixel)
    }

    fn linear(code: f32) -> Vec3 {
        Vec3::splat(code.powf(2.2))
    }

    fn judge(reference: Picture, covered: impl Fn(u32) -> bool) -> Judge {
        Judge::new(reference, (0..SIDE * SIDE).map(covered).collect(), 1.0).expect("pixels")
    }

    /// Codes that are a tenth too high everywhere make 20 dB.
    #[test]
    fn it_is_the_error_of_codes() {
        let judge = judge(picture(|_, _| linear(0.5)), |_| true);
        let psnr = judge.psnr(&picture(|_, _| linear(0.6))).expect("a figure");
        assert!((psnr.sharp - 20.0).abs() < 1e-3 && (psnr.filtered - 20.0).abs() < 1e-3);
        let whiter =
            Judge::new(picture(|_, _| Vec3::splat(9.0)), judge.covered, 1.0).expect("pixels");
        let psnr = whiter.psnr(&picture(|_, _| linear(0.9))).expect("a figure");
        assert!((psnr.sharp - 20.0).abs() < 1e-3, "white is clamped: {psnr:?}");
    }

    /// A chequerboard beside its mean differs only before the filter.
    #[test]
    fn the_filter_takes_noise_away() {
        let judge = judge(picture(|_, _| Vec3::splat(0.25)), |_| true);
        let noisy = picture(|x, y| Vec3::splat(if (x + y) % 2 == 0 { 0.0 } else { 0.5 }));
        let psnr = judge.psnr(&noisy).expect("a figure");
        assert!(psnr.sharp < 10.0 && psnr.filtered > 80.0, "{psnr:?}");
    }

    #[test]
    fn only_covered_pixels_count() {
        let wrong_at_the_left = picture(|x, _| linear(if x < 2 { 1.0 } else { 0.6 }));
        let judge = judge(picture(|_, _| linear(0.5)), |i| i % SIDE >= 2);
        let psnr = judge.psnr(&wrong_at_the_left).expect("a figure");
        assert!((psnr.sharp - 20.0).abs() < 1e-3 && (psnr.filtered - 20.0).abs() < 1e-3);
        assert!(Judge::new(picture(|_, _| Vec3::ONE), vec![false; 64], 1.0).is_err());
        assert!(Judge::new(picture(|_, _| Vec3::ONE), vec![true; 63], 1.0).is_err());
    }

    #[test]
    fn a_deviation_is_that_of_its_place() {
        let judge = judge(picture(|_, _| linear(0.5)), |_| true);
        let red = Vec3::new(0.7_f32.powf(2.2), 0.5_f32.powf(2.2), 0.4_f32.powf(2.2));
        let right = picture(|x, _| if x < 4 { Vec3::ZERO } else { red });
        let place = [UVec2::new(4, 0), UVec2::new(8, 8)];
        let Deviation { mean, rms } = judge.deviation(&right, place);
        assert!((mean - Vec3::new(51.0, 0.0, -25.5)).abs().max_element() < 0.01, "{mean}");
        assert!((rms - (51.0_f32.powi(2) / 3.0 + 25.5_f32.powi(2) / 3.0).sqrt()).abs() < 0.01);
    }
}
