//! Direct light beside the path tracer's direct part. Edges are counted apart: beyond them no pixel may
//! be off, at them pixels may differ as filters do, but light must not become more or less.

use std::sync::Arc;

use crate::common::{SIZE, difference, direct as settings, drawn, renderer, traced};
use glam::{Affine3A, Vec3, Vec4};
use lumencast_gather::reference::Parts;
use lumencast_scene::{
    AlphaMode, Environment, LightKind, Material, MeshId, Projection, PunctualLight, Scene,
    Snapshot, View,
};
use lumencast_shade::{Materials, Settings, Shadows};
use lumencast_testkit::scenes::{Stage, lambert};

fn light(kind: LightKind, intensity: f32) -> PunctualLight {
    PunctualLight { kind, color: Vec3::new(1.0, 0.9, 0.7), intensity, range: None }
}

const POINT: LightKind = LightKind::Point { radius: 0.0 };

/// Floor, back wall, and what stands on the floor.
fn stage(own: impl FnOnce(&mut Stage)) -> Arc<Snapshot> {
    let mut stage = Stage::default();
    let white = stage.material(lambert(Vec3::new(0.8, 0.7, 0.6), Vec3::ZERO));
    stage.quad(Vec3::new(-4.0, 0.0, 4.0), Vec3::X * 8.0, Vec3::NEG_Z * 8.0, white);
    stage.quad(Vec3::new(-4.0, 0.0, -4.0), Vec3::X * 8.0, Vec3::Y * 8.0, white);
    own(&mut stage);
    stage.snapshot()
}

fn ball(stage: &mut Stage, material: Material) {
    let material = stage.material(material);
    stage.sphere(Vec3::new(0.0, 1.0, 0.0), 1.0, 48, material);
}

fn view() -> View {
    View::look_at(Vec3::new(1.0, 2.2, 5.0), Vec3::new(0.0, 0.9, 0.0), 0.8).unwrap()
}

/// Every kind of material under every kind of light.
#[test]
fn every_light_on_every_material() {
    let metal = Material { metallic: 1.0, roughness: 0.4, ..Material::default() };
    let plastic = Material {
        base_color: Vec4::new(0.2, 0.5, 0.7, 1.0),
        metallic: 0.0,
        roughness: 0.3,
        ..Material::default()
    };
    let sheer = Material { transmission: 0.8, double_sided: true, ..plastic.clone() };
    let lights = [
        ("point", POINT, 60.0, Vec3::new(1.5, 4.0, 3.0)),
        (
            "spot",
            LightKind::Spot { inner: 0.2, outer: 0.6, radius: 0.0 },
            80.0,
            Vec3::new(1.5, 4.0, 3.0),
        ),
        ("sun", LightKind::Directional { angle: 0.0 }, 4.0, Vec3::ZERO),
    ];
    for (material_name, material) in [
        ("Lambert", lambert(Vec3::splat(0.7), Vec3::ZERO)),
        ("metal", metal),
        ("plastic", plastic),
        ("sheer", sheer),
    ] {
        for (light_name, kind, intensity, position) in lights {
            let scene = stage(|stage| {
                ball(stage, material.clone());
                stage.light(light(kind, intensity), position, Vec3::new(-0.3, -0.8, -0.55));
            });
            let reference = traced(&scene, view(), &settings(), Parts::Direct, 64);
            let picture = drawn(&scene, view(), &settings());
            let name = format!("{light_name} on {material_name}");
            let found = difference(&name, &picture, &reference, 0.01);
            assert!(found.off < 0.001, "{name}: {found:?}");
            assert!(found.edges < 0.3 && found.rms_at_edges < 0.03, "{name}: {found:?}");
            assert!(found.mean_at_edges.abs() < 0.002, "{name}: {found:?}");
        }
    }
}

/// A lamp in the very plane of a ceiling lights what is below as without the ceiling, in both renderers.
#[test]
fn lamps_in_the_plane_of_a_ceiling() {
    let spot = LightKind::Spot { inner: 0.6, outer: 1.2, radius: 0.0 };
    for (name, kind) in [("point in a ceiling", POINT), ("spot in a ceiling", spot)] {
        let scene = |ceiling: bool| {
            stage(|stage| {
                ball(stage, lambert(Vec3::splat(0.7), Vec3::ZERO));
                let at = Vec3::new(1.5, 4.1, 3.0);
                if ceiling {
                    let black = stage.material(lambert(Vec3::ZERO, Vec3::ZERO));
                    stage.quad(at - Vec3::new(5.0, 0.0, 6.0), Vec3::X * 9.0, Vec3::Z * 8.0, black);
                }
                stage.light(light(kind, 60.0), at, Vec3::NEG_Y);
            })
        };
        let (below, open) = (scene(true), scene(false));
        let reference = traced(&open, view(), &settings(), Parts::Direct, 64);
        for (name, picture) in [
            (name, drawn(&below, view(), &settings())),
            (&format!("{name}, traced"), traced(&below, view(), &settings(), Parts::Direct, 64)),
        ] {
            let found = difference(name, &picture, &reference, 0.01);
            assert!(found.off < 0.001, "{name}: {found:?}");
            assert!(found.edges < 0.3 && found.rms_at_edges < 0.03, "{name}: {found:?}");
            assert!(found.mean_at_edges.abs() < 0.002, "{name}: {found:?}");
        }
    }
}

/// These comparisons notice light that is a fiftieth too bright, shadows that are missing, edges of
/// shadows that are coarse, and a light that is a tenth of a metre from its place.
#[test]
fn planted_faults_are_noticed() {
    let light_at = Vec3::new(1.5, 4.0, 3.0);
    let scene = |intensity: f32, light_at: Vec3| {
        stage(|stage| {
            ball(stage, lambert(Vec3::splat(0.7), Vec3::ZERO));
            stage.light(light(POINT, intensity), light_at, Vec3::Y);
        })
    };
    let scene_as_it_is = scene(60.0, light_at);
    let reference = traced(&scene_as_it_is, view(), &settings(), Parts::Direct, 64);
    let found = |name: &str, scene: &Arc<Snapshot>, shadows: Shadows| {
        let settings = Settings { shadows, ..settings() };
        difference(name, &drawn(scene, view(), &settings), &reference, 0.01)
    };
    let shadows = Shadows::default();
    assert!(found("brighter", &scene(61.2, light_at), shadows).off > 0.1);
    let unshadowed = found("unshadowed", &scene_as_it_is, Shadows { resolution: 0, ..shadows });
    assert!(unshadowed.off > 0.01 && unshadowed.mean_at_edges > 0.01, "{unshadowed:?}");
    let coarse = found("coarse", &scene_as_it_is, Shadows { resolution: 32, ..shadows });
    assert!(coarse.rms_at_edges > 0.03, "{coarse:?}");
    let aside = found("aside", &scene(60.0, light_at + Vec3::X * 0.1), shadows);
    assert!(aside.off > 0.1 && aside.mean_at_edges < -0.004, "{aside:?}");
}

/// Lights with a size: their edges are as wide as the tracer's, on average.
#[test]
fn sized_lights_have_soft_edges() {
    for (name, kind, intensity) in [
        ("sphere", LightKind::Point { radius: 0.4 }, 60.0),
        ("sun", LightKind::Directional { angle: 0.12 }, 4.0),
        // One map, and a cube.
        ("spot", LightKind::Spot { inner: 0.5, outer: 0.8, radius: 0.4 }, 60.0),
        ("wide spot", LightKind::Spot { inner: 0.6, outer: 1.4, radius: 0.4 }, 60.0),
    ] {
        let scene = stage(|stage| {
            let white = stage.material(lambert(Vec3::splat(0.7), Vec3::ZERO));
            stage.sphere(Vec3::new(0.0, 0.5, 0.0), 0.5, 32, white);
            // Something that is far from its shadow.
            stage.sphere(Vec3::new(-0.3, 1.8, 0.6), 0.4, 32, white);
            stage.light(
                light(kind, intensity),
                Vec3::new(1.5, 4.0, 3.0),
                Vec3::new(-0.3, -0.8, -0.55),
            );
        });
        let reference = traced(&scene, view(), &settings(), Parts::Direct, 256);
        let soft = drawn(&scene, view(), &settings());
        let soft = difference(&format!("soft {name}"), &soft, &reference, 0.1).rms;
        let shadows = Shadows { search_samples: 0, ..Shadows::default() };
        let sharp = drawn(&scene, view(), &Settings { shadows, ..settings() });
        let sharp = difference(&format!("sharp {name}"), &sharp, &reference, 0.1).rms;
        assert!(soft < 0.01 && soft < 0.7 * sharp, "{name}: {soft} soft, {sharp} sharp");
    }
}

/// Many instances of one mesh, most of them beside what is seen: those cast their shadows into it, and one
/// that is left out is missed.
#[test]
fn instances_beside_the_picture_cast_shadows() {
    let mut stage = Stage::default();
    let white = stage.material(lambert(Vec3::splat(0.7), Vec3::ZERO));
    stage.sphere(Vec3::ZERO, 0.35, 32, white);
    let ball = stage.snapshot().instances[0].mesh.clone();
    let at = |i: u8| Vec3::new(1.2 * f32::from(i % 5) - 2.4, 0.5, 1.2 * f32::from(i / 5) - 2.4);
    // Of the ball at the right of the middle row, its shadow is all that is seen.
    const UNSEEN: u8 = 14;
    let scene = |kind, is_there: &dyn Fn(u8) -> bool| {
        let mut stage = Stage::default();
        let white = stage.material(lambert(Vec3::splat(0.7), Vec3::ZERO));
        stage.quad(Vec3::new(-4.0, 0.0, 4.0), Vec3::X * 8.0, Vec3::NEG_Z * 8.0, white);
        for i in (0..25).filter(|i| is_there(*i)) {
            stage.instance(MeshId(7), ball.clone(), Affine3A::from_translation(at(i)));
        }
        let lamp = light(kind, if kind == POINT { 60.0 } else { 4.0 });
        stage.light(lamp, Vec3::new(7.0, 2.4, 0.0), Vec3::new(-1.0, -0.4, 0.0));
        stage.snapshot()
    };
    let view = View::look_at(Vec3::new(0.3, 3.0, 0.0), Vec3::new(0.3, 0.0, -0.1), 0.6).unwrap();
    let mut renderer = renderer(&scene(POINT, &|_| true), &settings());
    let mut drawn = |scene: &Arc<Snapshot>, settings: &Settings| {
        renderer.set_scene(scene);
        renderer.pictures(&[view], settings).unwrap().remove(0)
    };
    for (name, kind) in [("point", POINT), ("sun", LightKind::Directional { angle: 0.0 })] {
        let (all, without) = (scene(kind, &|_| true), scene(kind, &|i| i != UNSEEN));
        let reference = traced(&all, view, &settings(), Parts::Direct, 64);
        let [all, without] = [("all", all), ("without one", without)].map(|(which, scene)| {
            let name = format!("instances, {which}, {name}");
            difference(&name, &drawn(&scene, &settings()), &reference, 0.01)
        });
        // Where the edges of two shadows meet, what one filters reaches a few pixels farther.
        assert!(all.off < 0.005 && all.mean_at_edges.abs() < 0.002, "{name}: {all:?}");
        assert!(without.off > 0.02, "{name}: {without:?}");
    }
    let unshadowed = Shadows { resolution: 0, ..Shadows::default() };
    let unshadowed = Settings { shadows: unshadowed, ..settings() };
    let (all, without) = (scene(POINT, &|_| true), scene(POINT, &|i| i != UNSEEN));
    assert!(drawn(&all, &unshadowed) == drawn(&without, &unshadowed), "it is beside the picture");
}

/// Masked and blended surfaces cast the shadows that the tracer gives them.
#[test]
fn coverage_matches_the_tracers() {
    for (name, alpha_mode, alpha) in
        [("mask", AlphaMode::Mask(0.5), 0.4), ("blend", AlphaMode::Blend, 0.4)]
    {
        let scene = stage(|stage| {
            let material = lambert(Vec3::splat(0.7), Vec3::ZERO);
            let base_color = material.base_color.truncate().extend(alpha);
            ball(stage, Material { base_color, alpha_mode, double_sided: true, ..material });
            stage.light(light(POINT, 60.0), Vec3::new(1.5, 4.0, 3.0), Vec3::Y);
        });
        let settings = Settings { samples: 64, ..settings() };
        let reference = traced(&scene, view(), &settings, Parts::Direct, 256);
        let found = difference(name, &drawn(&scene, view(), &settings), &reference, 0.1);
        assert!(found.rms < 0.03, "{name}: {found:?}");
    }
}

/// The built-in Cornell box, textures and all of glTF's doing, through both kinds of cameras.
#[test]
fn cornell() {
    let mut scene = Scene::open("cornell").unwrap();
    let perspective = scene.cameras()[0].view();
    let projection =
        Projection::Orthographic { half_width: 1.2, half_height: 1.2, near: 0.0, far: 20.0 };
    for view in [perspective, View { projection, ..perspective }] {
        for materials in [Materials::Full, Materials::Lambert] {
            let settings = Settings { materials, ..settings() };
            let snapshot = scene.snapshot();
            let reference = traced(&snapshot, view, &settings, Parts::Direct, 64);
            let name = format!("cornell {} {materials:?}", projection_name(&view));
            let picture = drawn(&snapshot, view, &settings);
            // Beside the lamp an edge is as bright as the lamp, and the noise of the tracer's 64 samples
            // tells, so that the pixels at edges are held to their mean alone.
            let found = difference(&name, &picture, &reference, 0.01);
            assert!(found.off < 0.005 && found.mean_at_edges.abs() < 0.002, "{name}: {found:?}");
        }
    }
}

fn projection_name(view: &View) -> &'static str {
    match view.projection {
        Projection::Perspective { .. } => "perspective",
        Projection::Orthographic { .. } => "orthographic",
    }
}

/// Environments as the camera sees them, and single-sided surfaces from behind, which are black.
#[test]
fn background_and_backs() {
    let mut stage = Stage::default();
    let glowing = stage.material(lambert(Vec3::splat(0.5), Vec3::splat(3.0)));
    stage.quad(Vec3::new(-1.0, 0.0, 0.0), Vec3::X, Vec3::Y, glowing);
    stage.quad(Vec3::new(1.0, 0.0, 0.0), Vec3::NEG_X, Vec3::Y, glowing);
    stage.environment(Environment::Sky {
        zenith: Vec3::new(0.2, 0.4, 1.0),
        horizon: Vec3::splat(1.0),
        ground: Vec3::new(0.3, 0.2, 0.1),
    });
    let scene = stage.snapshot();
    let view = View::look_at(Vec3::new(0.0, 0.5, 3.0), Vec3::Y * 0.5, 1.2).unwrap();
    let settings = settings();
    let reference = traced(&scene, view, &settings, Parts::Direct, 64);
    let picture = drawn(&scene, view, &settings);
    let found = difference("background", &picture, &reference, 0.02);
    assert!(found.rms < 0.005 && found.off == 0.0, "{found:?}");
    let at = |x: u32| picture[(SIZE.y / 2 * SIZE.x + x) as usize];
    assert!((at(40) - 3.0).abs().max_element() < 0.02, "the front shines: {}", at(40));
    assert_eq!(at(56), Vec3::ZERO, "the back is black");
}

/// An instance whose transform mirrors shows its front all the same.
#[test]
fn mirrored_instances() {
    let mut stage = Stage::default();
    let white = stage.material(lambert(Vec3::splat(0.8), Vec3::ZERO));
    stage.sphere(Vec3::ZERO, 1.0, 32, white);
    let ball = stage.snapshot().instances[0].clone();
    let mirror = Affine3A::from_scale(Vec3::new(-1.0, 1.0, 1.0));
    let mut mirrored = Stage::default();
    mirrored.material(lambert(Vec3::splat(0.8), Vec3::ZERO));
    mirrored.instance(ball.mesh_id, ball.mesh, mirror);
    mirrored.light(light(POINT, 60.0), Vec3::new(1.5, 4.0, 3.0), Vec3::Y);
    let scene = mirrored.snapshot();
    let view = View::look_at(Vec3::new(0.0, 1.0, 4.0), Vec3::ZERO, 0.8).unwrap();
    let reference = traced(&scene, view, &settings(), Parts::Direct, 64);
    assert!(reference.iter().any(|p| p.x > 0.5));
    let found = difference("mirrored", &drawn(&scene, view, &settings()), &reference, 0.04);
    assert!(found.off < 0.001 && found.rms_at_edges < 0.03, "{found:?}");
}
