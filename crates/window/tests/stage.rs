//! A window's frames without a window: what is drawn, and what pointer and keys do.

use std::path::PathBuf;

use egui::{Event, Key, Modifiers, PointerButton, Pos2, RawInput, Rect, pos2, vec2};
use glam::{UVec2, Vec3};
use lumencast_light::Light;
use lumencast_picture::{Loaded, ToneMap};
use lumencast_scene::Scene;
use lumencast_shade::{Gpu, Lighting, Settings, wgpu};
use lumencast_window::{Controls, Exposure, Options, Stage, Steering, Still, WindowError};

const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;
const SIZE: UVec2 = UVec2::new(480, 200);

/// A stage, a texture in place of its window, and a clock.
struct Test {
    stage: Stage,
    onto: wgpu::TextureView,
    now: f64,
    folder: PathBuf,
}

fn onto(gpu: &Gpu) -> wgpu::TextureView {
    let texture = gpu.device().create_texture(&wgpu::TextureDescriptor {
        label: None,
        size: wgpu::Extent3d { width: SIZE.x, height: SIZE.y, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: FORMAT,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT,
        view_formats: &[],
    });
    texture.create_view(&Default::default())
}

impl Test {
    fn new(name: &str) -> Self {
        let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("stage-{name}"));
        // Of an earlier run, if there was one.
        let _ = std::fs::remove_dir_all(&folder);
        std::fs::create_dir_all(&folder).unwrap();
        let controls = Controls {
            settings: Settings { samples: 1, ..Settings::default() },
            offset: None,
            window: None,
            tone_map: ToneMap::Srgb,
            exposure: Exposure::new(None),
            panel: true,
        };
        let options = Options { size: SIZE, view: None, controls, screenshots: folder.clone() };
        let scene = Scene::open("cornell").unwrap();
        let world = Still::new(scene, Light::default(), "nowhere".into());
        let gpu = Gpu::new().unwrap();
        let onto = onto(&gpu);
        let stage = Stage::new(gpu, FORMAT, Box::new(world), &options);
        Self { stage, onto, now: 0.0, folder }
    }

    fn frame(&mut self, events: Vec<Event>) -> Result<(), WindowError> {
        self.frame_of(SIZE, events)
    }

    fn frame_of(&mut self, size: UVec2, events: Vec<Event>) -> Result<(), WindowError> {
        let rect = Rect::from_min_size(Pos2::ZERO, vec2(SIZE.x as f32, SIZE.y as f32));
        let input = RawInput { screen_rect: Some(rect), events, ..RawInput::default() };
        self.now += 0.5;
        self.stage.frame(self.now, input, size, &self.onto)?;
        // A window waits for its display; here the device would fall behind.
        let waited = self.stage.gpu().device().poll(wgpu::PollType::wait_indefinitely());
        assert!(waited.is_ok(), "{waited:?}");
        Ok(())
    }

    fn frames(&mut self, frames: impl IntoIterator<Item = Vec<Event>>) {
        frames.into_iter().for_each(|events| self.frame(events).unwrap());
    }

    fn press(&mut self, key: Key) {
        let event = |pressed| Event::Key {
            key,
            physical_key: None,
            pressed,
            repeat: false,
            modifiers: Modifiers::NONE,
        };
        self.frames([vec![event(true)], vec![event(false)]]);
    }

    fn drag(&mut self, button: PointerButton, from: Pos2, to: Pos2) {
        let click = |pos, pressed| Event::PointerButton {
            pos,
            button,
            pressed,
            modifiers: Modifiers::NONE,
        };
        self.frames([
            vec![Event::PointerMoved(from)],
            vec![click(from, true)],
            vec![Event::PointerMoved(from.lerp(to, 0.5))],
            vec![Event::PointerMoved(to)],
            vec![click(to, false)],
        ]);
    }
}

#[test]
fn pointer_and_keys_move_the_camera() {
    let mut test = Test::new("steering");
    test.frames([vec![], vec![]]);
    let start = test.stage.camera().eye();
    test.drag(PointerButton::Primary, pos2(60.0, 100.0), pos2(120.0, 90.0));
    let turned = test.stage.camera().eye();
    assert!(start.distance(turned) > 0.2, "{start} {turned}");

    // What is dragged on the panel is no concern of the camera's.
    test.drag(PointerButton::Primary, pos2(440.0, 150.0), pos2(380.0, 160.0));
    assert_eq!(test.stage.camera().eye(), turned);

    test.press(Key::F);
    assert_eq!(test.stage.camera().steering, Steering::Fly);
    test.drag(PointerButton::Primary, pos2(60.0, 100.0), pos2(90.0, 100.0));
    assert!(test.stage.camera().eye().distance(turned) < 1e-4, "it turns where it is");
    test.drag(PointerButton::Secondary, pos2(60.0, 100.0), pos2(90.0, 100.0));
    let moved = test.stage.camera().eye();
    assert!(moved.distance(turned) > 0.05, "sideways");
    let w = |pressed| Event::Key {
        key: Key::W,
        physical_key: None,
        pressed,
        repeat: false,
        modifiers: Modifiers::NONE,
    };
    test.frames([vec![w(true)], vec![], vec![w(false)]]);
    let forward = -Vec3::from(test.stage.camera().view().world_from_camera.matrix3.z_axis);
    let walked = test.stage.camera().eye() - moved;
    assert!(walked.dot(forward) > 0.05 && walked.normalize().dot(forward) > 0.999, "{walked}");
}

#[test]
fn keys_choose_what_is_shown() {
    let mut test = Test::new("keys");
    test.frames([vec![], vec![], vec![]]);
    assert!(test.stage.is_settled(), "exposure is known after some frames");
    for (key, lighting) in [
        (Key::Num1, Lighting::DIRECT),
        (Key::Num2, Lighting::INDIRECT),
        (Key::Num3, Lighting::FIELD),
    ] {
        test.press(key);
        assert_eq!(test.stage.controls().settings.lighting, lighting);
    }
    test.press(Key::H);
    assert!(!test.stage.controls().panel);
    test.frames(vec![vec![]; 6]);
    let followed = test.stage.controls().exposure.factor();
    test.press(Key::X);
    let by_hand = test.stage.controls().exposure;
    let apart = (by_hand.factor() / followed).log2();
    assert!(!by_hand.auto && apart.abs() < 0.5, "{by_hand:?}, {apart} stops from before");
    test.frames([vec![], vec![]]);
    assert_eq!(test.stage.controls().exposure.factor(), by_hand.factor(), "and stays");
}

#[test]
fn screenshots_do_not_overwrite_each_other() {
    let mut test = Test::new("screenshots");
    test.frames([vec![], vec![], vec![]]);
    test.press(Key::P);
    test.press(Key::P);
    for name in ["cornell-1.png", "cornell-2.png"] {
        let picture = Loaded::read(test.folder.join(name)).unwrap().linear();
        assert_eq!((picture.width(), picture.height()), (SIZE.x, SIZE.y));
        let bright = picture.pixels().iter().filter(|p| p.max_element() > 0.2).count();
        assert!(bright > picture.pixels().len() / 20, "{bright} bright pixels in {name}");
    }
    // A folder that is gone is told in the window and ends nothing.
    std::fs::remove_dir_all(&test.folder).unwrap();
    test.press(Key::P);
    assert!(!test.folder.exists());
}

/// A window may be made so small that nothing is left of it, and large again.
#[test]
fn a_window_of_no_size_draws_nothing() {
    let mut test = Test::new("nothing");
    test.frames([vec![], vec![]]);
    for size in [UVec2::ZERO, UVec2::new(0, SIZE.y), UVec2::new(SIZE.x, 0)] {
        test.frame_of(size, vec![]).unwrap();
        test.frame(vec![]).unwrap();
    }
}

#[test]
fn a_lost_device_is_followed_by_another() {
    let mut test = Test::new("loss");
    test.frames([vec![], vec![], vec![]]);
    test.drag(PointerButton::Primary, pos2(60.0, 100.0), pos2(120.0, 90.0));
    let (camera, controls) = (*test.stage.camera(), test.stage.controls().clone());
    test.stage.gpu().device().destroy();
    let lost = (0..3).find_map(|_| test.frame(vec![]).err()).expect("it is told");
    assert!(matches!(lost, WindowError::Shade(_)), "{lost}");
    let gpu = Gpu::new().unwrap();
    test.onto = onto(&gpu);
    test.stage.restore(gpu, FORMAT);
    assert_eq!(*test.stage.camera(), camera, "where it was");
    assert_eq!(test.stage.controls().settings, controls.settings, "as it was set");
    test.frames([vec![], vec![], vec![]]);
    test.press(Key::P);
    assert!(test.folder.join("cornell-1.png").exists(), "and it draws");
}
