//! One picture of several, for documents: reference and rows side by side, below each row its FLIP
//! difference from the reference.

use glam::{UVec2, Vec3};
use lumencast_picture::{Loaded, Picture, ToneMap};

use super::report::Row;

/// A picture on the sheet is so many pixels wide at most.
const WIDEST: u32 = 640;

/// The sheet in linear colour, to be shown by the curve of sRGB.
pub(super) fn of(reference: &Picture, rows: &[&Row], exposure: f32) -> Picture {
    let as_judged =
        |picture: &Picture| smaller(&picture.map(|p| ToneMap::Gamma.encode(p * exposure)));
    let first = as_judged(reference);
    let cell = UVec2::new(first.width(), first.height());
    let black = first.map(|_| Vec3::ZERO);
    let mut columns = vec![[first, black]];
    columns.extend(rows.iter().map(|row| {
        let difference = row.difference.in_magma().map(|p| ToneMap::Srgb.encode(p));
        [as_judged(&row.picture), smaller(&difference)]
    }));
    let codes = Picture::from_fn(cell.x * columns.len() as u32, 2 * cell.y, |x, y| {
        let part = &columns[(x / cell.x) as usize][(y / cell.y) as usize];
        part.pixel(x % cell.x, y % cell.y).unwrap_or_default()
    });
    Loaded::Coded(codes).linear()
}

/// The picture averaged over squares of pixels, as small as make it narrow enough. What is left over at
/// the right and below is cut off.
fn smaller(picture: &Picture) -> Picture {
    let side = picture.width().div_ceil(WIDEST).min(picture.height());
    let mean = |x: u32, y: u32| {
        let square = (0..side * side).map(|i| (x * side + i % side, y * side + i / side));
        let sum: Vec3 = square.filter_map(|(x, y)| picture.pixel(x, y)).sum();
        sum / (side * side) as f32
    };
    Picture::from_fn(picture.width() / side, picture.height() / side, mean)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_are_averaged_over_whole_squares() {
        let wide = Picture::from_fn(2 * WIDEST + 1, 7, |x, y| Vec3::splat((x + 10_000 * y) as f32));
        let small = smaller(&wide);
        assert_eq!((small.width(), small.height()), ((2 * WIDEST + 1) / 3, 2));
        assert_eq!(small.pixel(1, 1), Some(Vec3::splat(4.0 + 40_000.0)));
        let narrow = Picture::from_fn(WIDEST, 2, |x, _| Vec3::splat(x as f32));
        assert_eq!(smaller(&narrow), narrow);
    }
}
