//! Normal maps that a file turns or mirrors (KHR_texture_transform) turn their bumps with them, as they
//! are drawn.

use std::f32::consts::PI;
use std::sync::Arc;

use glam::Vec3;
use lumencast_scene::{LightKind, NodeId, PlacedLight, PunctualLight, View};
use lumencast_shade::{Settings, Shadows};
use lumencast_testkit::mapped::MappedFloor;

use crate::common::{direct, renderer};

/// Lux.
const SUN: f32 = 10.0;

#[test]
fn normal_maps_turn_with_their_coordinates() {
    let towards = Vec3::new(0.4, 1.0, 0.3).normalize();
    let kind = LightKind::Directional { angle: 0.0 };
    let light = PunctualLight { kind, color: Vec3::ONE, intensity: SUN, range: None };
    let (node, position) = (NodeId(7), Vec3::ZERO);
    let sun = PlacedLight { node, light, position, direction: -towards };
    let lit = |floor: &MappedFloor| {
        let mut snapshot = floor.scene().snapshot().as_ref().clone();
        snapshot.lights.push(sun);
        Arc::new(snapshot)
    };
    let settings =
        Settings { shadows: Shadows { resolution: 0, ..Shadows::default() }, ..direct() };
    let view = View::look_at(Vec3::new(1.0, 6.0, 0.5), Vec3::ZERO, 0.7).expect("a view");
    let mut renderer = renderer(&lit(&MappedFloor::PLAIN), &settings);
    for floor in MappedFloor::all() {
        renderer.set_scene(&lit(&floor));
        let picture = renderer.pictures(&[view], &settings).expect("a picture").remove(0);
        let expected = MappedFloor::ALBEDO * SUN * floor.normal().dot(towards).max(0.0) / PI;
        let worst = picture.iter().map(|p| (p.x - expected).abs()).fold(0.0, f32::max);
        assert!(worst < 2e-3 * SUN, "{floor:?}: {worst} off {expected}");
    }
}
