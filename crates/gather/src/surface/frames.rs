//! Transforms of instances from object space to the world, with bounds of rounding errors.

use glam::{Affine3A, Mat3, Vec3, Vec3A};

use crate::accel::abs;
use crate::numbers::numbers;

/// γ(n) after Higham: the bound of the relative error of n roundings.
pub(crate) const fn gamma(n: f32) -> f32 {
    let e = n * f32::EPSILON * 0.5;
    e / (1.0 - e)
}

/// Relative errors, twice each: of a point interpolated between three corners, and of a transformed
/// point.
const OF_CORNERS: f32 = 2.0 * (gamma(16.0) + gamma(4.0));
const OF_TRANSFORMS: f32 = 2.0 * gamma(4.0);

/// An instance's transforms and error bounds.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Frames {
    world_from_object: Mat3,
    translation: Vec3,
    /// Inverse transpose of `world_from_object`, for normals.
    normal_from_object: Mat3,
    /// Bound of the rounding error for each metre of the point's largest world coordinate, by axis.
    rounding_by_place: Vec3,
    /// Bound of the rounding error due to the instance's translation, metres, by axis.
    rounding: Vec3,
}

numbers!(Frames of f32 { world_from_object: Mat3, translation: Vec3, normal_from_object: Mat3, rounding_by_place: Vec3, rounding: Vec3 });

impl Frames {
    pub(crate) fn new(world_from_object: Affine3A) -> Self {
        let object_from_world = world_from_object.inverse();
        let (to_world, to_object) =
            (abs(&world_from_object.matrix3), abs(&object_from_world.matrix3));
        let moved = to_world * object_from_world.translation.abs();
        Self {
            world_from_object: world_from_object.matrix3.into(),
            translation: world_from_object.translation.into(),
            normal_from_object: Mat3::from(object_from_world.matrix3).transpose(),
            rounding_by_place: (OF_TRANSFORMS * (to_world * (to_object * Vec3A::ONE))).into(),
            rounding: (OF_TRANSFORMS * (moved + world_from_object.translation.abs())).into(),
        }
    }

    /// World normal of an object-space normal: unit length, or zero where its length is zero.
    #[inline(always)]
    pub(crate) fn normal(&self, object: Vec3) -> Vec3 {
        (self.normal_from_object * object).normalize_or_zero()
    }

    #[inline(always)]
    pub(crate) fn position(&self, object: Vec3) -> Vec3 {
        self.world_from_object * object + self.translation
    }

    /// Upper limit of [`Self::error`] for points whose coordinates are within ±`extent`, metres.
    pub(crate) fn error_within(&self, extent: f32) -> f32 {
        // The bound of the transform's errors also bounds the size of corners.
        let of_transforms = extent * self.rounding_by_place + self.rounding;
        (1.0 + OF_CORNERS / OF_TRANSFORMS) * of_transforms.max_element()
    }

    /// Bound of the distance between a computed point of a triangle and the true surface, by axis,
    /// metres. It covers interpolation, the transform to the world, and the transform of the next
    /// ray's origin back (Pharr, Jakob and Humphreys 2023, section 6.8).
    #[inline(always)]
    pub(crate) fn error(&self, corners: [Vec3; 3], world: Vec3) -> Vec3 {
        let [a, b, c] = corners.map(Vec3::abs);
        let largest = a.max(b).max(c);
        let m = &self.world_from_object;
        let turned =
            largest.x * m.x_axis.abs() + largest.y * m.y_axis.abs() + largest.z * m.z_axis.abs();
        OF_CORNERS * turned + world.abs().max_element() * self.rounding_by_place + self.rounding
    }
}
