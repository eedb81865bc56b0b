//! Normal maps that a file turns or mirrors (KHR_texture_transform) turn their bumps with them, as the
//! path tracer finds them.

use std::f32::consts::PI;
use std::sync::Arc;

use glam::{UVec2, Vec3};
use lumencast_gather::reference::{PictureSettings, Renderer, Surface};
use lumencast_scene::{LightKind, NodeId, PlacedLight, Projection, PunctualLight, View};
use lumencast_testkit::mapped::MappedFloor;

/// Lux.
const SUN: f32 = 10.0;

/// What parallel rays from above meet at the middle of a floor in the sun, and what it sends back.
fn seen(floor: &MappedFloor, towards: Vec3) -> (Surface, f32) {
    let mut snapshot = floor.scene().snapshot().as_ref().clone();
    let kind = LightKind::Directional { angle: 0.0 };
    let light = PunctualLight { kind, color: Vec3::ONE, intensity: SUN, range: None };
    let (node, position) = (NodeId(7), Vec3::ZERO);
    snapshot.lights.push(PlacedLight { node, light, position, direction: -towards });
    let projection =
        Projection::Orthographic { half_width: 0.1, half_height: 0.1, near: 0.0, far: 40.0 };
    let view = View::look_at(Vec3::new(1.0, 6.0, 0.5), Vec3::ZERO, 1.0).expect("a view");
    let settings = PictureSettings { size: UVec2::ONE, bounces: 1, ..PictureSettings::default() };
    let renderer =
        Renderer::new(&Arc::new(snapshot), View { projection, ..view }, settings).expect("threads");
    let sample = renderer.frame(0).samples[0];
    (sample.surface.expect("a floor"), sample.radiance.x)
}

#[test]
fn normal_maps_turn_with_their_coordinates() {
    let towards = Vec3::new(0.4, 1.0, 0.3).normalize();
    let shows = |normal: Vec3| MappedFloor::ALBEDO * SUN * normal.dot(towards).max(0.0) / PI;
    let mut refused = 0;
    for floor in MappedFloor::all() {
        let (surface, radiance) = seen(&floor, towards);
        let is = |normal: Vec3| {
            surface.normal.distance(normal) < 1e-3 && (radiance - shows(normal)).abs() < 1e-3 * SUN
        };
        let expected = floor.normal();
        assert!(is(expected), "{floor:?}: {} and {radiance}, not {expected}", surface.normal);
        // What comes of a transform, or of a set, that is left out where tangents are made.
        let MappedFloor { tex_coord, tangent, .. } = floor;
        let untransformed = MappedFloor { tex_coord, tangent, ..MappedFloor::PLAIN };
        let other_set = MappedFloor { tex_coord: 1 - tex_coord, ..floor };
        for fault in [untransformed, other_set] {
            let differs = fault.normal().distance(expected) > 0.1;
            assert!(!(differs && is(fault.normal())), "{floor:?} takes {fault:?} too");
            refused += u32::from(differs);
        }
    }
    assert!(refused > 40, "{refused} faults differ at all");
}
