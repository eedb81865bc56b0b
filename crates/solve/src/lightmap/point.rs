//! A lumel's point, in few bytes: there are millions of them.

use glam::{Vec2, Vec3};
use lumencast_gather::{Receiver, Shading};

/// A lumel's point in the world: 16 bytes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Point {
    /// World, metres.
    pub(crate) position: Vec3,
    /// The unit normal on an octahedron that is unfolded to a square (Cigolle et al. 2014), each
    /// coordinate from −32,767 to 32,767.
    normal: [i16; 2],
}

const SCALE: f32 = i16::MAX as f32;

impl Point {
    /// At a world position, with a world unit normal.
    pub(crate) fn new(position: Vec3, normal: Vec3) -> Self {
        let on = normal / normal.abs().element_sum();
        let square = if on.z < 0.0 { folded(on.truncate()) } else { on.truncate() };
        let normal = (square.clamp(Vec2::NEG_ONE, Vec2::ONE) * SCALE).round();
        Self { position, normal: [normal.x as i16, normal.y as i16] }
    }

    /// World, unit; within 0.005° of what it was.
    pub(crate) fn normal(&self) -> Vec3 {
        let [x, y] = self.normal.map(f32::from);
        let square = Vec2::new(x, y) / SCALE;
        let z = 1.0 - square.abs().element_sum();
        let on = if z < 0.0 { folded(square) } else { square };
        on.extend(z).normalize()
    }

    /// As a gatherer takes it.
    pub(crate) fn receiver(&self, shading: Shading) -> Receiver {
        Receiver::point_shaded(self.position, self.normal(), shading)
    }
}

/// The lower half of the octahedron is folded over the corners of the square.
fn folded(on: Vec2) -> Vec2 {
    (1.0 - Vec2::new(on.y, on.x).abs()) * Vec2::new(1.0f32.copysign(on.x), 1.0f32.copysign(on.y))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normals_survive() {
        assert_eq!(size_of::<Point>(), 16);
        for k in 0..2000 {
            let z = 1.0 - (k as f32 + 0.5) / 1000.0;
            let (sin, cos) = (k as f32 * 2.4).sin_cos();
            let round = (1.0 - z * z).max(0.0).sqrt();
            let normal = Vec3::new(round * cos, round * sin, z);
            let kept = Point::new(Vec3::ONE, normal).normal();
            assert!(kept.distance(normal) < 9e-5, "{normal} became {kept}");
        }
        for axis in [Vec3::X, Vec3::Y, Vec3::Z] {
            for normal in [axis, -axis] {
                assert!(Point::new(Vec3::ZERO, normal).normal().distance(normal) < 1e-6);
            }
        }
    }
}
