//! A picture in memory.

use glam::Vec3;
use rayon::prelude::*;

use crate::PictureError;

/// Linear colour of Rec. 709 primaries, row by row from the top left, on whatever scale its maker
/// chose: cd/m² from a renderer, 0 to 1 from a photograph. 12 bytes a pixel; never empty.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    width: u32,
    height: u32,
    pixels: Vec<Vec3>,
}

impl Picture {
    /// From `width * height` pixels.
    ///
    /// # Errors
    /// There are none, or not as many.
    pub fn new(width: u32, height: u32, pixels: Vec<Vec3>) -> Result<Self, PictureError> {
        if width == 0 || height == 0 {
            return Err(PictureError::Empty { width, height });
        }
        if u64::from(width) * u64::from(height) != pixels.len() as u64 {
            return Err(PictureError::Length { width, height, given: pixels.len() });
        }
        Ok(Self { width, height, pixels })
    }

    /// From a function of column and row. A side of 0 counts as 1.
    pub fn from_fn(width: u32, height: u32, mut pixel: impl FnMut(u32, u32) -> Vec3) -> Self {
        let (width, height) = (width.max(1), height.max(1));
        let pixels =
            (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| pixel(x, y));
        Self { width, height, pixels: pixels.collect() }
    }

    /// Pixels in a row.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Rows.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// All pixels, row by row from the top left.
    pub fn pixels(&self) -> &[Vec3] {
        &self.pixels
    }

    /// All pixels, to be set.
    pub fn pixels_mut(&mut self) -> &mut [Vec3] {
        &mut self.pixels
    }

    /// The pixel of a column and a row, or nothing outside the picture.
    pub fn pixel(&self, x: u32, y: u32) -> Option<Vec3> {
        (x < self.width && y < self.height)
            .then(|| self.pixels[y as usize * self.width as usize + x as usize])
    }

    /// The picture with a function applied to every pixel.
    #[must_use]
    pub fn map(&self, of: impl Fn(Vec3) -> Vec3 + Sync) -> Self {
        let pixels = self.pixels.par_iter().map(|&p| of(p)).collect();
        Self { width: self.width, height: self.height, pixels }
    }
}

/// Luminance of linear colour, in its unit (Rec. ITU-R BT.709-6, section 3.2).
pub fn luminance(linear: Vec3) -> f32 {
    linear.dot(Vec3::new(0.2126, 0.7152, 0.0722))
}

/// The factor that brings the 99th percentile of a picture's luminance to 1; 1 where that is not
/// positive. Between ranks it is interpolated linearly; pixels that are not finite do not count.
pub fn exposure(reference: &Picture) -> f32 {
    let mut values: Vec<f32> =
        reference.pixels.iter().map(|&p| luminance(p)).filter(|y| y.is_finite()).collect();
    if values.is_empty() {
        return 1.0;
    }
    let rank = 0.99 * (values.len() - 1) as f64;
    let (_, &mut low, above) = values.select_nth_unstable_by(rank as usize, f32::total_cmp);
    let high = above.iter().copied().min_by(f32::total_cmp).unwrap_or(low);
    let factor = low + (high - low) * rank.fract() as f32;
    let factor = factor.recip();
    if factor > 0.0 && factor.is_finite() { factor } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_size_has_to_fit() {
        assert!(Picture::new(2, 3, vec![Vec3::ONE; 6]).is_ok());
        let wrong = Picture::new(2, 3, vec![Vec3::ONE; 5]).expect_err("five").to_string();
        assert!(wrong.contains('5') && wrong.contains("2 × 3"), "{wrong}");
        assert!(matches!(Picture::new(0, 3, Vec::new()), Err(PictureError::Empty { .. })));
    }

    #[test]
    fn rows_go_down_from_the_top_left() {
        let p = Picture::from_fn(3, 2, |x, y| Vec3::new(x as f32, y as f32, 0.0));
        assert_eq!(p.pixels()[5], Vec3::new(2.0, 1.0, 0.0));
        assert_eq!(p.pixel(1, 0), Some(p.pixels()[1]));
        assert_eq!(p.pixel(3, 0), None);
    }

    #[test]
    fn exposure_is_of_the_99th_percentile() {
        // 0, 1, … 200: the percentile is 198.
        let ramp = Picture::from_fn(201, 1, |x, _| Vec3::splat(x as f32));
        assert!((exposure(&ramp) * 198.0 - 1.0).abs() < 1e-5);
        // 0, 1, … 100 with one pixel of fire: 99 of ranks 0 to 100.
        let fire = Picture::from_fn(101, 1, |x, _| Vec3::splat(if x == 7 { 1e9 } else { 1.0 }));
        assert!((exposure(&fire) - 1.0).abs() < 1e-5);
        assert_eq!(exposure(&Picture::from_fn(5, 5, |_, _| Vec3::ZERO)), 1.0);
        assert_eq!(exposure(&Picture::from_fn(5, 5, |_, _| Vec3::NAN)), 1.0);
    }
}
