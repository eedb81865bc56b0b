//! Scenes, fields and sizes that nobody means.

use crate::common::{SIZE, drawn, renderer};
use glam::{Quat, UVec2, UVec3, Vec3};
use lumencast_light::{FieldId, Grid, Light, Order, ProbeVolume};
use lumencast_scene::{Environment, LightKind, PunctualLight, Scene, View};
use lumencast_shade::{Gpu, GpuError, Lighting, Renderer, Settings, ShadeError, Transparency};
use lumencast_testkit::scenes::{Stage, lambert};

fn view() -> View {
    View::look_at(Vec3::new(1.0, 2.5, 4.0), Vec3::ZERO, 0.9).unwrap()
}

fn settings() -> Settings {
    Settings { size: SIZE, ..Settings::default() }
}

fn lit_by(
    lights: impl IntoIterator<Item = (PunctualLight, Vec3)>,
) -> std::sync::Arc<lumencast_scene::Snapshot> {
    let mut stage = Stage::default();
    let white = stage.material(lambert(Vec3::splat(0.8), Vec3::ZERO));
    stage.quad(Vec3::new(-3.0, 0.0, 3.0), Vec3::X * 6.0, Vec3::NEG_Z * 6.0, white);
    for (light, position) in lights {
        stage.light(light, position, Vec3::NEG_Y);
    }
    stage.snapshot()
}

#[test]
fn no_lights_and_five_hundred() {
    let dark = drawn(&lit_by([]), view(), &settings());
    assert!(dark.iter().all(|p| *p == Vec3::ZERO));
    let light = |i: u32| {
        let at = Vec3::new((i % 25) as f32 * 0.2 - 2.5, 1.0, (i / 25) as f32 * 0.2 - 2.0);
        let kind = LightKind::Point { radius: 0.0 };
        (PunctualLight { kind, color: Vec3::ONE, intensity: 1.0, range: None }, at)
    };
    let scene = lit_by((0..500).map(light));
    let mut renderer = renderer(&scene, &settings());
    let settings = Settings { size: UVec2::new(24, 16), samples: 1, ..settings() };
    let (pictures, told) = renderer.pictures_with(&[view()], &settings).unwrap();
    assert!(told.lights_without_shadow > 0 && told.shadow_maps > 0, "{told:?}");
    let brightest = pictures[0].iter().map(|p| p.x).fold(0.0, f32::max);
    assert!(brightest.is_finite() && brightest > 10.0, "{brightest}");
}

#[test]
fn a_sun_of_a_hundred_thousand_lux() {
    let kind = LightKind::Directional { angle: 0.009 };
    let sun = PunctualLight { kind, color: Vec3::ONE, intensity: 1e5, range: None };
    let scene = lit_by([(sun, Vec3::ZERO)]);
    let settings = Settings { pre_exposure: 1e-4, ..settings() };
    let picture = drawn(&scene, view(), &settings);
    let middle = picture[(SIZE.y / 2 * SIZE.x + SIZE.x / 2) as usize].x;
    // ρ/π · E
    assert!((middle / (0.8 / std::f32::consts::PI * 1e5) - 1.0).abs() < 2e-3, "{middle}");
}

#[test]
fn impossible_sizes_are_refused() {
    let scene = lit_by([]);
    let mut renderer = renderer(&scene, &settings());
    for size in [UVec2::ZERO, UVec2::new(0, 5), UVec2::new(5, 1 << 20)] {
        let error = renderer.pictures(&[view()], &Settings { size, ..settings() }).unwrap_err();
        assert!(matches!(error, ShadeError::Gpu(GpuError::Size { .. })), "{error}");
    }
    assert!(renderer.pictures(&[view()], &settings()).is_ok(), "and it goes on");
    assert!(renderer.pictures(&[], &settings()).unwrap().is_empty());
}

#[test]
fn a_field_too_large_for_the_adapter_is_refused() {
    let grid = Grid {
        center: Vec3::ZERO,
        rotation: Quat::IDENTITY,
        size: Vec3::ONE,
        resolution: UVec3::new(1, 1, 4000),
    };
    let light = Light::new(vec![ProbeVolume::dark(FieldId(0), grid, Order::L4)]);
    let mut renderer = renderer(&lit_by([]), &settings());
    let error = renderer.set_light(&light).unwrap_err();
    assert!(error.to_string().contains("fewer or coarser"), "{error}");
    renderer.set_light(&Light::default()).unwrap();
}

#[test]
fn an_empty_scene_shows_its_environment() {
    let mut stage = Stage::default();
    stage.environment(Environment::Constant { radiance: Vec3::new(1.0, 2.0, 3.0) });
    let picture = drawn(&stage.snapshot(), view(), &settings());
    assert!(picture.iter().all(|p| (*p - Vec3::new(1.0, 2.0, 3.0)).abs().max_element() < 0.01));
}

/// Skinned, morphed and animated meshes, masks, blending, every sampler: the samples of glTF where
/// they are at hand, and the built-in scenes; nothing is NaN, and one renderer draws them all.
#[test]
fn every_scene_can_be_drawn() {
    let samples = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/scenes");
    let mut names: Vec<String> =
        lumencast_scene::BUILTINS.iter().map(|name| (*name).to_owned()).collect();
    if let Ok(folders) = std::fs::read_dir(samples.join("samples")) {
        for folder in folders.flatten() {
            let name = folder.file_name().to_string_lossy().into_owned();
            names.push(folder.path().join(name + ".glb").display().to_string());
        }
    }
    let mut renderer = Renderer::new(Gpu::new().unwrap(), &settings());
    for name in names {
        let mut scene = Scene::open(&name).unwrap();
        for transparency in [Transparency::Coverage, Transparency::Sorted] {
            scene.advance(0.3);
            renderer.set_scene(&scene.snapshot());
            let view = scene.cameras().first().map_or_else(view, |camera| camera.view());
            let settings = Settings { transparency, ..settings() };
            let picture = renderer.pictures(&[view], &settings).unwrap().remove(0);
            assert!(picture.iter().all(|p| p.is_finite()), "{name}");
        }
    }
}

/// Parts of the light add up to all of it.
#[test]
fn parts_add_up() {
    let mut scene = Scene::open("cornell").unwrap();
    let grid = Grid {
        center: Vec3::Y,
        rotation: Quat::IDENTITY,
        size: Vec3::splat(2.0),
        resolution: UVec3::splat(2),
    };
    let mut volume = ProbeVolume::dark(FieldId(0), grid, Order::L2);
    (0..8).for_each(|probe| volume.probe_mut(probe)[0] = Vec3::new(1.0, 2.0, 3.0));
    let view = scene.cameras()[0].view();
    let mut renderer = renderer(&scene.snapshot(), &settings());
    renderer.set_light(&Light::new(vec![volume])).unwrap();
    let mut of = |lighting| {
        renderer.pictures(&[view], &Settings { lighting, ..settings() }).unwrap().remove(0)
    };
    let (all, direct) = (of(Lighting::FIELD), of(Lighting::DIRECT));
    let (indirect, none) = (of(Lighting::INDIRECT), of(Lighting::NONE));
    for (((all, direct), indirect), none) in all.iter().zip(&direct).zip(&indirect).zip(&none) {
        let sum = *direct + *indirect;
        assert!((*all - sum).abs().max_element() <= 4e-3 * all.max_element(), "{all} {sum}");
        assert!(none.cmple(*direct + 1e-3 * *direct).all());
    }
}
