//! Triangles on lumels.

use glam::{IVec2, UVec2, Vec2, Vec3};

/// A triangle's share of a lumel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Share {
    /// The lumel.
    pub(crate) lumel: UVec2,
    /// Area that lies in it, of 1.
    pub(crate) area: f32,
    /// Barycentric weights of a point of the triangle in it: nearly the lumel's middle, if that lies in
    /// the triangle, or else the middle of the share.
    pub(crate) weights: Vec3,
    /// The lumel's middle lies in the triangle.
    pub(crate) holds_middle: bool,
}

/// Weights so little below 0 still count as inside: what single precision leaves open on an edge.
const EDGE: f32 = 1e-5;
/// How far a lumel's point moves from the lumel's middle to that of the share. On the edge of a chart it
/// would lie in the plane of the wall beside, and see through that.
const INWARDS: f32 = 1.0 / 16.0;
/// Shares smaller than this are passed over.
const LEAST_AREA: f32 = 1e-6;

/// Every lumel of a grid that a triangle covers a part of.
pub(crate) fn shares(corners: [Vec2; 3], size: UVec2) -> impl Iterator<Item = Share> {
    let [a, b, c] = corners;
    let twice = (b - a).perp_dot(c - a);
    let (low, high) = (a.min(b).min(c).floor().as_ivec2(), a.max(b).max(c).ceil().as_ivec2());
    let (low, high) = (low.max(IVec2::ZERO), high.min(size.as_ivec2()));
    let is_flat = !(twice.abs() > 0.0 && twice.is_finite());
    let rows = if is_flat { 0..0 } else { low.y..high.y };
    rows.flat_map(move |y| (low.x..high.x).map(move |x| UVec2::new(x as u32, y as u32)))
        .filter_map(move |lumel| share(corners, lumel))
}

/// Barycentric weights of a point of the plane, which may lie outside the triangle; not finite where the
/// triangle is flat.
pub fn barycentric([a, b, c]: [Vec2; 3], point: Vec2) -> Vec3 {
    let twice = (b - a).perp_dot(c - a);
    let (v, w) = ((point - a).perp_dot(c - a) / twice, (b - a).perp_dot(point - a) / twice);
    Vec3::new(1.0 - v - w, v, w)
}

fn share(corners: [Vec2; 3], lumel: UVec2) -> Option<Share> {
    let weights = |point: Vec2| barycentric(corners, point);
    let low = lumel.as_vec2();
    let (area, middle) = clipped(corners, low);
    let own = weights(low + 0.5);
    let holds_middle = own.min_element() >= -EDGE;
    if area < LEAST_AREA && !holds_middle {
        return None;
    }
    let inside = weights(middle).max(Vec3::ZERO);
    let weights = if holds_middle { own.max(Vec3::ZERO).lerp(inside, INWARDS) } else { inside };
    let weights = weights / weights.element_sum();
    weights.is_finite().then_some(Share { lumel, area, weights, holds_middle })
}

/// Area and centroid of the part of a triangle within the unit square at `low` (Sutherland and Hodgman
/// 1974).
fn clipped(corners: [Vec2; 3], low: Vec2) -> (f32, Vec2) {
    let mut polygon: Vec<Vec2> = corners.iter().map(|corner| *corner - low).collect();
    let mut next = Vec::with_capacity(8);
    let sides: [fn(Vec2) -> f32; 4] = [|p| p.x, |p| 1.0 - p.x, |p| p.y, |p| 1.0 - p.y];
    for inside in sides {
        for (i, &from) in polygon.iter().enumerate() {
            let to = polygon[(i + 1) % polygon.len()];
            let (d, e) = (inside(from), inside(to));
            if d >= 0.0 {
                next.push(from);
            }
            if (d < 0.0) != (e < 0.0) {
                next.push(from + (to - from) * (d / (d - e)));
            }
        }
        std::mem::swap(&mut polygon, &mut next);
        next.clear();
    }
    let Some(&first) = polygon.first() else { return (0.0, low) };
    let (mut twice, mut moment) = (0.0, Vec2::ZERO);
    for pair in polygon[1..].windows(2) {
        let part = (pair[0] - first).perp_dot(pair[1] - first);
        twice += part;
        moment += part * (first + pair[0] + pair[1]) / 3.0;
    }
    let middle = if twice == 0.0 { first } else { moment / twice };
    (0.5 * twice.abs(), low + middle)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: UVec2 = UVec2::splat(16);

    fn area(corners: [Vec2; 3]) -> f32 {
        0.5 * (corners[1] - corners[0]).perp_dot(corners[2] - corners[0]).abs()
    }

    #[test]
    fn shares_add_up_to_the_triangle_and_lie_in_it() {
        let triangles = [
            [Vec2::new(1.3, 2.1), Vec2::new(12.9, 4.4), Vec2::new(5.2, 14.7)],
            [Vec2::new(3.1, 3.2), Vec2::new(3.4, 3.3), Vec2::new(3.2, 3.8)],
            [Vec2::new(0.0, 0.0), Vec2::new(16.0, 0.0), Vec2::new(0.0, 16.0)],
            [Vec2::new(2.0, 7.0), Vec2::new(14.0, 7.01), Vec2::new(8.0, 7.02)],
        ];
        for [a, b, c] in triangles {
            for corners in [[a, b, c], [c, b, a]] {
                let all: Vec<Share> = shares(corners, SIZE).collect();
                let sum: f32 = all.iter().map(|share| share.area).sum();
                assert!((sum - area(corners)).abs() < 1e-3, "{corners:?}: {sum}");
                for Share { lumel, weights, .. } in all {
                    assert!(weights.min_element() >= 0.0);
                    let at: Vec2 = (0..3).map(|k| weights[k] * corners[k]).sum();
                    let low = lumel.as_vec2() - 1e-3;
                    assert!(at.cmpge(low).all() && at.cmple(low + 1.002).all(), "{at} {lumel}");
                }
            }
        }
    }

    #[test]
    fn what_has_no_area_or_lies_outside_has_no_share() {
        let line = [Vec2::ZERO, Vec2::splat(4.0), Vec2::splat(8.0)];
        assert_eq!(shares(line, SIZE).count(), 0);
        let outside = [Vec2::splat(20.0), Vec2::new(30.0, 20.0), Vec2::new(20.0, 30.0)];
        assert_eq!(shares(outside, SIZE).count(), 0);
        let broken = [Vec2::NAN, Vec2::ZERO, Vec2::X];
        assert_eq!(shares(broken, SIZE).count(), 0);
    }

    /// A chart over a border of lumels gives shares on both sides of it.
    #[test]
    fn a_lumel_counts_that_is_only_touched() {
        let corners = [Vec2::new(1.6, 1.6), Vec2::new(2.4, 1.6), Vec2::new(1.6, 2.4)];
        let mut lumels: Vec<UVec2> = shares(corners, SIZE).map(|share| share.lumel).collect();
        lumels.sort_by_key(|lumel| lumel.to_array());
        assert_eq!(lumels, [(1, 1), (1, 2), (2, 1)].map(UVec2::from));
    }
}
