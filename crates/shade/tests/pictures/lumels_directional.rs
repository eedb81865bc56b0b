//! Lumels that tell how light depends on the normal, on a surface with a normal map.

use std::sync::Arc;

use glam::{UVec2, Vec3, Vec4};
use lumencast_charts::{laid_out, sheets};
use lumencast_gather::path_trace::{CpuPathTracer, Options};
use lumencast_gather::reference::Parts;
use lumencast_light::Light;
use lumencast_scene::{LightmapSpec, Material, Snapshot, View};
use lumencast_shade::{Lighting, Settings, Shading};
use lumencast_solve::{Bake, Effort, GatherOptions, bake};
use lumencast_testkit::scenes::{Stage, lambert};

use crate::common::{renderer, traced};
use crate::materials::{bumps, map};

/// A bumpy floor beside a wall that shines.
fn scene() -> Arc<Snapshot> {
    let mut stage = Stage::default();
    let grey = lambert(Vec3::splat(0.7), Vec3::ZERO);
    let bumpy = stage.material(Material { normal_texture: map(bumps()), ..grey });
    let lamp = stage.material(Material {
        base_color: Vec4::new(0.0, 0.0, 0.0, 1.0),
        ..lambert(Vec3::ZERO, Vec3::new(9.0, 7.0, 5.0))
    });
    stage.quad(Vec3::new(-1.0, 0.0, 1.0), 2.0 * Vec3::X, -2.0 * Vec3::Z, bumpy);
    stage.quad(Vec3::new(2.0, 0.2, -1.0), 2.0 * Vec3::Z, 1.5 * Vec3::Y, lamp);
    stage.snapshot()
}

/// Light at lumels of the scene, which tells how it depends on the normal or does not.
fn light(scene: &Arc<Snapshot>, directional: bool) -> Light {
    let mut tracer = CpuPathTracer::new(Options::default()).expect("threads");
    let sheets = sheets(scene, None, &|_| true).expect("charts").sheets;
    let laid_out = laid_out(&sheets, LightmapSpec::Size(64)).expect("a layout");
    let wanted = Bake {
        scene,
        volumes: &[],
        lightmap: Some(&laid_out),
        effort: Effort::of_samples(256),
        options: GatherOptions { bounces: 0, directional, ..GatherOptions::default() },
    };
    let baked = bake(wanted, &mut tracer, |_| {}).expect("light");
    assert_eq!(
        baked.fields.iter().all(|f| f.as_lightmap().is_some_and(|l| l.slopes.is_some())),
        directional
    );
    Light::new(baked.fields)
}

/// Root mean square of what pixels differ by, over the mean of the right ones.
fn apart(drawn: &[Vec3], right: &[Vec3]) -> f32 {
    let squares: f32 = drawn.iter().zip(right).map(|(a, b)| a.distance_squared(*b)).sum();
    let mean = right.iter().map(|pixel| pixel.length()).sum::<f32>() / right.len() as f32;
    (squares / right.len() as f32).sqrt() / mean
}

#[test]
fn bumps_are_lit_from_where_light_comes() {
    let scene = scene();
    let settings = Settings {
        size: UVec2::new(64, 64),
        samples: 4,
        shading: Shading::Samples,
        lighting: Lighting::INDIRECT,
        ..Settings::default()
    };
    let view = View::look_at(Vec3::new(-0.1, 2.0, 0.2), Vec3::new(-0.1, 0.0, 0.0), 0.8).unwrap();
    let right = traced(&scene, view, &settings, Parts::Indirect, 256);
    let mut renderer = renderer(&scene, &settings);
    let [flat, sloped, again] = [false, true, false].map(|directional| {
        renderer.set_light(&light(&scene, directional)).unwrap();
        renderer.pictures(&[view], &settings).unwrap().remove(0)
    });
    let (flat_apart, sloped_apart) = (apart(&flat, &right), apart(&sloped, &right));
    assert!(flat_apart > 0.15, "bumps show in the right picture: {flat_apart}");
    assert!(sloped_apart < 0.25 * flat_apart, "{sloped_apart}, without slopes {flat_apart}");
    assert_eq!(apart(&flat, &again), 0.0, "slopes go with the light that told them");
}
