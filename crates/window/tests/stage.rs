//! A window's frames without a window: what is drawn, and what pointer and keys do.

use std::f32::consts::PI;
use std::path::PathBuf;

use egui::{Event, Key, Modifiers, PointerButton, Pos2, RawInput, Rect, pos2, vec2};
use glam::{Quat, UVec2, UVec3, Vec3};
use lumencast_charts::{laid_out, sheets};
use lumencast_gpu::TextureCopy;
use lumencast_light::{Field, FieldId, Grid, Light, Lightmap, Order, ProbeVolume};
use lumencast_picture::{Loaded, ToneMap};
use lumencast_scene::{LightmapSpec, Scene};
use lumencast_shade::{Gpu, Lighting, LumelLook, Settings, Strengths, wgpu};
use lumencast_window::{Controls, Exposure, Options, Stage, Steering, Still, WindowError};

const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;
const SIZE: UVec2 = UVec2::new(480, 200);

/// A stage, a texture in place of its window, and a clock.
struct Test {
    stage: Stage,
    onto: wgpu::Texture,
    now: f64,
    folder: PathBuf,
}

fn onto(gpu: &Gpu) -> wgpu::Texture {
    gpu.device().create_texture(&wgpu::TextureDescriptor {
        label: None,
        size: wgpu::Extent3d { width: SIZE.x, height: SIZE.y, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: FORMAT,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    })
}

fn controls() -> Controls {
    Controls {
        settings: Settings { samples: 1, ..Settings::default() },
        offset: None,
        window: None,
        tone_map: ToneMap::Srgb,
        exposure: Exposure::new(None),
        panel: true,
    }
}

impl Test {
    fn new(name: &str) -> Self {
        Self::with(name, Light::default(), controls())
    }

    fn with(name: &str, light: Light, controls: Controls) -> Self {
        let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("stage-{name}"));
        // Of an earlier run, if there was one.
        let _ = std::fs::remove_dir_all(&folder);
        std::fs::create_dir_all(&folder).unwrap();
        let options = Options { size: SIZE, view: None, controls, screenshots: folder.clone() };
        let scene = Scene::open("cornell").unwrap();
        let world = Still::new(scene, light, "nowhere".into());
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
        self.stage.frame(self.now, input, size, &self.onto.create_view(&Default::default()))?;
        // A window waits for its display; here the device would fall behind.
        let waited = self.stage.gpu().device().poll(wgpu::PollType::wait_indefinitely());
        assert!(waited.is_ok(), "{waited:?}");
        Ok(())
    }

    fn frames(&mut self, frames: impl IntoIterator<Item = Vec<Event>>) {
        frames.into_iter().for_each(|events| self.frame(events).unwrap());
    }

    /// What is shown, linear, row by row.
    fn shown(&self) -> Vec<Vec3> {
        let gpu = self.stage.gpu();
        let mut encoder = gpu.device().create_command_encoder(&Default::default());
        let copy = TextureCopy::new(gpu, &mut encoder, &self.onto);
        gpu.queue().submit([encoder.finish()]);
        let mut pixels = Vec::new();
        let read = copy.wait(gpu, "reading codes", |row| {
            let codes = row.as_chunks::<4>().0.iter();
            pixels.extend(codes.map(|c| linear(Vec3::new(c[0].into(), c[1].into(), c[2].into()))));
        });
        read.unwrap();
        pixels
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

/// Linear light of display codes of eight bits (IEC 61966-2-1).
fn linear(codes: Vec3) -> Vec3 {
    let decoded = |code: f32| match code / 255.0 {
        code if code <= 0.04045 => code / 12.92,
        code => ((code + 0.055) / 1.055).powf(2.4),
    };
    Vec3::from(codes.to_array().map(decoded))
}

/// What a white surface sends out that lumels light.
const OF_LUMELS: Vec3 = Vec3::new(0.3, 0.5, 0.7);

/// Light of the room that is even on all lumels, and even of another colour in all directions elsewhere.
fn even_light() -> Light {
    let mut scene = Scene::open("cornell").unwrap();
    let (snapshot, bounds) = (scene.snapshot(), scene.bounds());
    let sheets = sheets(&snapshot, None, &|_| true).unwrap().sheets;
    let layout = laid_out(&sheets, LightmapSpec::Size(128)).unwrap().layout;
    let mut lightmap = Lightmap::dark(FieldId(0), layout.into());
    lightmap.irradiance.fill(PI * OF_LUMELS);
    let grid = Grid {
        center: 0.5 * (bounds.min + bounds.max),
        rotation: Quat::IDENTITY,
        size: bounds.max - bounds.min,
        resolution: UVec3::ONE,
    };
    let mut volume = ProbeVolume::dark(FieldId(1), grid, Order::L1);
    volume.probe_mut(0)[0] = Vec3::splat((4.0 * PI).sqrt());
    Light::new([Field::from(lightmap), volume.into()])
}

/// The first frame of the room without the panel, at an exposure of 1, by indirect light alone.
fn first_frame(name: &str, settings: Settings) -> Test {
    let settings = Settings { samples: 1, lighting: Lighting::INDIRECT, ..settings };
    let exposure = Exposure::new(Some(1.0));
    let controls = Controls { settings, exposure, panel: false, ..controls() };
    let mut test = Test::with(name, even_light(), controls);
    test.frame(vec![]).unwrap();
    test
}

#[test]
fn strengths_weigh_indirect_light_on_what_is_still_and_on_what_moves() {
    let drawn = |still, moving| {
        let strengths = Strengths { still, moving };
        first_frame("strengths", Settings { strengths, ..Settings::default() }).shown()
    };
    let (whole, of_still, of_moving) = (drawn(1.0, 1.0), drawn(1.0, 0.0), drawn(0.0, 1.0));
    let weighed = drawn(0.5, 1.25);
    let mut counts = [0, 0];
    for (i, whole) in whole.iter().enumerate() {
        let is_still = of_still[i] != Vec3::ZERO;
        let only = if is_still { of_still[i] } else { of_moving[i] };
        assert!(only.distance(*whole) < 0.02, "the one or the other: {only}, {whole}");
        assert!(!is_still || of_moving[i] == Vec3::ZERO, "nothing is both");
        let strength = if is_still { 0.5 } else { 1.25 };
        for (whole, weighed) in whole.to_array().into_iter().zip(weighed[i].to_array()) {
            // Dark codes are coarse, and the brightest are cut.
            if (0.1..0.75).contains(&whole) {
                let ratio = weighed / whole;
                assert!((ratio / strength - 1.0).abs() < 0.06, "{ratio}, not {strength}");
                counts[usize::from(is_still)] += 1;
            }
        }
    }
    assert!(counts[0] > 500 && counts[1] > 20_000, "{counts:?} values of what moves and is still");
}

#[test]
fn lumels_are_shown_as_a_checkerboard() {
    let of = |look| first_frame("lumels", Settings { look, ..Settings::default() }).shown();
    let (light, squares) = (of(LumelLook::Light), of(LumelLook::Lumels));
    let near = |pixel: &Vec3, grey: f32| {
        let is_grey = pixel.max_element() - pixel.min_element() < 0.04;
        is_grey && (0.6 * grey - 0.02..grey + 0.02).contains(&pixel.y)
    };
    let count = |grey| squares.iter().filter(|pixel| near(pixel, grey)).count();
    let (bright, dark) = (count(0.8), count(0.08));
    let lit = light.iter().filter(|pixel| **pixel != Vec3::ZERO).count();
    assert!(bright > lit / 3 && dark > lit / 3, "{bright} bright and {dark} dark ones of {lit}");
}

#[test]
fn lumels_grow_old() {
    let settings = Settings { look: LumelLook::Age, ..Settings::default() };
    let mut test = first_frame("age", settings);
    let lit = test.shown().iter().filter(|pixel| **pixel != Vec3::ZERO).count();
    let mut assert_after = |seconds: f64, color: &str, is: fn(Vec3) -> bool| {
        // By itself a frame comes half a second after the one before.
        test.now += seconds - 0.5;
        test.frame(vec![]).unwrap();
        let count = test.shown().into_iter().filter(|pixel| is(*pixel)).count();
        assert!(count > lit * 3 / 4, "{count} {color} pixels of {lit}");
    };
    assert_after(0.05, "green", |p| p.y > 0.5 && p.x < 0.02 && p.z < 0.02);
    assert_after(0.95, "yellow", |p| p.x > 0.5 && p.y > 0.5 && p.z < 0.02);
    assert_after(20.0, "red", |p| p.x > 0.5 && p.y < 0.02 && p.z < 0.02);
}

#[test]
fn pages_are_shown_in_the_middle() {
    let of = |pages| first_frame("pages", Settings { pages, ..Settings::default() }).shown();
    let (without, with) = (of(false), of(true));
    // One page takes 0.86 of the height.
    let (middle, reach) = (0.5 * SIZE.as_vec2(), 0.43 * SIZE.y as f32);
    for (i, (without, with)) in (0..).zip(without.iter().zip(&with)) {
        let at = UVec2::new(i % SIZE.x, i / SIZE.x).as_vec2() + 0.5;
        let right = match (at - middle).abs().max_element() < reach {
            true => OF_LUMELS,
            false => *without,
        };
        assert!(with.distance(right) < 0.02, "{at}: {with}, not {right}");
    }
}

/// What lumels are looked into by is as bright at any exposure, which therefore stays.
#[test]
fn exposure_does_not_follow_looks() {
    for (look, pages) in [(LumelLook::Age, false), (LumelLook::Light, true)] {
        let settings = Settings { look, pages, ..controls().settings };
        let mut test = Test::with("looks", even_light(), Controls { settings, ..controls() });
        test.frames(vec![vec![]; 3]);
        assert!(test.stage.is_settled(), "something is known all the same");
        let before = test.stage.controls().exposure.factor();
        test.frames(vec![vec![]; 6]);
        assert_eq!(test.stage.controls().exposure.factor(), before);
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
