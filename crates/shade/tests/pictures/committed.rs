//! Pictures beside committed ones, by FLIP: what no other test looks for would show in them. After a
//! change that is meant, `LUMENCAST_BLESS=1` writes them anew; they are to be looked at then.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::common::renderer;
use glam::{Quat, UVec2, UVec3, Vec3};
use lumencast_gather::path_trace::{CpuPathTracer, Options};
use lumencast_light::{FieldId, Grid, Light, Order, ProbeVolume};
use lumencast_picture::{Loaded, PIXELS_PER_DEGREE, Pair, Picture, ToneMap, flip};
use lumencast_scene::{
    Environment, LightKind, Material, PunctualLight, Scene, Snapshot, View, VolumeSpec,
};
use lumencast_shade::{Materials, Settings, Shading, Shadows};
use lumencast_solve::{Bake, Effort, GatherOptions, bake};
use lumencast_testkit::scenes::{Stage, lambert};

/// Mean FLIP that adapters may differ by: rounding, and samples at other places.
const TOLERANCE: f64 = 0.005;

/// A scene with its light, as it is drawn.
#[derive(Clone)]
struct Drawn {
    scene: Arc<Snapshot>,
    light: Light,
    view: View,
    exposure: f32,
}

fn settings() -> Settings {
    Settings {
        size: UVec2::new(240, 160),
        samples: 4,
        shading: Shading::Samples,
        ..Settings::default()
    }
}

impl Drawn {
    fn picture(&self, settings: &Settings) -> Picture {
        let settings = Settings { pre_exposure: self.exposure, ..*settings };
        let mut renderer = renderer(&self.scene, &settings);
        renderer.set_light(&self.light).unwrap();
        let pixels = renderer.pictures(&[self.view], &settings).unwrap().remove(0);
        // As a file has them: eight bits.
        let code = |linear: Vec3| {
            (255.0 * ToneMap::Neutral.encode(linear * self.exposure)).round() / 255.0
        };
        Picture::new(settings.size.x, settings.size.y, pixels).unwrap().map(code)
    }
}

/// How far a picture of codes is from the committed one; the picture is left beside the tests'
/// others.
fn distance(name: &str, codes: &Picture) -> f64 {
    let drawn = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("{name}.png"));
    let linear = codes.map(lumencast_picture::linear_from_srgb);
    linear.write_png(&drawn, ToneMap::Srgb, 1.0).unwrap();
    if std::env::var_os("LUMENCAST_BLESS").is_some() {
        std::fs::copy(&drawn, committed(name)).unwrap();
    }
    let error = flip_from_committed(name, codes);
    eprintln!("{name}: FLIP {error:.4}, {}", drawn.display());
    error
}

fn flip_from_committed(name: &str, codes: &Picture) -> f64 {
    let committed = committed(name);
    let Loaded::Coded(reference) = Loaded::read(&committed).unwrap() else {
        panic!("{} is no PNG", committed.display())
    };
    flip(&Pair::new(&reference, codes).unwrap(), PIXELS_PER_DEGREE).mean()
}

fn committed(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/pictures/committed");
    folder.join(format!("{name}.png"))
}

/// The Cornell box under light that was computed for it.
fn cornell() -> Drawn {
    let mut scene = Scene::open("cornell").unwrap();
    let view = scene.views()[0].view;
    let mut volume: VolumeSpec = scene.volumes()[0];
    volume.grid.resolution = UVec3::splat(4);
    let mut tracer = CpuPathTracer::new(Options::default()).unwrap();
    let snapshot = scene.snapshot();
    let options = GatherOptions::default();
    let effort = Effort::of_samples(1024);
    let wanted = Bake { scene: &snapshot, volumes: &[volume], lightmap: None, effort, options };
    let light = bake(wanted, &mut tracer, |_| ()).unwrap();
    Drawn { scene: snapshot, light: Light::new(light.fields), view, exposure: 2.0 }
}

/// Two rows of balls, metal and plastic, smooth to rough, and a glass one, under a sun, a lamp and a
/// sky, with light that comes from above and from the left.
fn materials(roughness: impl Fn(f32) -> f32) -> Drawn {
    let mut stage = Stage::default();
    let floor = stage.material(lambert(Vec3::new(0.6, 0.55, 0.5), Vec3::ZERO));
    stage.quad(Vec3::new(-4.0, 0.0, 3.0), Vec3::X * 8.0, Vec3::NEG_Z * 6.0, floor);
    for i in 0..5u8 {
        let rough = roughness(0.1 + 0.2 * f32::from(i));
        let place = |z: f32| Vec3::new(1.3 * (f32::from(i) - 2.0), 0.55, z);
        let gold = Vec3::new(0.9, 0.65, 0.3).extend(1.0);
        let metal = Material { base_color: gold, metallic: 1.0, roughness: rough, ..plain() };
        let red = Vec3::new(0.6, 0.08, 0.05).extend(1.0);
        let plastic = Material { base_color: red, roughness: rough, ..plain() };
        let (metal, plastic) = (stage.material(metal), stage.material(plastic));
        stage.sphere(place(-0.9), 0.55, 24, metal);
        stage.sphere(place(0.7), 0.55, 24, plastic);
    }
    let glass = Material { transmission: 0.9, roughness: 0.1, ..plain() };
    let glass = stage.material(glass);
    stage.sphere(Vec3::new(0.6, 0.35, 1.9), 0.35, 24, glass);
    let light = |kind, intensity| PunctualLight { kind, color: Vec3::ONE, intensity, range: None };
    let sun = light(LightKind::Directional { angle: 0.15 }, 2000.0);
    stage.light(sun, Vec3::ZERO, Vec3::new(0.5, -1.0, -0.4));
    let lamp = light(LightKind::Point { radius: 0.3 }, 3000.0);
    stage.light(lamp, Vec3::new(-2.5, 2.0, 1.5), Vec3::NEG_Y);
    let sky = [Vec3::new(300.0, 500.0, 900.0), Vec3::splat(700.0), Vec3::splat(200.0)];
    let [zenith, horizon, ground] = sky;
    stage.environment(Environment::Sky { zenith, horizon, ground });
    let view = View::look_at(Vec3::new(0.0, 3.6, 7.5), Vec3::new(0.0, 0.35, 0.3), 0.62).unwrap();
    Drawn { scene: stage.snapshot(), light: slanting(), view, exposure: 1.0 / 2200.0 }
}

fn plain() -> Material {
    Material { metallic: 0.0, ..Material::default() }
}

/// Light that is brighter from above and from the left, and to the right of the scene.
fn slanting() -> Light {
    let grid = Grid {
        center: Vec3::Y,
        rotation: Quat::IDENTITY,
        size: Vec3::new(8.0, 2.0, 6.0),
        resolution: UVec3::new(5, 2, 4),
    };
    let mut volume = ProbeVolume::dark(FieldId(0), grid, Order::L2);
    for probe in 0..grid.probe_count() {
        let at = grid.position(grid.cell(probe));
        let bright = (0.15 * at.x).exp2();
        let sh = volume.probe_mut(probe);
        sh[0] = bright * Vec3::new(900.0, 1000.0, 1200.0);
        sh[1] = bright * Vec3::splat(600.0);
        sh[3] = bright * Vec3::new(-500.0, -200.0, 0.0);
        sh[6] = bright * Vec3::splat(150.0);
    }
    Light::new(vec![volume])
}

#[test]
fn pictures_are_as_committed() {
    for (name, drawn) in [("cornell", cornell()), ("materials", materials(|r| r))] {
        let error = distance(name, &drawn.picture(&settings()));
        assert!(error < TOLERANCE, "{name}: FLIP {error}");
    }
}

/// What becomes of light when the band along y has the other sign.
fn upside_down(mut drawn: Drawn) -> Drawn {
    for volume in drawn.light.volumes_mut() {
        for probe in 0..volume.grid.probe_count() {
            volume.probe_mut(probe)[1] *= -1.0;
        }
    }
    drawn
}

fn without_field(drawn: Drawn) -> Drawn {
    Drawn { light: Light::default(), ..drawn }
}

/// Faults that one makes: each shows by more than twice the tolerance.
#[test]
fn faults_are_noticed() {
    let no_shadows = Shadows { resolution: 0, ..Shadows::default() };
    let no_shadows = Settings { shadows: no_shadows, ..settings() };
    let plain = Settings { materials: Materials::Lambert, ..settings() };
    let cornell = cornell();
    for (name, fault, drawn, settings) in [
        ("materials", "a band with the other sign", upside_down(materials(|r| r)), settings()),
        ("materials", "roughness for its square", materials(|r| r * r), settings()),
        ("materials", "no indirect light", without_field(materials(|r| r)), settings()),
        ("materials", "no shadows", materials(|r| r), no_shadows),
        ("cornell", "a band with the other sign", upside_down(cornell.clone()), settings()),
        ("cornell", "no indirect light", without_field(cornell.clone()), settings()),
        ("cornell", "no shadows", cornell.clone(), no_shadows),
        ("cornell", "no maps but of the base colour", cornell, plain),
    ] {
        let error = flip_from_committed(name, &drawn.picture(&settings));
        eprintln!("{name}, {fault}: FLIP {error:.4}");
        assert!(error > 2.0 * TOLERANCE, "{name}, {fault}: FLIP {error}");
    }
}
