//! Cameras as views of pictures.

use glam::{Affine3A, EulerRot, Mat3, Quat, Vec2, Vec3};

use crate::{Aabb, Projection};

/// A camera at its place.
///
/// The projection gives the picture's height, and the picture's size its width. So pixels are
/// square whatever aspect ratio the file states. The near and far planes, which a rasteriser needs,
/// clip nothing here.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// The camera's transform: it looks along −Z with +Y up, without scale.
    pub world_from_camera: Affine3A,
    /// Its projection.
    pub projection: Projection,
}

/// A view with its name.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedView {
    /// Name of the camera, or of its node where that is empty, or else its number.
    pub name: String,
    /// Name of its node; may be empty.
    pub node_name: String,
    /// The view itself.
    pub view: View,
}

impl View {
    /// A perspective view of the whole box from above one of its corners.
    pub fn overview(bounds: &Aabb) -> Self {
        const FIELD_OF_VIEW: f32 = 50.0 * std::f32::consts::PI / 180.0;
        let radius = (0.5 * (bounds.max - bounds.min).length()).max(1e-3);
        let center = 0.5 * (bounds.min + bounds.max);
        let turn = Quat::from_euler(EulerRot::YXZ, 35f32.to_radians(), -25f32.to_radians(), 0.0);
        let rotation = Mat3::from_quat(turn);
        let distance = radius / (0.5 * FIELD_OF_VIEW).sin();
        let eye = center + rotation * Vec3::Z * distance;
        Self {
            world_from_camera: Affine3A::from_mat3_translation(rotation, eye),
            projection: perspective(FIELD_OF_VIEW, distance),
        }
    }

    /// A perspective view from `eye` towards `target`, with +Y up where possible. `yfov` is the
    /// vertical field of view in radians, between 0 and π. `None` where eye and target coincide or
    /// a number is not finite.
    #[must_use]
    pub fn look_at(eye: Vec3, target: Vec3, yfov: f32) -> Option<Self> {
        let forward = (target - eye).try_normalize()?;
        let up = if forward.y.abs() > 0.9999 { Vec3::NEG_Z } else { Vec3::Y };
        let right = forward.cross(up).try_normalize()?;
        let camera = glam::Mat3::from_cols(right, right.cross(forward), -forward);
        let projection = perspective(yfov, eye.distance(target));
        (eye.is_finite() && yfov > 0.0 && yfov < std::f32::consts::PI).then(|| Self {
            world_from_camera: Affine3A::from_mat3_translation(camera, eye),
            projection,
        })
    }

    /// The same view with positions relative to `origin`, a world position, as a snapshot's are.
    #[must_use]
    pub fn relative_to(&self, origin: Vec3) -> Self {
        let mut view = *self;
        view.world_from_camera.translation -= glam::Vec3A::from(origin);
        view
    }

    /// Origin and unit direction of the ray through a point of the picture. (0, 0) is the picture's
    /// upper left corner, (1, 1) its lower right one. `aspect` is width by height.
    #[inline]
    #[must_use]
    pub fn ray(&self, at: Vec2, aspect: f32) -> (Vec3, Vec3) {
        self.rays(aspect).through(at)
    }

    /// The rays of a picture, prepared to compute many.
    #[must_use]
    pub fn rays(&self, aspect: f32) -> Rays {
        let m = &self.world_from_camera;
        let axis = |v: glam::Vec3A| Vec3::from(v).normalize_or_zero();
        let (half_height, is_perspective) = match self.projection {
            Projection::Perspective { yfov, .. } => ((0.5 * yfov).tan(), true),
            Projection::Orthographic { half_height, .. } => (half_height, false),
        };
        Rays {
            eye: m.translation.into(),
            forward: -axis(m.matrix3.z_axis),
            right: half_height * aspect * axis(m.matrix3.x_axis),
            up: half_height * axis(m.matrix3.y_axis),
            is_perspective,
        }
    }
}

/// The projection of a view of something at a distance, metres. It is drawn from a thousandth of that on,
/// since whole scenes may be a few millimetres large.
fn perspective(yfov: f32, distance: f32) -> Projection {
    let near = (1e-3 * distance).clamp(f32::MIN_POSITIVE, 0.01);
    Projection::Perspective { yfov, aspect_ratio: None, near, far: None }
}

/// The rays of a picture.
#[derive(Clone, Copy, Debug)]
pub struct Rays {
    /// Position of the camera, metres.
    pub eye: Vec3,
    /// Unit.
    pub forward: Vec3,
    /// Vector from the picture's centre to its right edge. For a perspective view it is at a
    /// distance of 1.
    pub right: Vec3,
    /// Vector from the picture's centre to its upper edge, likewise.
    pub up: Vec3,
    /// Whether all rays start at the eye; otherwise they are parallel.
    pub is_perspective: bool,
}

impl Rays {
    /// The ray through a point of the picture, as in [`View::ray`].
    #[inline]
    #[must_use]
    pub fn through(&self, at: Vec2) -> (Vec3, Vec3) {
        let off = (2.0 * at.x - 1.0) * self.right + (1.0 - 2.0 * at.y) * self.up;
        if self.is_perspective {
            (self.eye, (self.forward + off).normalize())
        } else {
            (self.eye + off, self.forward)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of a scene of a few millimetres, too, nothing lies before the near plane.
    #[test]
    fn all_of_a_scene_is_drawn() {
        for size in [1e-4, 0.004, 1.0, 1e5] {
            let box_of = Aabb { min: Vec3::splat(-size), max: Vec3::splat(size) };
            let view = View::overview(&box_of);
            let eye = Vec3::from(view.world_from_camera.translation);
            let Projection::Perspective { near, .. } = view.projection else { unreachable!() };
            let radius = box_of.max.length().max(1e-3);
            assert!(near > 0.0 && near < 0.1 * (eye.length() - radius), "{size}: {near}");
        }
    }

    #[test]
    fn rays_go_through_the_corners() {
        let view = View::look_at(Vec3::new(0.0, 0.0, 5.0), Vec3::ZERO, std::f32::consts::FRAC_PI_2)
            .unwrap();
        let (eye, middle) = view.ray(Vec2::splat(0.5), 2.0);
        assert_eq!(eye, Vec3::new(0.0, 0.0, 5.0));
        assert!((middle - Vec3::NEG_Z).length() < 1e-6);
        // The view is 90° high and twice as wide, so one metre ahead the upper left corner is at x
        // = −2, y = 1.
        let (_, corner) = view.ray(Vec2::ZERO, 2.0);
        assert!((corner / -corner.z - Vec3::new(-2.0, 1.0, -1.0)).length() < 1e-5, "{corner}");
        assert!(View::look_at(Vec3::ONE, Vec3::ONE, 1.0).is_none());
        assert!(View::look_at(Vec3::ONE, Vec3::ZERO, 4.0).is_none());
        assert!(View::look_at(Vec3::Y, Vec3::ZERO, 1.0).is_some(), "straight down");
    }
}
