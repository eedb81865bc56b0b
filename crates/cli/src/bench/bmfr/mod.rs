//! Blockwise multi-order feature regression (Koskela, Immonen, Mäkitalo, Foi, Viitanen, Jääskeläinen,
//! Kultala and Takala 2019, ACM Transactions on Graphics 38, 5): a denoiser for real-time path tracing
//! of one sample a pixel, to compare fields with.
//!
//! Light is divided by the base colour of the surface that is seen first, averaged over frames, in
//! every block of pixels replaced by what features of the surfaces explain of it, averaged again,
//! multiplied by the base colour, and passed through temporal antialiasing. Shares of new frames and
//! the features are those of the published implementation.
//!
//! The camera stands still, so that a pixel's history is its own: nothing is reprojected, and no
//! history is thrown away. What surfaces and the environment send out by themselves has no noise:
//! it is left out of the fit, and added afterwards.

mod fit;
mod taa;

use glam::{UVec2, Vec3};
use lumencast_gather::reference::{Frame, Sample};
use lumencast_picture::{Picture, PictureError, gamma_code};

/// A new frame's least share in the averages before and after the fit.
const BEFORE: f32 = 0.2;
const AFTER: f32 = 0.1;
/// Base colours below this count as this: so much of what a black surface receives it still reflects.
const DARKEST: f32 = 0.04;

/// The denoiser, and what it remembers of earlier frames.
#[derive(Debug)]
pub(super) struct Bmfr {
    size: UVec2,
    exposure: f32,
    frames: u32,
    before: History,
    after: History,
    /// The last picture as display codes.
    shown: Vec<Vec3>,
}

impl Bmfr {
    /// A denoiser that has seen no frame. Edges are smoothed among codes at this exposure.
    pub(super) fn new(size: UVec2, exposure: f32) -> Self {
        let pixels = size.x as usize * size.y as usize;
        let [before, after] = [BEFORE, AFTER].map(|least| History::new(pixels, least));
        Self { size, exposure, frames: 0, before, after, shown: Vec::new() }
    }

    /// Takes the next frame in.
    pub(super) fn add(&mut self, frame: &Frame) {
        let light: Vec<_> = frame.samples.iter().map(demodulated).collect();
        self.before.add(&light);
        let fitted = fit::fit(self.size, &frame.samples, &self.before.mean, self.frames);
        self.after.add(&fitted);
        let picture = frame.samples.iter().zip(&self.after.mean).map(|(s, &l)| modulated(s, l));
        let white = |radiance: Vec3| (radiance * self.exposure).clamp(Vec3::ZERO, Vec3::ONE);
        let codes: Vec<Vec3> = picture.map(|radiance| gamma_code(white(radiance))).collect();
        self.shown = taa::smoothed(self.size, &codes, &self.shown);
        self.frames += 1;
    }

    /// The picture in linear colour, at most as bright as white at the exposure.
    ///
    /// # Errors
    /// No frame was taken in.
    pub(super) fn picture(&self) -> Result<Picture, PictureError> {
        let linear = |code: &Vec3| code.max(Vec3::ZERO).powf(2.2) / self.exposure;
        Picture::new(self.size.x, self.size.y, self.shown.iter().map(linear).collect())
    }
}

/// About the light that a surface receives; nothing where no surface is seen.
fn demodulated(sample: &Sample) -> Option<Vec3> {
    let surface = sample.surface?;
    Some((sample.radiance - sample.emitted) / surface.base_color.max(Vec3::splat(DARKEST)))
}

/// The radiance of a sample whose surface receives `light`.
fn modulated(sample: &Sample, light: Vec3) -> Vec3 {
    let color = sample.surface.map_or(Vec3::ZERO, |s| s.base_color.max(Vec3::splat(DARKEST)));
    sample.emitted + color * light
}

/// An average over frames, pixel by pixel: of all until a new one would count less than `least`,
/// exponential from then on.
#[derive(Debug)]
struct History {
    least: f32,
    mean: Vec<Vec3>,
    counts: Vec<u32>,
}

impl History {
    fn new(pixels: usize, least: f32) -> Self {
        Self { least, mean: vec![Vec3::ZERO; pixels], counts: vec![0; pixels] }
    }

    /// Adds the pixels that there are.
    fn add(&mut self, frame: &[Option<Vec3>]) {
        for ((mean, count), new) in self.mean.iter_mut().zip(&mut self.counts).zip(frame) {
            if let Some(new) = new {
                *count += 1;
                *mean = mean.lerp(*new, (*count as f32).recip().max(self.least));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use lumencast_gather::reference::Surface;

    const SIZE: UVec2 = UVec2::new(80, 50);

    /// A floor whose stripes of dark and bright receive light that falls off to one side, seen with so
    /// much noise; a lamp in the corner.
    fn frame(noise: f32, seed: u32) -> Frame {
        let pixels = (0..SIZE.y).flat_map(|y| (0..SIZE.x).map(move |x| (x, y)));
        let sample = |(x, y): (u32, u32)| {
            if x < 8 && y < 8 {
                return Sample { radiance: Vec3::ONE, emitted: Vec3::ONE, surface: None };
            }
            let base_color = Vec3::splat(if x / 3 % 2 == 0 { 0.1 } else { 0.9 });
            let factor = 1.0 + noise * (2.0 * fit::unit(x + SIZE.x * y, 99, seed) - 1.0);
            let light = light(x) * factor;
            let position = Vec3::new(0.1 * x as f32, 0.0, 0.1 * y as f32);
            let surface = Surface { position, normal: Vec3::Y, base_color };
            Sample { radiance: base_color * light, emitted: Vec3::ZERO, surface: Some(surface) }
        };
        Frame { size: SIZE, samples: pixels.map(sample).collect() }
    }

    fn light(x: u32) -> f32 {
        0.3 + 0.5 * x as f32 / SIZE.x as f32
    }

    /// Root mean square error of what is made of some frames.
    fn error(frames: impl Iterator<Item = Frame>) -> f32 {
        let mut denoiser = Bmfr::new(SIZE, 1.0);
        frames.for_each(|frame| denoiser.add(&frame));
        difference(denoiser.picture().expect("frames").pixels())
    }

    fn difference(pixels: &[Vec3]) -> f32 {
        let truth = frame(0.0, 0);
        let square = |(a, b): (&Vec3, &Sample)| (*a - b.radiance).length_squared();
        let sum: f32 = pixels.iter().zip(&truth.samples).map(square).sum();
        (sum / (3 * pixels.len()) as f32).sqrt()
    }

    #[test]
    fn noise_goes_and_textures_and_lamps_stay() {
        let raw: Vec<_> = frame(1.0, 0).samples.iter().map(|s| s.radiance).collect();
        let raw = difference(&raw);
        let frames = |count| error((0..count).map(|seed| frame(1.0, seed)));
        assert!(raw > 0.1, "{raw}");
        assert!(frames(1) < 0.3 * raw, "{} of {raw}", frames(1));
        assert!(frames(40) < 0.05 * raw, "{} of {raw}", frames(40));
        assert!(Bmfr::new(SIZE, 1.0).picture().is_err());
    }

    /// Without the division by the base colour, stripes would be taken for noise.
    #[test]
    fn a_texture_that_is_not_told_is_lost() {
        let untold = |mut frame: Frame| {
            for sample in &mut frame.samples {
                if let Some(surface) = &mut sample.surface {
                    surface.base_color = Vec3::ONE;
                }
            }
            frame
        };
        let error = error((0..20).map(|seed| untold(frame(0.0, seed))));
        assert!(error > 0.1, "{error}");
    }

    #[test]
    fn history_is_a_mean_until_it_is_long() {
        let mut history = History::new(2, 0.25);
        for value in [8.0, 4.0, 0.0] {
            history.add(&[Some(Vec3::splat(value)), None]);
        }
        assert!((history.mean[0].x - 4.0).abs() < 1e-5 && history.mean[1] == Vec3::ZERO);
        for _ in 0..2 {
            history.add(&[Some(Vec3::splat(8.0)), Some(Vec3::ONE)]);
        }
        // 4 → 5 → 5.75: never less than a quarter of a new frame.
        assert!((history.mean[0].x - 5.75).abs() < 1e-5 && history.mean[1] == Vec3::ONE);
    }
}
