//! Probes fitted to surfaces, tick by tick.

use std::sync::Arc;

use glam::{UVec3, Vec3};
use lumencast_codec::{Catalog, EncodedRegion, Epoch};
use lumencast_gather::path_trace::{CpuPathTracer, Options};
use lumencast_light::ProbeVolume;
use lumencast_scene::{Edit, LightSpec, NodeId, Scene, Transform, VolumeSpec};
use lumencast_server::{Mail, Outlet, Received, SampleRange, Tick, TickOptions};
use lumencast_solve::{Bake, Effort, FitOptions, GatherOptions, bake};

const FIT: FitOptions = FitOptions { points: 16 };

/// Nobody listens.
struct Nowhere;

impl Outlet for Nowhere {
    fn is_watched(&self, _: u32, _: u32) -> bool {
        false
    }
    fn catalog(&mut self, _: &Catalog) {}
    fn state(&mut self, _: Vec<u8>, _: bool) {}
    fn light(&mut self, _: u32, _: EncodedRegion) {}
}

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

fn baked(scene: &mut Scene, fit: Option<FitOptions>) -> ProbeVolume {
    let snapshot: Arc<_> = scene.snapshot();
    let effort = Effort::of_samples(4096);
    let (volumes, options) = (volumes(), gather(fit));
    let (scene, volumes) = (&snapshot, &volumes);
    let wanted = Bake { scene, volumes, lightmap: None, effort, options };
    let light = bake(wanted, &mut tracer(), |_| ()).expect("light");
    light.fields[0].as_volume().expect("a volume").clone()
}

/// Root of the mean square of the differences of irradiance on the floor and three walls, over the
/// second one's mean.
fn difference(a: &ProbeVolume, b: &ProbeVolume) -> f32 {
    let walls = [
        (Vec3::Y, Vec3::Y),
        (Vec3::new(-1.0, 1.0, 0.0), Vec3::X),
        (Vec3::new(1.0, 1.0, 0.0), Vec3::NEG_X),
        (Vec3::new(0.0, 1.0, -1.0), Vec3::Z),
    ];
    let (mut squares, mut sum) = (0.0, 0.0);
    for (middle, normal) in walls {
        let (u, v) = normal.any_orthonormal_pair();
        for i in 0..100_u8 {
            let at = |k: u8| f32::from(k) * 0.2 - 0.9;
            let at = (middle - middle.y * Vec3::Y * normal.y) + at(i % 10) * u + at(i / 10) * v;
            let read = |light: &ProbeVolume| light.sample(at, normal).irradiance(normal).y;
            squares += (read(a) - read(b)).powi(2);
            sum += read(b);
        }
    }
    (squares * 400.0).sqrt() / sum
}

struct Stepped {
    tick: Tick,
}

impl Stepped {
    fn new() -> Self {
        let options = TickOptions {
            samples: SampleRange::fixed(256),
            gather: gather(Some(FIT)),
            volumes: volumes(),
            ..TickOptions::default()
        };
        let tick = Tick::new(scene(), Box::new(tracer()), options, Epoch(1)).expect("a tick");
        Self { tick }
    }

    fn steps(&mut self, count: u32, mut edits: Vec<Edit>) {
        for _ in 0..count {
            let received = |edit| Received { client: "a".into(), seq: 1, edit, temporary: false };
            let edits = edits.drain(..).map(received).collect();
            let mail = Mail { edits, ..Mail::default() };
            // Time stands still, so that there is one truth to come to.
            let report = self.tick.step(0.0, mail, &mut Nowhere);
            assert_eq!(report.refused, 0);
        }
    }

    fn node(&self, name: &str) -> NodeId {
        self.tick.scene().nodes().find(|node| node.name == name).expect(name).id
    }

    fn light(&self) -> &ProbeVolume {
        self.tick.light().volumes().next().expect("a volume")
    }
}

#[test]
fn ticks_come_to_what_is_baked() {
    let mut stepped = Stepped::new();
    stepped.steps(80, Vec::new());
    let fitted = baked(&mut scene(), Some(FIT));
    let plain = baked(&mut scene(), None);
    let [near, far] = [&fitted, &plain].map(|light| difference(stepped.light(), light));
    assert!(near < 0.12 && far > 3.0 * near, "{near} {far}");
}

/// A lamp four times as bright, and a box that stands elsewhere: light of the old scene is gone soon,
/// and points that have moved begin anew.
#[test]
fn the_fit_follows_lights_and_shapes() {
    let mut stepped = Stepped::new();
    stepped.steps(40, Vec::new());
    let intensity = LightSpec { intensity: Some(12.0), ..LightSpec::default() };
    let away = Transform { translation: Some(Vec3::new(0.45, 1.2, 0.3)), ..Transform::default() };
    let edits = vec![
        Edit::SetLight { node: stepped.node("lamp"), light: intensity },
        Edit::MoveNode { node: stepped.node("tall box"), transform: away },
    ];
    let mut moved = scene();
    for edit in &edits {
        moved.apply(edit).expect("an edit");
    }
    let now = baked(&mut moved, Some(FIT));
    let before = difference(stepped.light(), &now);
    stepped.steps(60, edits);
    let after = difference(stepped.light(), &now);
    assert!(before > 0.3 && after < 0.13, "{before} {after}");
}
