//! The regression: what features of surfaces explain of their light, block by block.

use glam::{IVec2, UVec2, Vec3};
use lumencast_gather::reference::{Sample, Surface};
use rayon::prelude::*;

/// A block has so many pixels along its side.
const BLOCK: usize = 32;
/// The features are 1, the normal, the position and the position squared.
const FEATURES: usize = 10;
/// The features that are brought to 0 to 1 in a block: those of the position.
const SCALED: std::ops::Range<usize> = 4..FEATURES;
/// The amplitude of the noise on features. Without it, the features of flat surfaces would depend on
/// each other, and there would be no one solution.
const NOISE: f32 = 1e-2;
/// Frames shift the grid of blocks to so many places in turn, so that no border of blocks stays.
const PLACES: u32 = 16;

type Features = [f32; FEATURES];
/// A pixel's features, and the three channels of its light.
type Row = [f32; FEATURES + 3];
/// A weight a feature and channel.
type Weights = [Vec3; FEATURES];

/// The light of every pixel with a surface: the combination of its features that in its block comes
/// nearest to `light` in the least squares, and is never negative.
pub(super) fn fit(
    size: UVec2,
    samples: &[Sample],
    light: &[Vec3],
    frame: u32,
) -> Vec<Option<Vec3>> {
    let begin = -place(frame);
    let count = (size.as_ivec2() - begin + (BLOCK as i32 - 1)) / BLOCK as i32;
    let corners = (0..count.x * count.y).into_par_iter();
    let blocks: Vec<Block> = corners
        .map(|n| {
            let corner = begin + BLOCK as i32 * IVec2::new(n % count.x, n / count.x);
            Block::fitted(size, corner, samples, light, frame)
        })
        .collect();
    let pixel = |(index, sample): (usize, &Sample)| {
        let surface = sample.surface.as_ref()?;
        let at = IVec2::new((index % size.x as usize) as i32, (index / size.x as usize) as i32);
        let [x, y] = ((at - begin) / BLOCK as i32).to_array();
        Some(blocks[(x + count.x * y) as usize].light(surface))
    };
    samples.par_iter().enumerate().map(pixel).collect()
}

/// How far left and up of the picture's corner the blocks of a frame begin: Halton's points.
fn place(frame: u32) -> IVec2 {
    let n = frame % PLACES + 1;
    let scaled = |base| (BLOCK as f32 * radical_inverse(n, base)) as i32;
    IVec2::new(scaled(2), scaled(3))
}

/// The number whose digits behind the point are those of `n`, backwards.
fn radical_inverse(mut n: u32, base: u32) -> f32 {
    let (mut value, mut digit) = (0.0, 1.0);
    while n > 0 {
        digit /= base as f32;
        value += digit * (n % base) as f32;
        n /= base;
    }
    value
}

/// A block's solution.
#[derive(Clone, Debug)]
struct Block {
    /// Least value and range of the scaled features.
    ranges: [(f32, f32); FEATURES],
    weights: Weights,
}

impl Block {
    /// The solution of the block whose upper left pixel is `corner`. Beyond its border the picture
    /// is mirrored. Pixels without a surface have no part but that of the noise.
    fn fitted(size: UVec2, corner: IVec2, samples: &[Sample], light: &[Vec3], frame: u32) -> Self {
        let pixels = (0..BLOCK * BLOCK).map(|i| {
            let x = mirrored(corner.x + (i % BLOCK) as i32, size.x);
            let y = mirrored(corner.y + (i / BLOCK) as i32, size.y);
            y * size.x as usize + x
        });
        let mut rows: Vec<Row> = pixels.map(|pixel| row(&samples[pixel], light[pixel])).collect();
        let ranges = ranges(&rows);
        for (n, row) in (0..).zip(&mut rows) {
            let is_known = is_known(row);
            for feature in 1..FEATURES {
                if is_known && SCALED.contains(&feature) {
                    row[feature] = scaled(row[feature], ranges[feature]);
                }
                row[feature] += NOISE * (2.0 * unit(n, feature as u32, frame) - 1.0);
            }
        }
        Self { ranges, weights: least_squares(&mut rows) }
    }

    /// The light of a surface by the solution.
    fn light(&self, surface: &Surface) -> Vec3 {
        let mut features = features(surface);
        for n in SCALED {
            features[n] = scaled(features[n], self.ranges[n]);
        }
        let terms = self.weights.iter().zip(features).map(|(weight, feature)| *weight * feature);
        terms.sum::<Vec3>().max(Vec3::ZERO)
    }
}

/// A pixel's row, of zeros where there is no surface.
fn row(sample: &Sample, light: Vec3) -> Row {
    let mut row = [0.0; FEATURES + 3];
    if let Some(surface) = &sample.surface {
        row[..FEATURES].copy_from_slice(&features(surface));
        row[FEATURES..].copy_from_slice(&light.to_array());
    }
    row
}

/// Whether a row is a surface's.
fn is_known(row: &Row) -> bool {
    row[0] != 0.0
}

fn features(surface: &Surface) -> Features {
    let (n, p) = (surface.normal, surface.position);
    [1.0, n.x, n.y, n.z, p.x, p.y, p.z, p.x * p.x, p.y * p.y, p.z * p.z]
}

/// Least value and range of each feature.
fn ranges(rows: &[Row]) -> [(f32, f32); FEATURES] {
    std::array::from_fn(|feature| {
        let values = || rows.iter().filter(|row| is_known(row)).map(|row| row[feature]);
        let least = values().fold(f32::INFINITY, f32::min);
        let most = values().fold(f32::NEG_INFINITY, f32::max);
        if least <= most { (least, most - least) } else { (0.0, 0.0) }
    })
}

/// A feature from 0 on, to 1 where its range is larger.
fn scaled(value: f32, (least, range): (f32, f32)) -> f32 {
    (value - least) / range.max(1.0)
}

/// An index in a picture that goes on as its own mirror image.
fn mirrored(index: i32, size: u32) -> usize {
    let size = size as i32;
    let at = index.rem_euclid(2 * size);
    at.min(2 * size - 1 - at) as usize
}

/// A number from 0 to 1, as good as chance, for three numbers.
pub(super) fn unit(a: u32, b: u32, c: u32) -> f32 {
    let mut x = u64::from(a) | u64::from(b) << 32 ^ u64::from(c) << 40;
    for factor in [0xbf58_476d_1ce4_e5b9, 0x94d0_49bb_1331_11eb, 0xd6e8_feb8_6659_fd93] {
        x = (x ^ x >> 29).wrapping_add(0x9e37_79b9_7f4a_7c15).wrapping_mul(factor);
    }
    (x >> 40) as f32 / (1 << 24) as f32
}

/// The weights with which features come nearest to the light of all rows in the least squares, by
/// Householder's triangularisation, which leaves the rows spoilt.
fn least_squares(rows: &mut [Row]) -> Weights {
    for column in 0..FEATURES {
        reflect(rows, column);
    }
    let mut weights = [Vec3::ZERO; FEATURES];
    for k in (0..FEATURES).rev() {
        let row = &rows[k];
        let known: Vec3 = (k + 1..FEATURES).map(|j| weights[j] * row[j]).sum();
        let light = Vec3::from_slice(&row[FEATURES..]);
        if row[k] != 0.0 {
            weights[k] = (light - known) / row[k];
        }
    }
    weights
}

/// Mirrors the rows from `k` on such that of column `k` nothing is left below its first entry.
fn reflect(rows: &mut [Row], k: usize) {
    let rows = &mut rows[k..];
    let length = rows.iter().map(|row| row[k] * row[k]).sum::<f32>().sqrt();
    if length == 0.0 {
        return;
    }
    // The sign that cancels no digits; the column then holds the mirror's normal v.
    let target = -length.copysign(rows[0][k]);
    rows[0][k] -= target;
    let half_square = length * rows[0][k].abs();
    let mut dots = [0.0; FEATURES + 3];
    for row in rows.iter() {
        let v = row[k];
        dots.iter_mut().zip(row).for_each(|(dot, value)| *dot += v * value);
    }
    for row in rows.iter_mut() {
        let v = row[k] / half_square;
        row[k + 1..].iter_mut().zip(&dots[k + 1..]).for_each(|(value, dot)| *value -= v * dot);
    }
    rows[0][k] = target;
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: UVec2 = UVec2::new(70, 45);

    /// A bent surface.
    fn surface(x: u32, y: u32) -> Surface {
        let position = Vec3::new(0.1 * x as f32, (0.2 * x as f32).sin(), 0.1 * y as f32);
        let normal = Vec3::new(-2.0 * (0.2 * x as f32).cos(), 1.0, 0.0).normalize();
        Surface { position, normal, base_color: Vec3::ONE }
    }

    fn samples(surface: impl Fn(u32, u32) -> Surface) -> Vec<Sample> {
        let pixels = (0..SIZE.y).flat_map(|y| (0..SIZE.x).map(move |x| (x, y)));
        let sample = |(x, y)| Sample { surface: Some(surface(x, y)), ..Sample::default() };
        pixels.map(sample).collect()
    }

    /// The largest error where `light` is fitted by the features of `samples`.
    fn worst(samples: &[Sample], light: impl Fn(&Surface) -> Vec3) -> f32 {
        let bent = self::samples(surface);
        let of = |s: &Sample| light(s.surface.as_ref().expect("one"));
        let light: Vec<_> = bent.iter().map(of).collect();
        let found = (0..3).map(|frame| fit(SIZE, samples, &light, frame));
        let error = |found: &Option<Vec3>, light: &Vec3| {
            (found.expect("a surface") - *light).abs().max_element()
        };
        let errors =
            found.flat_map(|f| f.iter().zip(&light).map(|(f, l)| error(f, l)).collect::<Vec<_>>());
        errors.fold(0.0, f32::max)
    }

    fn combined(s: &Surface) -> Vec3 {
        let (n, p) = (s.normal, s.position);
        Vec3::new(5.0 + n.x, 4.0 - 0.3 * p.x + 0.2 * p.z * p.z, 2.0 + 0.5 * n.y + 0.1 * p.x * p.x)
    }

    #[test]
    fn what_features_explain_comes_back() {
        let error = worst(&samples(surface), combined);
        assert!(error < 0.05, "{error}");
    }

    #[test]
    fn what_they_do_not_explain_is_lost() {
        let stripes = |s: &Surface| Vec3::splat(if s.position.z.fract() < 0.5 { 1.0 } else { 2.0 });
        assert!(worst(&samples(surface), stripes) > 0.3, "the check has no teeth");
        // A fault: features of another pixel.
        let shifted = samples(|x, y| surface(x + 5 * (y % 2), y));
        assert!(worst(&shifted, combined) > 0.3, "the check has no teeth");
    }

    #[test]
    fn a_plane_has_one_solution() {
        // Normal and height are the same everywhere: without noise, columns that depend on each other.
        let floor = samples(|x, y| Surface {
            position: Vec3::new(0.01 * x as f32, 2.0, 0.01 * y as f32),
            normal: Vec3::Y,
            base_color: Vec3::ONE,
        });
        let light: Vec<_> = floor.iter().map(|_| Vec3::new(1.0, 2.0, 3.0)).collect();
        for found in fit(SIZE, &floor, &light, 7) {
            let error = (found.expect("a surface") - Vec3::new(1.0, 2.0, 3.0)).abs().max_element();
            assert!(error < 0.02, "{found:?}");
        }
    }

    #[test]
    fn pixels_without_a_surface_have_no_part() {
        let mut samples = samples(surface);
        let light = vec![Vec3::splat(3.0); samples.len()];
        let bright: Vec<_> = (0..samples.len()).filter(|i| i % 5 > 0).collect();
        let mut light_of_holes = light;
        for &i in &bright {
            samples[i].surface = None;
            light_of_holes[i] = Vec3::splat(1e6);
        }
        let found = fit(SIZE, &samples, &light_of_holes, 0);
        for (sample, found) in samples.iter().zip(found) {
            assert_eq!(sample.surface.is_some(), found.is_some());
            assert!(found.is_none_or(|l| (l - 3.0).abs().max_element() < 0.05), "{found:?}");
        }
        samples.iter_mut().for_each(|s| s.surface = None);
        assert!(fit(SIZE, &samples, &light_of_holes, 0).iter().all(Option::is_none));
    }

    #[test]
    fn known_least_squares() {
        // Points of 1 + 2x with errors that cancel: x = 0, 1, 2, 3 and y = 1.1, 2.9, 4.9, 7.1.
        let mut rows = vec![[0.0; FEATURES + 3]; 12];
        for (row, (x, y)) in rows.iter_mut().zip([(0.0, 1.1), (1.0, 2.9), (2.0, 4.9), (3.0, 7.1)]) {
            (row[0], row[1], row[FEATURES]) = (1.0, x, y);
        }
        let weights = least_squares(&mut rows);
        assert!((weights[0].x - 1.0).abs() < 1e-5 && (weights[1].x - 2.0).abs() < 1e-5);
        assert!(weights[2..].iter().all(|w| *w == Vec3::ZERO));
    }

    #[test]
    fn blocks_move_and_mirrors_fold() {
        let places: std::collections::HashSet<_> = (0..PLACES).map(place).collect();
        assert!(places.len() == PLACES as usize);
        assert!(places.iter().all(|p| p.min_element() >= 0 && p.max_element() < BLOCK as i32));
        let folded = |i| mirrored(i, 3);
        assert_eq!([-4, -1, 0, 2, 3, 5, 6, 9].map(folded), [2, 0, 0, 2, 2, 0, 0, 2]);
    }
}
