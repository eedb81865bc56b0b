//! Light that is computed until it has converged.

use std::f32::consts::PI;

use glam::{Quat, UVec3, Vec3};
use lumencast_charts::{laid_out, sheets};
use lumencast_gather::path_trace::{CpuPathTracer, Options};
use lumencast_light::{Grid, Order};
use lumencast_scene::{Environment, LightmapSpec, Material, Scene, VolumeSpec};
use lumencast_solve::{Bake, Done, Effort, FitOptions, GatherOptions, Spent, bake};
use lumencast_testkit::scenes::{Stage, lambert};

const FIT: FitOptions = FitOptions { points: 16 };

fn tracer() -> CpuPathTracer {
    CpuPathTracer::new(Options::default()).expect("threads")
}

fn scene() -> Scene {
    Scene::builtin("cornell").expect("a built-in scene")
}

fn volumes() -> Vec<VolumeSpec> {
    let mut volume = scene().volumes()[0];
    volume.grid.resolution = UVec3::splat(4);
    vec![volume]
}

fn gather(fit: Option<FitOptions>) -> GatherOptions {
    GatherOptions { bounces: 2, fit, ..GatherOptions::default() }
}

/// Light goes on until its noise is as low as asked for, or to the samples allowed; and what it tells of
/// its noise is true.
#[test]
fn baking_ends_by_its_noise() {
    let snapshot = scene().snapshot();
    let sheets = sheets(&snapshot, None, &|_| true).expect("charts").sheets;
    let lumels = laid_out(&sheets, LightmapSpec::Size(64)).expect("a layout");
    let subjects = [
        (volumes(), None, gather(None)),
        (volumes(), None, gather(Some(FIT))),
        (Vec::new(), Some(&lumels), gather(None)),
    ];
    for (volumes, lightmap, options) in subjects {
        let light = |effort: Effort, told: &mut Vec<Done>| {
            let wanted = Bake { scene: &snapshot, volumes: &volumes, lightmap, effort, options };
            let baked = bake(wanted, &mut tracer(), |done| told.push(done)).expect("light");
            baked.lumels.unwrap_or(baked.probes)
        };
        let mut told = Vec::new();
        let rough = light(Effort { noise: Some(4.0), ..Effort::of_samples(1 << 20) }, &mut told);
        assert!(rough.samples < 1 << 18 && rough.noise.is_some_and(|noise| noise <= 4.0));
        assert_eq!(told.last().map(|done| (done.share, done.noise)), Some((1.0, rough.noise)));
        assert!(told.windows(2).all(|pair| pair[0].share <= 1.0));
        let noise = |samples| {
            let effort = Effort { noise: Some(1e-6), ..Effort::of_samples(samples) };
            light(effort, &mut Vec::new()).noise.expect("noise")
        };
        let (few, many) = if lightmap.is_some() { (64, 1024) } else { (1024, 16_384) };
        let ratio = noise(few) / noise(many);
        assert!(ratio > 2.0, "16 times the samples, a quarter of the noise at most: {ratio}");
    }
    let (volumes, effort, options) = (volumes(), Effort::of_samples(300), gather(None));
    let lightmap = Some(&lumels);
    let wanted = Bake { scene: &snapshot, volumes: &volumes, lightmap, effort, options };
    let off = bake(wanted, &mut tracer(), |_| ()).expect("light");
    let spent = Spent { samples: 300, noise: None };
    assert_eq!((off.probes, off.lumels), (spent, Some(spent)));
    assert_eq!(off.fields.len(), volumes.len() + 1);
}

/// A closed box that its volume spans to the millimetre, under an even sky: all probes are within, and
/// its faces, which none of them sees, are as bright as the sky.
#[test]
fn what_stands_on_the_border_is_lit_from_outside() {
    for double_sided in [false, true] {
        let mut stage = Stage::default();
        let grey = Material { double_sided, ..lambert(Vec3::splat(0.5), Vec3::ZERO) };
        let grey = stage.material(grey);
        stage.room(Vec3::ZERO, Vec3::splat(-2.0), grey);
        stage.environment(Environment::Constant { radiance: Vec3::ONE });
        let (size, resolution) = (Vec3::splat(2.0), UVec3::splat(4));
        let grid = Grid { center: Vec3::ZERO, rotation: Quat::IDENTITY, size, resolution };
        let volume = VolumeSpec { grid, order: Order::L2 };
        let (effort, options) = (Effort::of_samples(1024), gather(Some(FIT)));
        let (scene, volumes) = (&stage.snapshot(), &[volume]);
        let wanted = Bake { scene, volumes, lightmap: None, effort, options };
        let baked = bake(wanted, &mut tracer(), |_| ()).expect("light");
        let light = baked.fields[0].as_volume().expect("a volume");
        for normal in Vec3::AXES.into_iter().flat_map(|axis| [axis, -axis]) {
            let (u, v) = normal.any_orthonormal_pair();
            for (x, y) in [(0.0, 0.0), (0.8, 0.3), (-0.5, 0.9)] {
                let read = light.sample(normal + x * u + y * v, normal).irradiance(normal).y;
                assert!((read / PI - 1.0).abs() < 0.1, "{read} at {x} {y} of {normal}");
            }
        }
    }
}
