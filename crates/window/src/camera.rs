//! Cameras that people move: around a point, or through the scene.

use egui::{Key, PointerButton};
use glam::{Affine3A, EulerRot, Mat3, Quat, Vec2, Vec3};
use lumencast_scene::{Projection, View};

/// What dragging does.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Steering {
    /// The camera goes around a point in front of it.
    #[default]
    Orbit,
    /// The camera turns where it is.
    Fly,
}

/// Radians for a drag over the height of the window.
const TURN: f32 = 3.0;
/// Steepest view up and down, radians.
const STEEPEST: f32 = 1.55;
/// A step of the wheel brings the camera nearer by this factor.
const DOLLY: f32 = 0.0015;
/// The part of the scene's size that keys move the camera by in a second.
const SPEED: f32 = 0.12;
/// How much faster with Shift.
const HASTE: f32 = 4.0;
/// The nearest that the camera comes to its point, as a part of the scene's size.
const NEAREST: f32 = 1e-3;

/// A camera, held by the point that it goes around.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// What dragging does.
    pub steering: Steering,
    /// The point is in front of the camera.
    pivot: Vec3,
    /// Metres from there.
    distance: f32,
    /// Radians about +Y; 0 looks along −Z.
    yaw: f32,
    /// Radians up.
    pitch: f32,
    projection: Projection,
    /// Metres across the scene.
    extent: f32,
}

impl Camera {
    /// Starts at a camera of the scene, and goes around what is in its middle. A roll is lost.
    pub fn new(view: &View, center: Vec3, extent: f32) -> Self {
        let mut camera = Self {
            steering: Steering::default(),
            pivot: center,
            distance: extent,
            yaw: 0.0,
            pitch: 0.0,
            projection: view.projection,
            extent: if extent.is_finite() && extent > 0.0 { extent } else { 1.0 },
        };
        camera.jump(view, center);
        camera
    }

    /// Goes to a camera of the scene.
    pub fn jump(&mut self, view: &View, center: Vec3) {
        let eye = Vec3::from(view.world_from_camera.translation);
        let forward = -Vec3::from(view.world_from_camera.matrix3.z_axis).normalize_or(Vec3::Z);
        self.yaw = (-forward.x).atan2(-forward.z);
        self.pitch = forward.y.clamp(-1.0, 1.0).asin().clamp(-STEEPEST, STEEPEST);
        // Around what is as far away as the scene's middle.
        self.distance = (center - eye).dot(forward).max(0.1 * self.extent);
        self.pivot = eye + self.distance * self.forward();
        self.projection = view.projection;
    }

    /// From where it looks, and how.
    pub fn view(&self) -> View {
        let rotation = Mat3::from_quat(self.rotation());
        View {
            world_from_camera: Affine3A::from_mat3_translation(rotation, self.eye()),
            projection: self.projection,
        }
    }

    /// The eye's place.
    pub fn eye(&self) -> Vec3 {
        self.pivot - self.distance * self.forward()
    }

    fn rotation(&self) -> Quat {
        Quat::from_euler(EulerRot::YXZ, self.yaw, self.pitch, 0.0)
    }

    fn forward(&self) -> Vec3 {
        self.rotation() * Vec3::NEG_Z
    }

    /// Turns by a drag, in heights of the window.
    fn turn(&mut self, by: Vec2) {
        let eye = self.eye();
        self.yaw -= TURN * by.x;
        self.pitch = (self.pitch - TURN * by.y).clamp(-STEEPEST, STEEPEST);
        if self.steering == Steering::Fly {
            self.pivot = eye + self.distance * self.forward();
        }
    }

    /// Moves sideways, so that what lies at the pivot stays below the pointer.
    fn pan(&mut self, by: Vec2) {
        let height = match self.projection {
            Projection::Perspective { yfov, .. } => 2.0 * self.distance * (0.5 * yfov).tan(),
            Projection::Orthographic { half_height, .. } => 2.0 * half_height,
        };
        self.pivot += self.rotation() * Vec3::new(-by.x * height, by.y * height, 0.0);
    }

    /// Comes nearer, by points of the wheel.
    fn dolly(&mut self, points: f32) {
        let factor = (-DOLLY * points).exp();
        if let Projection::Orthographic { half_width, half_height, .. } = &mut self.projection {
            *half_width *= factor;
            *half_height *= factor;
        }
        let distance = (self.distance * factor).max(NEAREST * self.extent);
        if self.steering == Steering::Fly {
            self.pivot += (self.distance - distance) * self.forward();
        } else {
            self.distance = distance;
        }
    }

    /// Walks along its own axes; `haste`: faster.
    fn walk(&mut self, along: Vec3, seconds: f32, haste: bool) {
        let speed = SPEED * self.extent * if haste { HASTE } else { 1.0 };
        self.pivot += self.rotation() * along.normalize_or_zero() * speed * seconds;
    }

    /// Follows what people do with pointer and keys on the picture, `response`.
    pub fn steer(&mut self, response: &egui::Response, seconds: f32) {
        let height = response.rect.height().max(1.0);
        let drag = response.drag_delta();
        let by = Vec2::new(drag.x, drag.y) / height;
        if response.dragged_by(PointerButton::Primary) {
            self.turn(by);
        } else if response.dragged_by(PointerButton::Secondary)
            || response.dragged_by(PointerButton::Middle)
        {
            self.pan(by);
        }
        let context = &response.ctx;
        if response.hovered() {
            self.dolly(context.input(|input| input.smooth_scroll_delta().y));
        }
        if context.egui_wants_keyboard_input() {
            return;
        }
        let (along, haste) = context.input(|input| {
            let axis = |more, less| {
                f32::from(i8::from(input.key_down(more)) - i8::from(input.key_down(less)))
            };
            let along = Vec3::new(axis(Key::D, Key::A), axis(Key::E, Key::Q), axis(Key::S, Key::W));
            (along, input.modifiers.shift)
        });
        if along != Vec3::ZERO {
            self.walk(along, seconds, haste);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera() -> Camera {
        let view = View::look_at(Vec3::new(0.0, 1.0, 4.0), Vec3::Y, 1.0).expect("two points");
        Camera::new(&view, Vec3::Y, 8.0)
    }

    fn close(a: Vec3, b: Vec3) -> bool {
        (a - b).length() < 1e-4
    }

    #[test]
    fn starts_where_it_was_put() {
        for (eye, target) in [
            (Vec3::new(0.0, 1.0, 4.0), Vec3::Y),
            (Vec3::new(3.0, 2.0, -1.0), Vec3::new(-2.0, 0.5, 0.3)),
            (Vec3::new(0.0, 9.0, 0.0), Vec3::new(0.1, 0.0, 0.0)),
        ] {
            let view = View::look_at(eye, target, 0.8).expect("two points");
            let own = Camera::new(&view, Vec3::ZERO, 10.0).view();
            assert!(close(own.world_from_camera.translation.into(), eye));
            let forward = |v: &View| -Vec3::from(v.world_from_camera.matrix3.z_axis);
            assert!((forward(&own) - forward(&view)).length() < 0.02, "{eye}");
            assert_eq!(own.projection, view.projection);
        }
    }

    #[test]
    fn orbits_keep_their_point_and_flights_their_place() {
        let mut orbit = camera();
        orbit.turn(Vec2::new(0.3, -0.2));
        assert!(close(orbit.pivot, camera().pivot));
        assert!((orbit.eye().distance(orbit.pivot) - orbit.distance).abs() < 1e-4);
        assert!(orbit.eye().x < 0.0, "dragging to the right turns the scene to the right");
        let mut fly = Camera { steering: Steering::Fly, ..camera() };
        fly.turn(Vec2::new(0.3, -0.2));
        assert!(close(fly.eye(), camera().eye()));
        for _ in 0..50 {
            orbit.turn(Vec2::new(0.0, 0.5));
        }
        assert!(orbit.view().world_from_camera.is_finite());
        assert!(orbit.pitch >= -STEEPEST);
    }

    #[test]
    fn what_is_panned_stays_below_the_pointer() {
        let mut panned = camera();
        let pivot = panned.pivot;
        panned.pan(Vec2::new(0.25, 0.1));
        // Where the old pivot is seen now, in heights of the window from the middle.
        let local = panned.view().world_from_camera.inverse().transform_point3(pivot);
        let seen = Vec2::new(local.x, -local.y) / (-local.z * 2.0 * 0.5_f32.tan());
        assert!((seen - Vec2::new(0.25, 0.1)).length() < 1e-4, "{seen}");
    }

    #[test]
    fn wheels_and_keys_move() {
        let mut orbit = camera();
        orbit.dolly(500.0);
        assert!(orbit.distance < camera().distance && close(orbit.pivot, camera().pivot));
        for _ in 0..100 {
            orbit.dolly(1000.0);
        }
        assert!(orbit.distance > 0.0);
        let mut walker = camera();
        walker.walk(Vec3::NEG_Z, 1.0, false);
        assert!(close(walker.eye() - camera().eye(), camera().forward() * SPEED * 8.0));
        let slow = walker.eye();
        walker.walk(Vec3::NEG_Z, 1.0, true);
        assert!((walker.eye().distance(slow) / slow.distance(camera().eye()) - HASTE).abs() < 1e-3);
    }
}
