//! Pictures as environments, turned: seen behind everything, and as light that a field brings.

use std::f32::consts::FRAC_PI_2;
use std::sync::Arc;

use crate::common::{Difference, difference, direct, renderer, traced};
use glam::{Quat, UVec3, Vec3};
use lumencast_gather::path_trace::{CpuPathTracer, Options};
use lumencast_gather::reference::Parts;
use lumencast_light::{Grid, Light, Order};
use lumencast_scene::{Environment, HdrImage, Projection, Snapshot, View, VolumeSpec};
use lumencast_shade::{Lighting, Settings};
use lumencast_solve::{Bake, Effort, GatherOptions, bake};
use lumencast_testkit::scenes::{Stage, lambert};

/// A turn that is no symmetry of the picture.
const TURN: f32 = 0.7;

const INTENSITY: f32 = 1.5;

/// Four quadrants of the horizon, each with a sky and a ground of its own.
fn quadrants(rotation: f32) -> Environment {
    quadrants_of(rotation, INTENSITY)
}

fn quadrants_of(rotation: f32, intensity: f32) -> Environment {
    let texels = [
        [4.0, 0.5, 0.5],
        [0.5, 3.0, 0.5],
        [0.5, 0.5, 2.0],
        [2.0, 2.0, 0.3],
        [0.3, 0.1, 0.6],
        [1.0, 0.2, 0.9],
        [0.1, 0.9, 0.9],
        [0.2, 0.4, 0.1],
    ];
    let texels = texels.map(Vec3::from).to_vec();
    let image = Some(Arc::new(HdrImage { width: 4, height: 2, texels }));
    Environment::Image { uri: String::new(), intensity, rotation, image }
}

/// A white ball in such an environment, or nothing but that.
fn scene(environment: Environment, ball: bool) -> Arc<Snapshot> {
    let mut stage = Stage::default();
    let white = stage.material(lambert(Vec3::splat(0.9), Vec3::ZERO));
    if ball {
        stage.sphere(Vec3::ZERO, 1.0, 32, white);
    }
    stage.environment(environment);
    stage.snapshot()
}

/// Other turns than the one that is meant, none, one the other way and one a quadrant further, and no
/// intensity.
fn faults() -> [(&'static str, Environment); 4] {
    [
        ("not turned", quadrants(0.0)),
        ("turned the other way", quadrants(-TURN)),
        ("a quadrant further", quadrants(TURN + FRAC_PI_2)),
        ("no intensity", quadrants_of(TURN, 1.0)),
    ]
}

/// Towards all sides, up and down, and in parallel, where one texel is seen: one that the picture would
/// not show there were it not turned.
fn views() -> Vec<View> {
    let eye = Vec3::new(3.0, 1.0, -2.0);
    let look = |to: Vec3| View::look_at(eye, eye + to, 1.4).unwrap();
    let sides = [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z];
    let projection =
        Projection::Orthographic { half_width: 1.0, half_height: 1.0, near: 0.0, far: 9.0 };
    let azimuth = 1.2_f32;
    let parallel = look(Vec3::new(azimuth.sin(), 0.3, -azimuth.cos()));
    sides.map(look).into_iter().chain([View { projection, ..parallel }]).collect()
}

#[test]
fn backgrounds_are_turned_as_the_tracers() {
    let settings = direct();
    let sound = scene(quadrants(TURN), false);
    let references: Vec<Vec<Vec3>> =
        views().into_iter().map(|v| traced(&sound, v, &settings, Parts::Direct, 16)).collect();
    let mut renderer = renderer(&sound, &settings);
    let mut compare = |name: &str, environment: Environment| -> Vec<Difference> {
        renderer.set_scene(&scene(environment, false));
        let pictures = renderer.pictures(&views(), &settings).unwrap();
        let both = (0..).zip(pictures.iter().zip(&references));
        both.map(|(number, (picture, reference))| {
            difference(&format!("background {number}, {name}"), picture, reference, 0.01)
        })
        .collect()
    };
    for found in compare("as it is", quadrants(TURN)) {
        assert!(found.off == 0.0 && found.mean_at_edges.abs() < 0.005, "{found:?}");
        assert!(found.rms_at_edges < 0.12, "{found:?}");
    }
    for (fault, environment) in faults() {
        let found = compare(fault, environment);
        assert!(found.iter().all(|found| found.off > 0.3), "{fault}: {found:?}");
    }
}

/// What a probe gathers in it lights a ball as the tracer finds it lit, but for what the expansion leaves
/// out.
#[test]
fn light_is_turned_as_the_tracers() {
    let view = View::look_at(Vec3::new(1.0, 1.5, 4.0), Vec3::ZERO, 0.7).unwrap();
    let settings = Settings { lighting: Lighting::INDIRECT, ..direct() };
    let reference = traced(&scene(quadrants(TURN), true), view, &settings, Parts::Indirect, 256);
    let grid = Grid {
        center: Vec3::ZERO,
        rotation: Quat::IDENTITY,
        size: Vec3::splat(4.0),
        resolution: UVec3::ONE,
    };
    let volume = VolumeSpec { grid, order: Order::L4 };
    let lit = |name: &str, environment: Environment| -> Difference {
        let mut tracer = CpuPathTracer::new(Options::default()).unwrap();
        let alone = scene(environment, false);
        let effort = Effort::of_samples(16_384);
        let options = GatherOptions::default();
        let wanted = Bake { scene: &alone, volumes: &[volume], lightmap: None, effort, options };
        let light = bake(wanted, &mut tracer, |_| ());
        let scene = scene(alone.environment.clone(), true);
        let mut renderer = renderer(&scene, &settings);
        renderer.set_light(&Light::new(light.unwrap().fields)).unwrap();
        let picture = renderer.pictures(&[view], &settings).unwrap().remove(0);
        difference(name, &picture, &reference, 0.03)
    };
    let found = lit("environment's light", quadrants(TURN));
    assert!(found.off < 0.01 && found.rms < 0.01, "{found:?}");
    for (fault, environment) in faults() {
        let found = lit(&format!("environment's light, {fault}"), environment);
        assert!(found.off > 0.1 && found.rms > 0.03, "{fault}: {found:?}");
    }
}
