//! Texture lookups. Only mip level 0 is used: a probe's samples average over the texture as well as
//! a smaller level would.

use std::sync::LazyLock;

use glam::{Vec2, Vec3, Vec4};
use lumencast_scene::{Filter, Image, TextureRef, Wrap};

use crate::accel::fetch_ahead;

/// The value of each 8-bit code.
type Decoded = [f32; 256];

/// Linear values of sRGB codes (IEC 61966-2-1).
static LINEAR_FROM_SRGB: LazyLock<Decoded> = LazyLock::new(|| {
    std::array::from_fn(|code| {
        let c = code as f32 / 255.0;
        if c <= 0.040_45 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
    })
});

/// Codes divided by 255.
static FRACTIONS: Decoded = {
    let mut fractions = [0.0; 256];
    let mut code = 0;
    while code < 256 {
        fractions[code] = code as f32 / 255.0;
        code += 1;
    }
    fractions
};

/// The coding of a texture's RGB; alpha is always linear.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Coding {
    /// sRGB, for colours.
    Srgb,
    /// Linear, for everything else.
    Linear,
}

impl Coding {
    fn rgb(self) -> &'static Decoded {
        match self {
            Self::Srgb => &LINEAR_FROM_SRGB,
            Self::Linear => &FRACTIONS,
        }
    }
}

/// Samples a texture at mesh coordinates `uv`, before KHR_texture_transform.
#[inline]
pub(crate) fn sample(texture: &TextureRef, uv: Vec2, coding: Coding) -> Vec4 {
    let image = &*texture.image;
    let at = in_texels(texture, uv);
    if !at.is_finite() {
        return Vec4::ONE;
    }
    let rgb = coding.rgb();
    let column = |x| wrapped(x, image.width, texture.wrap[0]);
    let row = |y| wrapped(y, image.height, texture.wrap[1]);
    match texture.filter {
        Filter::Nearest => {
            let (x, y) = (below(at.x), below(at.y));
            texel(image, column(x), row(y), rgb)
        }
        Filter::Linear => {
            let at = at - 0.5;
            let (x, y) = (below(at.x), below(at.y));
            // Beyond ±2³¹ texels the index saturates, so the fractions are clamped.
            let f = Vec2::new(at.x - x as f32, at.y - y as f32).clamp(Vec2::ZERO, Vec2::ONE);
            let [left, right] = [column(x), column(x.wrapping_add(1))];
            let along = |y| texel(image, left, y, rgb).lerp(texel(image, right, y, rgb), f.x);
            along(row(y)).lerp(along(row(y.wrapping_add(1))), f.y)
        }
    }
}

/// Converts mesh coordinates to texels from the texture's corner.
#[inline]
fn in_texels(texture: &TextureRef, uv: Vec2) -> Vec2 {
    let size = Vec2::new(texture.image.width as f32, texture.image.height as f32);
    texture.texture_from_mesh.transform_point2(uv) * size
}

/// The largest integer at or below `x`. Unlike `f32::floor` it needs no library call on processors
/// without a rounding instruction.
#[inline]
fn below(x: f32) -> i32 {
    let toward_zero = x as i32;
    toward_zero.saturating_sub(i32::from(toward_zero as f32 > x))
}

/// Prefetches the texels that [`sample`] reads. The next texel in a row is mostly in the same cache
/// line.
#[inline]
pub(crate) fn fetch_texels(texture: &TextureRef, uv: Vec2) {
    let image = &*texture.image;
    let at = in_texels(texture, uv) - 0.5;
    let (x, y) = (below(at.x), below(at.y));
    let x = wrapped(x, image.width, texture.wrap[0]);
    for y in [y, y.wrapping_add(1)] {
        let y = wrapped(y, image.height, texture.wrap[1]);
        image.texels.get(y * image.width as usize + x).map(fetch_ahead);
    }
}

/// A texel's value; white beyond the image's end.
#[inline]
fn texel(image: &Image, column: usize, row: usize, rgb: &Decoded) -> Vec4 {
    let Some(&[r, g, b, a]) = image.texels.get(row * image.width as usize + column) else {
        return Vec4::ONE;
    };
    let [r, g, b] = [r, g, b].map(|code| rgb[usize::from(code)]);
    Vec4::new(r, g, b, FRACTIONS[usize::from(a)])
}

/// A texel's sRGB colour in linear values; white beyond the image's end.
pub(crate) fn color(image: &Image, column: usize, row: usize) -> Vec3 {
    texel(image, column, row, Coding::Srgb.rgb()).truncate()
}

#[inline]
pub(crate) fn wrapped(i: i32, size: u32, wrap: Wrap) -> usize {
    if (i as u32) < size { i as usize } else { wrapped_around(i, size, wrap) }
}

#[inline(never)]
fn wrapped_around(i: i32, size: u32, wrap: Wrap) -> usize {
    let (i, n) = (i64::from(i), i64::from(size));
    let j = match wrap {
        Wrap::Repeat => i.rem_euclid(n),
        Wrap::Clamp => i.clamp(0, n - 1),
        Wrap::Mirror => {
            let k = i.rem_euclid(2 * n);
            if k < n { k } else { 2 * n - 1 - k }
        }
    };
    j as usize
}

/// Texture coordinates at these weights of a triangle's vertices.
pub(crate) fn interpolate_uv(uv: &[Vec2], corners: [u32; 3], weights: Vec3) -> Vec2 {
    if uv.is_empty() {
        return Vec2::ZERO;
    }
    let [a, b, c] = corners.map(|i| uv[i as usize]);
    weights.x * a + weights.y * b + weights.z * c
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::{Affine2, Vec2};

    use super::*;

    fn texture(wrap: Wrap, filter: Filter) -> TextureRef {
        let texels =
            vec![[0, 0, 0, 255], [255, 255, 255, 0], [188, 188, 188, 255], [0, 255, 0, 255]];
        TextureRef {
            image: Arc::new(Image { name: String::new(), width: 2, height: 2, texels }),
            tex_coord: 0,
            texture_from_mesh: Affine2::IDENTITY,
            wrap: [wrap; 2],
            filter,
        }
    }

    #[test]
    fn texel_centres_are_exact_and_between_them_is_linear() {
        let t = texture(Wrap::Repeat, Filter::Linear);
        assert_eq!(sample(&t, Vec2::new(0.75, 0.25), Coding::Srgb), Vec4::new(1.0, 1.0, 1.0, 0.0));
        let middle = sample(&t, Vec2::new(0.5, 0.25), Coding::Srgb);
        assert!((middle - Vec4::splat(0.5)).abs().max_element() < 1e-6, "{middle}");
        // The sRGB code 188 is half of the light.
        let half = sample(&t, Vec2::new(0.25, 0.75), Coding::Srgb);
        assert!((half.x - 0.503).abs() < 1e-3, "{half}");
    }

    #[test]
    fn wraps() {
        let at =
            |wrap, x| sample(&texture(wrap, Filter::Nearest), Vec2::new(x, 0.25), Coding::Linear).x;
        assert_eq!([at(Wrap::Repeat, 1.25), at(Wrap::Repeat, -0.25)], [0.0, 1.0]);
        assert_eq!([at(Wrap::Clamp, 7.0), at(Wrap::Clamp, -7.0)], [1.0, 0.0]);
        assert_eq!([at(Wrap::Mirror, 1.25), at(Wrap::Mirror, 1.75)], [1.0, 0.0]);
        assert_eq!(at(Wrap::Repeat, f32::NAN), 1.0);
        assert!(at(Wrap::Repeat, 1e30).is_finite());
    }
}
