//! One channel of a picture, and separable filters.

use rayon::prelude::*;

use crate::Picture;

/// One number a pixel, row by row from the top left.
#[derive(Clone, Debug)]
pub(crate) struct Plane {
    pub(crate) width: usize,
    pub(crate) values: Vec<f32>,
}

impl Plane {
    /// A number for every pixel.
    pub(crate) fn of(picture: &Picture, value: impl Fn(glam::Vec3) -> f32 + Sync) -> Self {
        let values = picture.pixels().par_iter().map(|&p| value(p)).collect();
        Self { width: picture.width() as usize, values }
    }

    /// Filtered along rows by a kernel of odd length, centred; beyond the sides the outermost
    /// pixels go on. The kernel is not mirrored: its first tap is for the leftmost pixel.
    pub(crate) fn across(&self, kernel: &[f32]) -> Self {
        let radius = kernel.len() / 2;
        let mut values = vec![0.0; self.values.len()];
        values.par_chunks_exact_mut(self.width).zip(self.rows()).for_each_init(
            || vec![0.0; self.width + 2 * radius],
            |padded, (out, row)| {
                padded[..radius].fill(row[0]);
                padded[radius..][..self.width].copy_from_slice(row);
                padded[radius + self.width..].fill(row[self.width - 1]);
                for (offset, tap) in kernel.iter().enumerate() {
                    for (sum, value) in out.iter_mut().zip(&padded[offset..]) {
                        *sum += tap * value;
                    }
                }
            },
        );
        Self { width: self.width, values }
    }

    /// The same along columns; the first tap is for the topmost pixel.
    pub(crate) fn down(&self, kernel: &[f32]) -> Self {
        let (radius, last) = (kernel.len() / 2, self.values.len() / self.width - 1);
        let mut values = vec![0.0; self.values.len()];
        values.par_chunks_exact_mut(self.width).enumerate().for_each(|(y, out)| {
            for (offset, tap) in kernel.iter().enumerate() {
                let from = (y + offset).saturating_sub(radius).min(last);
                let row = &self.values[from * self.width..][..self.width];
                for (sum, value) in out.iter_mut().zip(row) {
                    *sum += tap * value;
                }
            }
        });
        Self { width: self.width, values }
    }

    fn rows(&self) -> rayon::slice::ChunksExact<'_, f32> {
        self.values.par_chunks_exact(self.width)
    }
}

/// A Gaussian of standard deviation `sigma` pixels at −radius to radius, that sums to 1.
pub(crate) fn gaussian(sigma: f64, radius: usize) -> Vec<f64> {
    let taps: Vec<f64> = offsets(radius).map(|x| (-x * x / (2.0 * sigma * sigma)).exp()).collect();
    let sum: f64 = taps.iter().sum();
    taps.into_iter().map(|t| t / sum).collect()
}

/// The offsets of a kernel's taps, pixels.
pub(crate) fn offsets(radius: usize) -> impl Iterator<Item = f64> {
    (0..=2 * radius).map(move |i| i as f64 - radius as f64)
}

/// A kernel as it is applied.
pub(crate) fn single(kernel: &[f64]) -> Vec<f32> {
    kernel.iter().map(|&t| t as f32).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn filters_are_those_of_the_definition() {
        let (width, height) = (7_i32, 5_i32);
        let values: Vec<f32> = (0..35).map(|i| ((i * 37) % 11) as f32).collect();
        let plane = Plane { width: 7, values: values.clone() };
        let (h, v) = ([0.5, -2.0, 3.0, 0.25, 1.0], [1.0, 2.0, -0.5]);
        let filtered = plane.across(&h).down(&v);
        for y in 0..height {
            for x in 0..width {
                let mut sum = 0.0;
                for (j, b) in (-1..).zip(v) {
                    for (i, a) in (-2..).zip(h) {
                        let (px, py) = ((x + i).clamp(0, width - 1), (y + j).clamp(0, height - 1));
                        sum += a * b * values[(py * width + px) as usize];
                    }
                }
                assert!((filtered.values[(y * width + x) as usize] - sum).abs() < 1e-4, "{x} {y}");
            }
        }
    }
}
