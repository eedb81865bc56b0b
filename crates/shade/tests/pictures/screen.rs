//! Pictures shown on the device: the same codes as the processor's tone maps give, measured and timed.

use std::sync::Arc;

use crate::common::{SIZE, renderer};
use glam::{UVec2, Vec3};
use lumencast_gpu::{TextureCopy, textures};
use lumencast_light::Light;
use lumencast_picture::{Picture, ToneMap, luminance};
use lumencast_scene::{
    Deformation, Environment, LightKind, MorphTarget, PunctualLight, Scene, Snapshot, View,
};
use lumencast_shade::{
    Gpu, GpuError, Measured, Occlusion, Renderer, Screen, Settings, ShadeError, Show, wgpu,
};
use lumencast_testkit::scenes::{Stage, lambert};

const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;

/// A texture that is shown on in place of a window's, and its codes.
struct Shown {
    texture: wgpu::Texture,
}

impl Shown {
    fn new(gpu: &Gpu, size: UVec2) -> Self {
        let usage = wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC;
        Self { texture: gpu.device().create_texture(&textures::plane(size, FORMAT, usage)) }
    }

    fn view(&self) -> wgpu::TextureView {
        self.texture.create_view(&Default::default())
    }

    fn codes(&self, gpu: &Gpu) -> Vec<[u8; 3]> {
        let mut encoder = gpu.device().create_command_encoder(&Default::default());
        let copy = TextureCopy::new(gpu, &mut encoder, &self.texture);
        gpu.queue().submit([encoder.finish()]);
        let mut codes = Vec::new();
        let read = copy.wait(gpu, "reading codes", |row| {
            codes.extend(row.as_chunks::<4>().0.iter().map(|p| [p[0], p[1], p[2]]));
        });
        read.expect("codes");
        codes
    }
}

/// Shows a frame, and waits for what is measured of it.
fn show(
    renderer: &mut Renderer,
    screen: &mut Screen,
    view: &View,
    settings: &Settings,
    how: Show,
) -> (Vec<[u8; 3]>, Measured) {
    let shown = Shown::new(renderer.gpu(), settings.size);
    renderer.show(view, settings, screen, how, &shown.view()).unwrap();
    let codes = shown.codes(renderer.gpu());
    let measured = screen.measured(renderer.gpu()).unwrap().expect("the frame is done");
    assert_eq!(screen.measured(renderer.gpu()).unwrap(), None, "once");
    (codes, measured)
}

/// What `web/viewer/src/view/exposure.ts` has as the exposure of a picture.
fn suited(picture: &Picture) -> f32 {
    let mut lit: Vec<f32> =
        picture.pixels().iter().map(|p| luminance(*p)).filter(|y| *y > 1e-6).collect();
    lit.sort_by(f32::total_cmp);
    let at = |share: f64| (share * lit.len() as f64) as usize;
    let middle = &lit[at(0.1)..at(0.95)];
    let average = (middle.iter().map(|y| y.ln()).sum::<f32>() / middle.len() as f32).exp();
    (0.2 / average).min(3.0 / lit[at(0.97)])
}

#[test]
fn codes_and_exposure_are_the_processors() {
    let mut scene = Scene::open("cornell").unwrap();
    let view = scene.views()[0].view;
    let settings = Settings { size: SIZE, samples: 1, ..Settings::default() };
    let mut renderer = renderer(&scene.snapshot(), &settings);
    renderer.set_light(&Light::default()).unwrap();
    let picture = renderer.pictures(&[view], &settings).unwrap().remove(0);
    let picture = Picture::new(SIZE.x, SIZE.y, picture).unwrap();
    let best = suited(&picture);
    let mut screen = Screen::new(renderer.gpu(), FORMAT);
    for tone_map in ToneMap::ALL {
        for brighter in [1.0, 8.0] {
            let settings = Settings { pre_exposure: 0.5 * best, ..settings };
            let how = Show { exposure: best * brighter, tone_map };
            let (codes, measured) = show(&mut renderer, &mut screen, &view, &settings, how);
            for (code, linear) in codes.iter().zip(picture.pixels()) {
                let expected = 255.0 * tone_map.encode(*linear * how.exposure);
                let got = Vec3::from(code.map(f32::from));
                // Half a code of rounding at random, half a code of rounding, and for half floats
                // and the device's powers a tenth.
                let most = 1.1;
                let off = (got - expected).abs().max_element();
                assert!(off <= most, "{tone_map}: {got} for {expected}");
                assert!(*linear != Vec3::ZERO || *code == [0; 3], "black stays black");
            }
            let measured = measured.exposure.expect("there is light");
            assert!((measured / best).log2().abs() < 1.0 / 12.0, "{measured} for {best}");
        }
    }
}

/// A point light over a floor that is being morphed, with occlusion: passes of every kind.
fn morphing() -> Arc<Snapshot> {
    let mut stage = Stage::default();
    let white = stage.material(lambert(Vec3::ONE, Vec3::ZERO));
    stage.quad(Vec3::new(-1.0, 0.0, -1.0), Vec3::Z * 2.0, Vec3::X * 2.0, white);
    let kind = LightKind::Point { radius: 0.0 };
    let light = PunctualLight { kind, color: Vec3::ONE, intensity: 30.0, range: None };
    stage.light(light, Vec3::Y, Vec3::NEG_Y);
    let mut snapshot = (*stage.snapshot()).clone();
    let instance = &mut snapshot.instances[0];
    let mut mesh = (*instance.mesh).clone();
    for primitive in &mut mesh.primitives {
        let positions = vec![Vec3::Y; primitive.vertices.positions.len()];
        primitive.morph_targets = vec![MorphTarget { positions, ..MorphTarget::default() }];
    }
    instance.mesh = Arc::new(mesh);
    let deformation = Deformation::new(instance.mesh.clone(), vec![0.1], None);
    instance.deformation = Some(Arc::new(deformation));
    Arc::new(snapshot)
}

#[test]
fn every_pass_is_timed_that_is_drawn() {
    let view = View::look_at(Vec3::new(0.0, 2.0, 2.0), Vec3::ZERO, 1.0).unwrap();
    let settings =
        Settings { size: SIZE, occlusion: Some(Occlusion::default()), ..Settings::default() };
    let mut renderer = renderer(&morphing(), &settings);
    let mut screen = Screen::new(renderer.gpu(), FORMAT);
    let how = Show { exposure: 1.0, tone_map: ToneMap::Srgb };
    let mut times = || show(&mut renderer, &mut screen, &view, &settings, how).1.time;
    // An adapter without a clock tells nothing, ever.
    let (Some(first), Some(second)) = (times(), times()) else { return };
    assert!(first.deformation > 0.0 && first.shadows > 0.0, "{first:?}");
    assert!((second.deformation, second.shadows) == (0.0, 0.0), "kept: {second:?}");
    for time in [first, second] {
        assert!(time.occlusion > 0.0 && time.pictures > 0.0 && time.screen > 0.0, "{time:?}");
    }
}

#[test]
fn nothing_is_measured_of_black_pictures() {
    let mut stage = Stage::default();
    let view = View::look_at(Vec3::Z, Vec3::ZERO, 1.0).unwrap();
    let settings = Settings { size: UVec2::new(33, 17), ..Settings::default() };
    let mut renderer = renderer(&stage.snapshot(), &settings);
    let mut screen = Screen::new(renderer.gpu(), FORMAT);
    let how = Show { exposure: 1.0, tone_map: ToneMap::Srgb };
    let (codes, measured) = show(&mut renderer, &mut screen, &view, &settings, how);
    assert!(codes.iter().all(|code| *code == [0; 3]));
    assert_eq!(measured.exposure, None);

    stage.environment(Environment::Constant { radiance: Vec3::splat(1e5) });
    renderer.set_scene(&stage.snapshot());
    let settings = Settings { pre_exposure: 1e-5, ..settings };
    let how = Show { exposure: 1e-5, ..how };
    let (codes, measured) = show(&mut renderer, &mut screen, &view, &settings, how);
    assert!(codes.iter().all(|code| code.iter().all(|c| *c >= 254)));
    let measured = measured.exposure.expect("white");
    assert!((1e5 * measured / 0.2 - 1.0).abs() < 0.06, "{measured}");
}

/// A device that is lost says so, without a panic; another one goes on.
#[test]
fn lost_devices_are_told() {
    let mut scene = Scene::open("cornell").unwrap();
    let view = scene.views()[0].view;
    let settings = Settings { size: SIZE, samples: 1, ..Settings::default() };
    let mut first = renderer(&scene.snapshot(), &settings);
    let before = first.pictures(&[view], &settings).unwrap();
    first.gpu().device().destroy();
    let error = first.pictures(&[view], &settings).unwrap_err();
    assert!(matches!(error, ShadeError::Gpu(GpuError::Failed { .. })), "{error}");
    let mut second = renderer(&scene.snapshot(), &settings);
    assert_eq!(second.pictures(&[view], &settings).unwrap(), before);
}
