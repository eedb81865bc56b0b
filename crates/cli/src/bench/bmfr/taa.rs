//! Temporal antialiasing: the last picture is kept as far as the new one allows it.

use glam::{IVec2, UVec2, Vec3};

/// The new frame's share.
const SHARE: f32 = 0.2;

/// The new picture mixed with the last one, which is first held within the colours about the pixel: the
/// mean of the bounds of all nine and of the five that share an edge, in YCoCg. Where there is no last
/// picture, the new one as it is.
pub(super) fn smoothed(size: UVec2, new: &[Vec3], before: &[Vec3]) -> Vec<Vec3> {
    if before.len() != new.len() {
        return new.to_vec();
    }
    let pixels = (0..size.y as i32).flat_map(|y| (0..size.x as i32).map(move |x| IVec2::new(x, y)));
    let pixel = |((at, new_code), before): ((IVec2, &Vec3), &Vec3)| {
        let (least, most) = bounds(size.as_ivec2(), new, at);
        let held = rgb(ycocg(*before).clamp(least, most));
        held.lerp(*new_code, SHARE)
    };
    pixels.zip(new).zip(before).map(pixel).collect()
}

/// The colours about a pixel.
fn bounds(size: IVec2, codes: &[Vec3], at: IVec2) -> (Vec3, Vec3) {
    let nothing = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    let widened = |(least, most): (Vec3, Vec3), code| (least.min(code), most.max(code));
    let (mut all, mut cross) = (nothing, nothing);
    for offset in (-1..=1).flat_map(|y| (-1..=1).map(move |x| IVec2::new(x, y))) {
        let p = at + offset;
        if p.cmplt(IVec2::ZERO).any() || p.cmpge(size).any() {
            continue;
        }
        let code = ycocg(codes[(p.y * size.x + p.x) as usize]);
        all = widened(all, code);
        if offset.x == 0 || offset.y == 0 {
            cross = widened(cross, code);
        }
    }
    (0.5 * (all.0 + cross.0), 0.5 * (all.1 + cross.1))
}

/// Luma and two differences of colour.
fn ycocg(rgb: Vec3) -> Vec3 {
    let [r, g, b] = rgb.to_array();
    Vec3::new(0.25 * r + 0.5 * g + 0.25 * b, 0.5 * (r - b), 0.5 * g - 0.25 * (r + b))
}

fn rgb(ycocg: Vec3) -> Vec3 {
    let [y, co, cg] = ycocg.to_array();
    Vec3::new(y + co - cg, y + cg, y - co - cg)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: UVec2 = UVec2::new(4, 3);

    #[test]
    fn colours_go_and_come_back() {
        for c in [Vec3::new(0.1, 0.5, 0.9), Vec3::X, Vec3::splat(0.3)] {
            assert!((rgb(ycocg(c)) - c).abs().max_element() < 1e-6);
        }
    }

    #[test]
    fn history_is_held_within_what_is_about() {
        let grey = vec![Vec3::splat(0.5); 12];
        assert_eq!(smoothed(SIZE, &grey, &[]), grey);
        // The last picture is nowhere near: nothing of it stays.
        let ghost = vec![Vec3::new(1.0, 0.0, 0.0); 12];
        let found = smoothed(SIZE, &grey, &ghost);
        assert!(found.iter().all(|c| (*c - 0.5).abs().max_element() < 1e-6), "{found:?}");
        // Where it lies within the bounds, four fifths of it stay.
        let edge: Vec<_> = (0..12).map(|i| Vec3::splat((i % 2) as f32)).collect();
        let found = smoothed(SIZE, &edge, &grey);
        assert!((found[5] - 0.6).abs().max_element() < 1e-6, "{}", found[5]);
    }
}
