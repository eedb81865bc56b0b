//! Translation, rotation and scale of a node.

use glam::{Affine3A, DAffine3, DMat4, DVec3, Quat, Vec3};

use crate::{Transform, limits};

/// A local transform: parent_from_node = translation · rotation · scale.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Trs {
    pub(crate) translation: DVec3,
    pub(crate) rotation: Quat,
    pub(crate) scale: Vec3,
}

impl Default for Trs {
    fn default() -> Self {
        Self { translation: DVec3::ZERO, rotation: Quat::IDENTITY, scale: Vec3::ONE }
    }
}

impl Trs {
    pub(crate) fn affine(&self) -> Affine3A {
        self.precise().as_affine3a()
    }

    /// The transform in double precision.
    pub(crate) fn precise(&self) -> DAffine3 {
        let rotation = self.rotation.as_dquat().normalize();
        let scale = self.scale.as_dvec3();
        DAffine3::from_scale_rotation_translation(scale, rotation, self.translation)
    }

    pub(crate) fn is_within_limits(&self) -> bool {
        let largest = self.translation.abs().max(self.scale.as_dvec3().abs()).max_element();
        let is_finite =
            self.translation.is_finite() && self.rotation.is_finite() && self.scale.is_finite();
        is_finite && largest <= f64::from(limits::EXTENT)
    }

    /// Decomposes a matrix as three.js does: a mirroring one gets a negative x scale. The flag
    /// tells whether the parts reproduce the matrix, which they do not where it shears.
    pub(crate) fn from_matrix(matrix: DMat4) -> (Self, bool) {
        let affine = Affine3A::from_mat4(matrix.as_mat4());
        let (m, translation) = (affine.matrix3, matrix.w_axis.truncate());
        let trs = if is_invertible(&affine) {
            let (scale, rotation, _) = affine.to_scale_rotation_translation();
            Self { translation, rotation: rotation.normalize(), scale }
        } else {
            let scale = Vec3::new(m.x_axis.length(), m.y_axis.length(), m.z_axis.length());
            Self { translation, rotation: Quat::IDENTITY, scale }
        };
        let size = m.to_cols_array().into_iter().map(f32::abs).fold(0.0, f32::max);
        let same = trs.affine().matrix3.abs_diff_eq(m, 1e-3 * size);
        (trs, same)
    }

    /// This transform with the parts of an edit in place of its own; the rotation is normalised.
    pub(crate) fn with(self, edit: &Transform) -> Self {
        Self {
            translation: edit.translation.map_or(self.translation, |t| t.as_dvec3()),
            rotation: edit.rotation.map_or(self.rotation, normalize),
            scale: edit.scale.unwrap_or(self.scale),
        }
    }
}

/// Normalises a rotation. One of unit length is returned unchanged, so normalising twice has no
/// effect.
fn normalize(q: Quat) -> Quat {
    if q.is_normalized() { q } else { q.normalize() }
}

/// Whether a transform has a usable inverse: it is finite and its determinant is not near zero.
pub(crate) fn is_invertible(affine: &Affine3A) -> bool {
    let determinant = affine.matrix3.determinant();
    affine.is_finite() && determinant.is_normal() && affine.inverse().is_finite()
}

/// Whether a transform is finite and places things near enough to the origin to compute with.
pub(crate) fn is_in_world(world: &Affine3A) -> bool {
    world.is_finite() && world.translation.abs().max_element() <= 1e15
}
