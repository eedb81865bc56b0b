//! Position and normals of a hit.

use glam::Vec3;

use super::Frames;
use crate::accel::Ray;
use crate::numbers::numbers;

/// The place on a surface where a ray has arrived.
#[derive(Clone, Copy, Debug)]
pub(crate) struct HitPoint {
    /// World position, relative to the snapshot's origin, metres.
    pub(crate) position: Vec3,
    /// Unit normal of the triangle, on the side that the ray came from. Zero for triangles so thin
    /// that they have none.
    pub(crate) normal: Vec3,
    /// Bound of the position's error along the normal, metres.
    offset: f32,
    /// 1 where the ray came from the front, −1 from the back.
    side: f32,
}

numbers!(HitPoint of f32 { position: Vec3, normal: Vec3, offset: f32, side: f32 });

impl HitPoint {
    /// The place on a triangle with these corners (object space) and weights. `direction` is the
    /// unit direction of the ray.
    #[inline(always)]
    pub(crate) fn new(frames: &Frames, corners: [Vec3; 3], weights: Vec3, direction: Vec3) -> Self {
        let [a, b, c] = corners;
        let position = frames.position(weights.x * a + weights.y * b + weights.z * c);
        let front = frames.normal(scaled_cross(b - a, c - a));
        let side = if front.dot(direction) < 0.0 { 1.0 } else { -1.0 };
        let normal = side * front;
        Self { position, normal, offset: frames.error(corners, position).dot(normal.abs()), side }
    }

    /// Whether the ray came from the front.
    #[inline(always)]
    pub(crate) fn is_front(&self) -> bool {
        self.side > 0.0
    }

    /// Origin of a ray that leaves along `direction`. It lies off the surface by the bound of the
    /// position's rounding error, so the ray does not meet its own surface.
    #[inline(always)]
    pub(crate) fn leave(&self, direction: Vec3) -> Vec3 {
        let side = 1.0f32.copysign(direction.dot(self.normal));
        self.position + side * self.offset * self.normal
    }

    /// A shadow ray to a point at `distance` metres in a unit direction, or to infinity. It starts
    /// off the surface and leads to the same point. It ends before the point by the bound of
    /// rounding, so it does not meet a surface that holds the point.
    #[inline(always)]
    pub(crate) fn reach(&self, direction: Vec3, distance: f32) -> Ray {
        let origin = self.leave(direction);
        if distance == f32::INFINITY {
            return Ray { origin, direction, t_max: distance };
        }
        let ray = Ray::reaching(origin, distance * direction - (origin - self.position));
        Ray { t_max: (ray.t_max - self.offset).max(0.0), ..ray }
    }

    /// The unit world-space shading normal, bent to face `view`: the unit direction that the ray
    /// came from.
    #[inline(always)]
    pub(crate) fn shading_normal(
        &self,
        frames: &Frames,
        vertex_normal: Vec3,
        bump: &Bump,
        view: Vec3,
    ) -> Vec3 {
        self.facing(self.unbent_normal(frames, vertex_normal, bump), view)
    }

    /// The unit world-space shading normal on the ray's side, before it is bent to face a ray.
    #[inline(always)]
    pub(crate) fn unbent_normal(&self, frames: &Frames, vertex: Vec3, bump: &Bump) -> Vec3 {
        let shading = frames.normal(bump.bend(vertex));
        let n = if shading.dot(self.normal) < 0.0 { -shading } else { shading };
        if n == Vec3::ZERO { self.normal } else { n }
    }

    /// Bends a shading normal as little as possible so that it faces `view`. Otherwise normal maps
    /// and coarse meshes would show their backs.
    #[inline(always)]
    pub(crate) fn facing(&self, unbent: Vec3, view: Vec3) -> Vec3 {
        const LEAST: f32 = 1e-3;
        let cos = unbent.dot(view);
        if cos >= LEAST {
            return unbent;
        }
        (unbent + (2.0 * LEAST - cos) * view).normalize_or(self.normal)
    }
}

/// A normal map's normal and its tangent frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bump {
    /// Tangent in object space.
    pub(super) tangent: Vec3,
    /// Sign of the bitangent, ±1.
    pub(super) sign: f32,
    /// Normal in the frame of tangent, bitangent and vertex normal.
    pub(super) normal: Vec3,
}

numbers!(Bump of f32 { tangent: Vec3, sign: f32, normal: Vec3 });

impl Bump {
    /// A flat normal map, which keeps normals as they are.
    pub(crate) const FLAT: Self = Self { tangent: Vec3::ZERO, sign: 1.0, normal: Vec3::Z };

    /// The shading normal in object space, of any length.
    #[inline(always)]
    pub(super) fn bend(&self, vertex_normal: Vec3) -> Vec3 {
        let n = vertex_normal.normalize_or_zero();
        let bitangent = n.cross(self.tangent) * self.sign;
        self.normal.x * self.tangent + self.normal.y * bitangent + self.normal.z * n
    }
}

/// A vertex attribute at these weights.
#[inline(always)]
pub(crate) fn interpolate([a, b, c]: [Vec3; 3], weights: Vec3) -> Vec3 {
    weights.x * a + weights.y * b + weights.z * c
}

/// A cross product scaled so that it neither overflows nor underflows for very large or small
/// triangles. Only its direction has a meaning.
#[inline(always)]
pub(crate) fn scaled_cross(a: Vec3, b: Vec3) -> Vec3 {
    let largest = a.abs().max(b.abs()).max_element();
    if largest == 0.0 { Vec3::ZERO } else { (a / largest).cross(b / largest) }
}
