//! Rays of the sun, where it is followed to what it lights.

use std::sync::Arc;

use glam::{Vec3, Vec4};
use lumencast_gather::reference::{Parts, PictureSettings, Renderer};
use lumencast_scene::{LightKind, Material, Snapshot, View};
use lumencast_testkit::scenes::{Stage, lambert};

use super::common::*;

/// A room with a window and the sun in it, and panes of such materials one metre high across the light,
/// at some x: the window is at −2.
fn room_behind(panes: &[(f32, Material)]) -> (Arc<Snapshot>, View) {
    let mut stage = Stage::default();
    let wall = stage.material(lambert(Vec3::new(0.8, 0.6, 0.4), BLACK));
    let quads: [[[f32; 3]; 3]; 9] = [
        [[-2.0, 0.0, 2.0], [4.0, 0.0, 0.0], [0.0, 0.0, -4.0]],
        [[-2.0, 2.5, -2.0], [4.0, 0.0, 0.0], [0.0, 0.0, 4.0]],
        [[-2.0, 0.0, -2.0], [4.0, 0.0, 0.0], [0.0, 2.5, 0.0]],
        [[2.0, 0.0, 2.0], [-4.0, 0.0, 0.0], [0.0, 2.5, 0.0]],
        [[2.0, 0.0, -2.0], [0.0, 0.0, 4.0], [0.0, 2.5, 0.0]],
        // The wall with the window: below, above, on both sides of it.
        [[-2.0, 0.0, 2.0], [0.0, 0.0, -4.0], [0.0, 1.2, 0.0]],
        [[-2.0, 1.8, 2.0], [0.0, 0.0, -4.0], [0.0, 0.7, 0.0]],
        [[-2.0, 1.2, 2.0], [0.0, 0.0, -1.7], [0.0, 0.6, 0.0]],
        [[-2.0, 1.2, -0.3], [0.0, 0.0, -1.7], [0.0, 0.6, 0.0]],
    ];
    for [corner, u, v] in quads.map(|quad| quad.map(Vec3::from)) {
        stage.quad(corner, u, v, wall);
    }
    for (x, pane) in panes {
        let material = stage.material(pane.clone());
        // The sun falls by 0.9 m a metre.
        let corner = Vec3::new(*x, 1.0 - 0.9 * (x + 2.0), 0.5);
        stage.quad(corner, Vec3::NEG_Z, Vec3::Y, material);
    }
    let sun = light(LightKind::Directional { angle: 0.0 }, 10.0);
    stage.light(sun, BLACK, Vec3::new(1.0, -0.9, -0.1));
    let view = View::look_at(Vec3::new(1.7, 1.6, 1.7), Vec3::new(-0.4, 0.6, -0.4), 1.2).unwrap();
    (stage.snapshot(), view)
}

/// Mean of all light in that room that is scattered more than once. Its error is an upper bound.
fn light_behind(panes: &[(f32, Material)], follow_sun: bool) -> Estimate {
    let (scene, view) = room_behind(panes);
    let parts = Parts::Indirect;
    let settings = PictureSettings { follow_sun, parts, bounces: 3, ..settings() };
    let renderer = Renderer::new(&scene, view, settings).unwrap();
    assert_eq!(renderer.follows_sun(), follow_sun);
    let film = expose(&renderer, settings.size, 768);
    let values: Vec<f32> = film.picture().into_iter().flat_map(|v| v.to_array()).collect();
    let mean = values.iter().sum::<f32>() / values.len() as f32;
    // Pixels are independent, the channels of one are not.
    let noise = film.noise(1.0).unwrap().relative_rms as f32;
    Estimate { mean, error: mean * noise * (3.0 / values.len() as f32).sqrt() }
}

/// A room behind black panes has 1 − α of the sun for each, and all else in proportion; whether the sun
/// is followed to what it lights or not.
#[test]
fn followed_sun_passes_sheets() {
    let open = light_behind(&[], true);
    for (count, follow_sun) in [(1, false), (1, true), (2, true)] {
        let panes: Vec<_> = (0..count).map(|n| (-2.01 - 0.01 * n as f32, veil())).collect();
        let passes = (1.0 - ALPHA).powi(count);
        let through = light_behind(&panes, follow_sun);
        let found = Estimate { error: through.error.hypot(passes * open.error), ..through };
        let wrong = [1.0, passes * (1.0 - ALPHA), passes / (1.0 - ALPHA), 0.0, 1.1 * passes];
        let wrong = wrong.map(|share| share * open.mean);
        let name = format!("{count} panes, {follow_sun}");
        found.check(&name, passes * open.mean, &wrong, 1e-3 * open.mean);
    }
}

/// A white pane in the room scatters what it covers, of the sun that is followed to it as of that which
/// paths find by themselves. Planted faults: a pane that is whole, and none.
#[test]
fn followed_sun_lights_sheets() {
    let of = |opacity: f32, follow_sun| {
        let base_color = Vec4::new(1.0, 1.0, 1.0, opacity);
        light_behind(&[(-1.6, Material { base_color, ..veil() })], follow_sun)
    };
    let (expected, followed) = (of(0.5, false), of(0.5, true));
    let found = Estimate { error: followed.error.hypot(expected.error), ..followed };
    let mut wrong = vec![0.85 * expected.mean, 1.15 * expected.mean];
    wrong.extend([0.0, 1.0].map(|opacity| of(opacity, true).mean));
    found.check("white pane", expected.mean, &wrong, 1e-3 * expected.mean);
}
