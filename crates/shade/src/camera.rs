//! Cameras as a rasteriser wants them: clip space, and what lies in it.
//!
//! Depth is reversed: 1 at the near plane, 0 infinitely far, which spreads the digits of floats
//! evenly over a perspective view (Reed 2015, "Depth Precision Visualized").

use glam::{Mat4, UVec2, Vec2, Vec3, Vec4};
use lumencast_scene::{Aabb, Projection, View};
use lumencast_shaders::layout;

/// Perspective cameras draw from here on, metres, or nearer where they say so.
const NEAR: f32 = 0.01;

/// A camera of a picture of a certain size.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Camera {
    pub(crate) clip_from_world: Mat4,
    clip_from_view: Mat4,
    pub(crate) eye: Vec3,
    /// The axis of sight, a unit vector.
    pub(crate) forward: Vec3,
    pub(crate) perspective: bool,
}

impl Camera {
    /// A camera that sees what [`View::ray`] looks at. The picture is moved by `jitter`, pixels.
    pub(crate) fn new(view: &View, size: UVec2, jitter: Vec2) -> Self {
        let size = size.as_vec2();
        let aspect = size.x / size.y;
        let m = &view.world_from_camera;
        let axis = |v: glam::Vec3A| Vec3::from(v).normalize_or_zero();
        let (right, up) = (axis(m.matrix3.x_axis), axis(m.matrix3.y_axis));
        let (forward, eye) = (-axis(m.matrix3.z_axis), Vec3::from(m.translation));
        let view_from_world = Mat4::look_to_rh(eye, forward, up);
        // A mirrored camera has its right on the left.
        let side = right.dot(forward.cross(up)).signum();
        let (clip_from_view, perspective) = match view.projection {
            Projection::Perspective { yfov, near, .. } => {
                let f = 1.0 / (0.5 * yfov).tan();
                let clip = Mat4::from_cols(
                    Vec4::X * (side * f / aspect),
                    Vec4::Y * f,
                    Vec4::NEG_W,
                    Vec4::Z * near.min(NEAR),
                );
                (clip, true)
            }
            Projection::Orthographic { half_height, far, .. } => {
                let clip = Mat4::from_cols(
                    Vec4::X * (side / (half_height * aspect)),
                    Vec4::Y / half_height,
                    Vec4::Z / far,
                    Vec4::new(0.0, 0.0, 1.0, 1.0),
                );
                (clip, false)
            }
        };
        let moved = 2.0 * jitter / size;
        let jittered = Mat4::from_translation(Vec3::new(moved.x, -moved.y, 0.0));
        let clip_from_view = jittered * clip_from_view;
        Self {
            clip_from_world: clip_from_view * view_from_world,
            clip_from_view,
            eye,
            forward,
            perspective,
        }
    }

    pub(crate) fn layout(&self, turn: f32) -> layout::View {
        layout::View {
            clip_from_world: self.clip_from_world,
            world_from_clip: self.clip_from_world.inverse(),
            view_from_clip: self.clip_from_view.inverse(),
            eye: self.eye,
            perspective: f32::from(u8::from(self.perspective)),
            forward: self.forward,
            turn,
        }
    }

    /// The eight corners of the part of what it sees between two distances along its axis.
    pub(crate) fn slice(&self, near: f32, far: f32) -> [Vec3; 8] {
        let world_from_clip = self.clip_from_world.inverse();
        std::array::from_fn(|i| {
            let side = |bit: usize| if i & bit == 0 { -1.0 } else { 1.0 };
            let distance = if i & 4 == 0 { near } else { far };
            // This point lies on the ray through a corner of the picture.
            let on_ray = world_from_clip * Vec4::new(side(1), side(2), 0.5, 1.0);
            let on_ray = on_ray.truncate() / on_ray.w;
            if self.perspective {
                let along = on_ray - self.eye;
                self.eye + along * (distance / along.dot(self.forward))
            } else {
                on_ray + self.forward * (distance - (on_ray - self.eye).dot(self.forward))
            }
        })
    }
}

/// The half spaces that a view's clip space is made of.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Frustum([Vec4; 5]);

impl Frustum {
    /// The planes of Gribb and Hartmann (2001), without one for what is too far.
    pub(crate) fn new(clip_from_world: &Mat4) -> Self {
        let [x, y, z, w] = [0, 1, 2, 3].map(|i| clip_from_world.row(i));
        Self([w + x, w - x, w + y, w - y, w - z])
    }

    /// Whether something in a box may be seen.
    pub(crate) fn meets(&self, bounds: &Aabb) -> bool {
        !bounds.is_empty()
            && self.0.iter().all(|plane| {
                let n = plane.truncate();
                let farthest = Vec3::select(n.cmpge(Vec3::ZERO), bounds.max, bounds.min);
                n.dot(farthest) + plane.w >= 0.0
            })
    }
}

/// Where frame `i` of `n` samples a pixel, in pixels from its middle: at Hammersley's points, whose mean
/// is the middle.
pub(crate) fn jitter(i: u32, n: u32) -> Vec2 {
    let half_step = 0.5 / n as f32;
    let mirrored = i.reverse_bits() as f32 * 2f32.powi(-32);
    Vec2::new(i as f32 / n as f32, mirrored) + half_step - 0.5
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: UVec2 = UVec2::new(200, 100);

    fn views() -> [View; 2] {
        let eye = Vec3::new(1.0, 2.0, 3.0);
        let perspective = View::look_at(eye, Vec3::new(-1.0, 0.5, 0.0), 0.9).unwrap();
        let projection =
            Projection::Orthographic { half_width: 1.0, half_height: 1.5, near: 0.0, far: 40.0 };
        [perspective, View { projection, ..perspective }]
    }

    #[test]
    fn pixels_see_what_rays_see() {
        for view in views() {
            let camera = Camera::new(&view, SIZE, Vec2::ZERO);
            for at in [Vec2::ZERO, Vec2::new(0.3, 0.8), Vec2::ONE] {
                let (origin, direction) = view.ray(at, 2.0);
                for distance in [0.5, 7.0] {
                    let clip = camera.clip_from_world * (origin + distance * direction).extend(1.0);
                    let ndc = clip.truncate() / clip.w;
                    let expected = Vec2::new(2.0 * at.x - 1.0, 1.0 - 2.0 * at.y);
                    assert!((ndc.truncate() - expected).length() < 1e-5, "{ndc} {expected}");
                    assert!(ndc.z > 0.0 && ndc.z < 1.0, "{ndc}");
                }
            }
            // Half a pixel to the right and down.
            let moved = Camera::new(&view, SIZE, Vec2::splat(0.5));
            let point = camera.eye + 3.0 * camera.forward;
            let ndc = |c: &Camera| {
                let clip = c.clip_from_world * point.extend(1.0);
                clip.truncate() / clip.w
            };
            let step = ndc(&moved) - ndc(&camera);
            assert!((step - Vec3::new(0.005, -0.01, 0.0)).length() < 1e-5, "{step}");
        }
    }

    #[test]
    fn slices_end_where_they_should() {
        for view in views() {
            let camera = Camera::new(&view, SIZE, Vec2::ZERO);
            let frustum = Frustum::new(&camera.clip_from_world);
            for (i, corner) in camera.slice(2.0, 5.0).into_iter().enumerate() {
                let depth = (corner - camera.eye).dot(camera.forward);
                assert!((depth - if i < 4 { 2.0 } else { 5.0 }).abs() < 1e-4, "{depth}");
                let clip = camera.clip_from_world * corner.extend(1.0);
                assert!((clip.x.abs() / clip.w - 1.0).abs() < 1e-4);
                let around = |by: Vec3| {
                    let at = corner + by;
                    Aabb { min: at - 1e-3, max: at + 1e-3 }
                };
                assert!(frustum.meets(&around(Vec3::ZERO)));
                let middle = camera.eye + depth * camera.forward;
                assert!(!frustum.meets(&around(0.1 * (corner - middle))));
            }
            let behind = camera.eye - 2.0 * camera.forward;
            assert!(!frustum.meets(&Aabb { min: behind - 0.1, max: behind + 0.1 }));
            assert!(!frustum.meets(&Aabb::EMPTY));
        }
    }

    #[test]
    fn frames_spread_over_the_pixel() {
        assert_eq!(jitter(0, 1), Vec2::ZERO);
        for n in [2, 8, 64] {
            let places: Vec<Vec2> = (0..n).map(|i| jitter(i, n)).collect();
            assert!(places.iter().all(|p| p.abs().max_element() <= 0.5));
            let mean = places.iter().sum::<Vec2>() / n as f32;
            assert!(mean.abs().max_element() < 1e-6, "{n}: {mean}");
        }
    }
}
