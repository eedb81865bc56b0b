//! Mean luminance of the texture of each emissive triangle. Triangles are chosen by it.
//!
//! The texture is integrated over the triangle's footprint in it, line by line, with two lines for
//! each row of texels. Running sums along the texture's rows give the integral of a line. So a
//! line's cost depends neither on how many texels it crosses nor on how often the texture repeats.
//! The sums take 4 bytes a texel while new triangles are measured. The results are kept with the
//! mesh.
//!
//! Only the texture's own luminance is measured, so a change of the emitted colour changes nothing
//! here. The result only guides the choice of triangles. It is 0 only where the texture is black.

use std::collections::HashMap;
use std::sync::Arc;

use glam::{DVec2, Vec2, Vec3};
use lumencast_scene::{Filter, Image, Mesh, TextureRef, Wrap};

use crate::sampling::luminance;
use crate::surface::texture::{Coding, color, interpolate_uv, sample, wrapped};

/// Footprints of fewer texels are sampled at points.
const FEW_TEXELS: f64 = 8.0;
/// Steps along each side into which such small footprints are divided.
const STEPS: u32 = 8;
/// Least and greatest number of lines of a footprint. The greatest is prime, so that lines do not
/// align with a texture that repeats very often.
const LINES: [f64; 2] = [8.0, 16_381.0];

/// Mean luminance of textures over triangles, kept from snapshot to snapshot.
#[derive(Debug, Default)]
pub(crate) struct EmissionCache {
    /// Means by the mesh's address and the primitive's index.
    kept: HashMap<(usize, u32), Kept>,
    /// Row sums by the image's address; only kept while a snapshot is prepared.
    sums: HashMap<usize, RowSums>,
}

#[derive(Debug)]
struct Kept {
    #[expect(dead_code, reason = "keeps the address from being used again")]
    mesh: Arc<Mesh>,
    texture: TextureRef,
    means: Arc<[f32]>,
    used: bool,
}

impl EmissionCache {
    /// Mean luminance of a texture over each triangle of a primitive.
    pub(crate) fn means(
        &mut self,
        mesh: &Arc<Mesh>,
        primitive: u32,
        texture: &TextureRef,
    ) -> Arc<[f32]> {
        let key = (Arc::as_ptr(mesh).addr(), primitive);
        if let Some(kept) = self.kept.get_mut(&key)
            && is_same(&kept.texture, texture)
        {
            kept.used = true;
            return kept.means.clone();
        }
        let sums = self
            .sums
            .entry(Arc::as_ptr(&texture.image).addr())
            .or_insert_with(|| RowSums::new(&texture.image));
        let p = &mesh.primitives[primitive as usize];
        let uv = &p.uv[texture.tex_coord.min(1)];
        let mean = |corners: &[u32; 3]| {
            let at = |weights| interpolate_uv(uv, *corners, weights);
            mean(texture, sums, [at(Vec3::X), at(Vec3::Y), at(Vec3::Z)])
        };
        let means: Arc<[f32]> = p.triangles.iter().map(mean).collect();
        let (mesh, texture) = (mesh.clone(), texture.clone());
        self.kept.insert(key, Kept { mesh, texture, means: means.clone(), used: true });
        means
    }

    /// Drops what the current snapshot did not ask for; call it after the snapshot's last call of
    /// `means`.
    pub(crate) fn finish(&mut self) {
        self.sums.clear();
        self.kept.retain(|_, kept| std::mem::take(&mut kept.used));
    }
}

fn is_same(a: &TextureRef, b: &TextureRef) -> bool {
    Arc::ptr_eq(&a.image, &b.image)
        && (a.tex_coord, a.texture_from_mesh, a.wrap, a.filter)
            == (b.tex_coord, b.texture_from_mesh, b.wrap, b.filter)
}

/// Mean luminance of a texture over a triangle.
fn mean(texture: &TextureRef, sums: &RowSums, uv: [Vec2; 3]) -> f32 {
    let size = DVec2::new(sums.width as f64, f64::from(texture.image.height));
    let corners = uv.map(|uv| texture.texture_from_mesh.transform_point2(uv).as_dvec2() * size);
    let [a, b, c] = corners;
    let area = 0.5 * (b - a).perp_dot(c - a).abs();
    if area >= FEW_TEXELS && area.is_finite() {
        over_lines(texture, sums, corners)
    } else {
        at_points(texture, uv)
    }
}

/// The mean over the centres of small triangles of equal size.
fn at_points(texture: &TextureRef, [a, b, c]: [Vec2; 3]) -> f32 {
    let at = |i: u32, j: u32, third: f32| {
        let [v, w] = [i, j].map(|k| (k as f32 + third / 3.0) / STEPS as f32);
        luminance(sample(texture, a + v * (b - a) + w * (c - a), Coding::Srgb).truncate())
    };
    let upright = (0..STEPS).flat_map(|i| (0..STEPS - i).map(move |j| (i, j, 1.0)));
    let inverted = (0..STEPS).flat_map(|i| (0..STEPS - 1 - i).map(move |j| (i, j, 2.0)));
    let sum: f32 = upright.chain(inverted).map(|(i, j, third)| at(i, j, third)).sum();
    sum / (STEPS * STEPS) as f32
}

/// The mean along lines of constant v; corners are in texels.
fn over_lines(texture: &TextureRef, sums: &RowSums, mut corners: [DVec2; 3]) -> f32 {
    corners.sort_by(|a, b| a.y.total_cmp(&b.y));
    let [top, middle, bottom] = corners;
    let height = bottom.y - top.y;
    let lines = (2.0 * height).ceil().clamp(LINES[0], LINES[1]) as u32;
    let cross = |a: DVec2, b: DVec2, y: f64| a.x + (b.x - a.x) * ((y - a.y) / (b.y - a.y));
    let (mut light, mut length) = (0.0, 0.0);
    for line in 0..lines {
        let y = top.y + height * (f64::from(line) + 0.5) / f64::from(lines);
        let long = cross(top, bottom, y);
        let short = if y < middle.y { cross(top, middle, y) } else { cross(middle, bottom, y) };
        let (from, to) = (long.min(short), long.max(short));
        light += sums.along(texture, y, from, to);
        length += to - from;
    }
    (light / length) as f32
}

/// Running sums of an image's luminance along its rows.
#[derive(Debug)]
struct RowSums {
    width: usize,
    /// `width + 1` values a row, the first of them 0.
    sums: Vec<f32>,
}

impl RowSums {
    fn new(image: &Image) -> Self {
        let (width, height) = (image.width as usize, image.height as usize);
        let mut sums = Vec::with_capacity((width + 1) * height);
        for y in 0..height {
            let mut sum = 0.0;
            sums.push(sum);
            sums.extend((0..width).map(|x| {
                sum += luminance(color(image, x, y));
                sum
            }));
        }
        Self { width, sums }
    }

    /// ∫ dx of the filtered texture along the line at `y` between two x, in texels.
    fn along(&self, texture: &TextureRef, y: f64, from: f64, to: f64) -> f64 {
        let row = |y: f64| {
            let row = wrapped(y as i32, texture.image.height, texture.wrap[1]);
            let sums = &self.sums[row * (self.width + 1)..][..=self.width];
            Row { sums, wrap: texture.wrap[0] }
        };
        match texture.filter {
            Filter::Nearest => {
                let row = row(y.floor());
                row.nearest(to) - row.nearest(from)
            }
            Filter::Linear => {
                let y = y - 0.5;
                let along = |row: Row<'_>| row.linear(to - 0.5) - row.linear(from - 0.5);
                let f = y - y.floor();
                (1.0 - f) * along(row(y.floor())) + f * along(row(y.floor() + 1.0))
            }
        }
    }
}

/// A row of a texture, wrapped.
#[derive(Clone, Copy)]
struct Row<'a> {
    sums: &'a [f32],
    wrap: Wrap,
}

impl Row<'_> {
    /// Sum of the texels 0 to `k` − 1; negative where `k` is negative.
    fn before(&self, k: i64) -> f64 {
        let n = self.sums.len() as i64 - 1;
        let sum = |k: i64| f64::from(self.sums[k as usize]);
        let whole = sum(n);
        match self.wrap {
            Wrap::Repeat => k.div_euclid(n) as f64 * whole + sum(k.rem_euclid(n)),
            Wrap::Clamp if k < 0 => k as f64 * sum(1),
            Wrap::Clamp if k > n => whole + (k - n) as f64 * (whole - sum(n - 1)),
            Wrap::Clamp => sum(k),
            Wrap::Mirror => {
                let rest = k.rem_euclid(2 * n);
                let there_and_back = 2.0 * k.div_euclid(2 * n) as f64 * whole;
                there_and_back + if rest <= n { sum(rest) } else { 2.0 * whole - sum(2 * n - rest) }
            }
        }
    }

    fn texel(&self, k: i64) -> f64 {
        self.before(k + 1) - self.before(k)
    }

    /// ∫ from 0 to x of the row, with nearest filtering.
    fn nearest(&self, x: f64) -> f64 {
        let k = x.floor() as i64;
        self.before(k) + (x - x.floor()) * self.texel(k)
    }

    /// ∫ up to x of the row, with linear filtering; a constant is left out.
    fn linear(&self, x: f64) -> f64 {
        let (k, f) = (x.floor() as i64, x - x.floor());
        let (a, b) = (self.texel(k), self.texel(k + 1));
        self.before(k) + 0.5 * a + a * f + (b - a) * 0.5 * f * f
    }
}

#[cfg(test)]
mod tests {
    use glam::{Affine2, Mat2};

    use super::*;
    use crate::sampling::{Sampler, triangle};

    /// A texture that is dark except for a few texels.
    fn texture(wrap: Wrap, filter: Filter) -> TextureRef {
        let (width, height) = (37, 29);
        let mut texels = vec![[20, 0, 0, 255]; (width * height) as usize];
        for (x, y) in [(0, 0), (20, 11), (36, 28), (5, 20)] {
            texels[(y * width + x) as usize] = [255, 255, 255, 255];
        }
        TextureRef {
            image: Arc::new(Image { name: String::new(), width, height, texels }),
            tex_coord: 0,
            texture_from_mesh: Affine2::from_mat2_translation(
                Mat2::from_diagonal(Vec2::new(1.5, 0.8)),
                Vec2::new(0.1, -0.2),
            ),
            wrap: [wrap; 2],
            filter,
        }
    }

    #[test]
    fn means_are_those_of_many_points() {
        let triangles = [
            [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]],
            [[-0.9, 0.2], [1.3, -0.7], [2.0, 2.4]],
            [[0.3, 0.4], [0.5, 0.4], [0.4, 0.35]],
            [[0.01, 0.02], [0.05, 0.02], [0.02, 0.04]],
            // These footprints are a line and a point.
            [[0.0, 0.0], [0.5, 0.5], [1.0, 1.0]],
            [[0.3, 0.3], [0.3, 0.3], [0.3, 0.3]],
        ];
        for wrap in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp] {
            for filter in [Filter::Nearest, Filter::Linear] {
                let texture = texture(wrap, filter);
                let sums = RowSums::new(&texture.image);
                for (index, uv) in triangles.map(|t| t.map(Vec2::from)).into_iter().enumerate() {
                    let n = 1 << 18;
                    let at = |i: u32| {
                        let w = triangle(Sampler::new(1, 0, i).square());
                        uv[0] + w.x * (uv[1] - uv[0]) + w.y * (uv[2] - uv[0])
                    };
                    let light = |at| luminance(sample(&texture, at, Coding::Srgb).truncate());
                    let expected =
                        (0..n).map(|i| f64::from(light(at(i)))).sum::<f64>() / f64::from(n);
                    let mean = f64::from(mean(&texture, &sums, uv));
                    let slack = if index < 3 { 0.02 } else { 0.1 };
                    let all = format!("{wrap:?} {filter:?} {index}: {mean} {expected}");
                    assert!((mean - expected).abs() < slack * expected + 1e-4, "{all}");
                }
            }
        }
    }

    #[test]
    fn one_bright_texel_of_millions_is_found() {
        let side = 2048u32;
        let mut texels = vec![[0, 0, 0, 255]; (side * side) as usize];
        texels[(700 * side + 900) as usize] = [255, 255, 255, 255];
        let image = Arc::new(Image { name: String::new(), width: side, height: side, texels });
        let texture = TextureRef {
            image,
            texture_from_mesh: Affine2::IDENTITY,
            ..texture(Wrap::Repeat, Filter::Linear)
        };
        let sums = RowSums::new(&texture.image);
        let whole = [Vec2::ZERO, 2.0 * Vec2::X, 2.0 * Vec2::Y];
        // Each of the two halves of four repeats holds it as often.
        let mean = f64::from(mean(&texture, &sums, whole));
        assert!((mean * f64::from(side * side) - 1.0).abs() < 0.6, "{mean}");
    }
}
