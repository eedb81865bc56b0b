//! Pictures: what they show in closed form, and that they are reproducible.

use std::num::NonZeroUsize;
use std::sync::Arc;

use glam::{UVec2, Vec3};
use lumencast_gather::path_trace::MaterialModel;
use lumencast_gather::reference::{Film, Filter, Parts, PictureSettings, Renderer};
use lumencast_scene::{Environment, LightKind, Material, PunctualLight, Scene, Snapshot, View};
use lumencast_testkit::scenes::{Stage, lambert};

fn settings() -> PictureSettings {
    PictureSettings { size: UVec2::new(40, 28), ..PictureSettings::default() }
}

fn render(scene: &Arc<Snapshot>, view: View, settings: PictureSettings, samples: u32) -> Film {
    let renderer = Renderer::new(scene, view, settings).unwrap();
    let mut film = Film::new(settings.size, samples);
    while film.samples() < samples {
        renderer.pass(&mut film, samples, &|_| true).unwrap();
    }
    film
}

fn cornell() -> (Arc<Snapshot>, View) {
    let mut scene = Scene::open("cornell").unwrap();
    let view = scene.cameras()[0].view();
    (scene.snapshot(), view)
}

#[test]
fn parts_add_up() {
    let (scene, view) = cornell();
    let of = |parts| render(&scene, view, PictureSettings { parts, ..settings() }, 8).picture();
    let (all, direct, indirect) = (of(Parts::All), of(Parts::Direct), of(Parts::Indirect));
    for ((all, direct), indirect) in all.iter().zip(&direct).zip(&indirect) {
        assert!((*all - (*direct + *indirect)).abs().max_element() <= 1e-5 * all.max_element());
    }
    assert!(direct.iter().any(|v| v.max_element() > 0.0));
    assert!(indirect.iter().any(|v| v.max_element() > 0.0));
}

#[test]
fn results_depend_neither_on_threads_nor_on_interruption() {
    // Of the second, the sun is followed, and its shadow rays are answered by a light buffer.
    for ((scene, view), follows) in [(cornell(), false), (sunlit_room(0.0, false), true)] {
        let renderer = Renderer::new(&scene, view, settings()).unwrap();
        assert_eq!(renderer.follows_sun(), follows);
        results_are_one(&scene, view, &renderer);
    }
}

fn results_are_one(scene: &Arc<Snapshot>, view: View, renderer: &Renderer) {
    let with = |threads| {
        let threads = NonZeroUsize::new(threads);
        render(scene, view, PictureSettings { threads, ..settings() }, 24)
    };
    let whole = with(1);
    assert_eq!(whole, with(3));

    let mut film = Film::new(settings().size, 24);
    renderer.pass(&mut film, 24, &|_| true).unwrap();
    let before = film.clone();
    assert_eq!(renderer.pass(&mut film, 24, &|done| done < 0.4), None);
    assert_eq!(film, before, "a pass that was stopped leaves no trace");
    let kept = film.parts().map(|(sums, samples)| (sums.to_vec(), samples));
    let mut film = Film::from_parts(film.size(), film.planned(), kept).unwrap();
    while film.samples() < 24 {
        renderer.pass(&mut film, 24, &|_| true).unwrap();
    }
    assert_eq!(whole, film);
    let other = render(scene, view, PictureSettings { seed: 2, ..settings() }, 24);
    assert_ne!(whole, other);
}

/// A floor of albedo ρ under one sun: radiance ρ E cos θ/π in direct light, none in indirect.
#[test]
fn sun_on_a_floor() {
    let mut stage = Stage::default();
    let material = stage.material(lambert(Vec3::new(0.2, 0.5, 0.8), Vec3::ZERO));
    stage.quad(Vec3::new(-9.0, 0.0, 9.0), Vec3::X * 18.0, Vec3::NEG_Z * 18.0, material);
    let sun = PunctualLight {
        kind: LightKind::Directional { angle: 0.0 },
        color: Vec3::ONE,
        intensity: 1000.0,
        range: None,
    };
    stage.light(sun, Vec3::ZERO, Vec3::new(0.0, -1.0, -1.0).normalize());
    let view = View::look_at(Vec3::new(0.0, 3.0, 1.0), Vec3::ZERO, 0.8).unwrap();
    let expected = Vec3::new(0.2, 0.5, 0.8) * 1000.0 * 0.5f32.sqrt() / std::f32::consts::PI;
    for (filter, parts, factor) in [
        (Filter::Box, Parts::Direct, 1.0),
        (Filter::Tent, Parts::All, 1.0),
        (Filter::Gaussian, Parts::Indirect, 0.0),
    ] {
        let settings = PictureSettings { filter, parts, ..settings() };
        let film = render(&stage.snapshot(), view, settings, 2);
        for seen in film.picture() {
            let difference = (seen - factor * expected).abs().max_element();
            assert!(difference <= 1e-5 * expected.max_element(), "{filter:?}: {seen}");
        }
    }
}

/// Roulette changes the noise, not the mean: a closed room of albedo ρ that emits L everywhere has
/// L/(1 − ρ).
#[test]
fn roulette_is_unbiased() {
    let mut stage = Stage::default();
    let material = stage.material(lambert(Vec3::splat(0.6), Vec3::ONE));
    stage.room(Vec3::ZERO, Vec3::splat(2.0), material);
    let view = View::look_at(Vec3::ZERO, Vec3::new(0.3, 0.1, 1.0), 1.0).unwrap();
    let of = |roulette_from| {
        let settings = PictureSettings { bounces: 40, roulette_from, ..settings() };
        let film = render(&stage.snapshot(), view, settings, 128);
        let picture = film.picture();
        let mean = picture.iter().map(|v| v.x).sum::<f32>() / picture.len() as f32;
        let error = film.noise(1.0).unwrap().relative_rms as f32 / (picture.len() as f32).sqrt();
        (mean / 2.5, error)
    };
    for roulette_from in [1, 4, u32::MAX] {
        let (ratio, error) = of(roulette_from);
        assert!((ratio - 1.0).abs() < 5.0 * error + 1e-4, "{roulette_from}: {ratio} ± {error}");
        assert!(error < 2e-3, "the check has no teeth: ± {error}");
    }
}

#[test]
fn noise_is_hardly_more_than_what_more_samples_take_away() {
    let (scene, view) = cornell();
    // Without mirrors, so that no rare bright path decides, and without the lamp's edge, where what
    // the halves tell is furthest above the truth.
    let with_seed = |seed, samples| {
        let settings = PictureSettings {
            materials: MaterialModel::Lambert,
            parts: Parts::Indirect,
            seed,
            ..settings()
        };
        render(&scene, view, settings, samples)
    };
    let smooth = with_seed(99, 512);
    let truth = smooth.picture();
    let values = 3.0 * truth.len() as f64;
    let mean = truth.iter().map(|v| f64::from(v.element_sum())).sum::<f64>() / values;
    // One picture tells little.
    let (mut told, mut is) = (0.0, 0.0);
    for seed in 0..16 {
        let rough = with_seed(seed, 16);
        told += rough.noise(1.0).unwrap().relative_rms.powi(2);
        let errors = rough.picture().into_iter().zip(&truth).map(|(a, b)| a - *b);
        is += errors.map(|e| f64::from(e.length_squared())).sum::<f64>() / values / (mean * mean);
    }
    let ratio = (told / is).sqrt();
    // Halves of one well-spread sequence differ by more than independent ones.
    assert!((0.98..1.25).contains(&ratio), "{ratio}");
    assert!(smooth.noise(1.0).unwrap().relative_rms < 0.3 * (told / 16.0).sqrt());
    assert_eq!(Film::new(UVec2::ONE, 1).noise(1.0), None);
}

#[test]
fn the_sky_is_seen_directly() {
    let mut stage = Stage::default();
    stage.environment(Environment::Constant { radiance: Vec3::new(1.0, 2.0, 3.0) });
    let view = View::look_at(Vec3::ZERO, Vec3::Z, 1.0).unwrap();
    let of = |parts| render(&stage.snapshot(), view, PictureSettings { parts, ..settings() }, 1);
    assert!(of(Parts::Direct).picture().iter().all(|v| *v == Vec3::new(1.0, 2.0, 3.0)));
    assert!(of(Parts::Indirect).picture().iter().all(|v| *v == Vec3::ZERO));
}

#[test]
fn frames_make_up_a_film() {
    let (scene, view) = cornell();
    let film = render(&scene, view, settings(), 16).picture();
    let off = |seed| {
        let renderer = Renderer::new(&scene, view, PictureSettings { seed, ..settings() }).unwrap();
        let frames: Vec<_> = (0..16).map(|number| renderer.frame(number)).collect();
        let mean = |pixel: usize| frames.iter().map(|f| f.samples[pixel].radiance).sum::<Vec3>();
        let errors = film.iter().enumerate().map(|(i, v)| (*v - mean(i) / 16.0).abs());
        errors.map(Vec3::max_element).fold(0.0, f32::max)
    };
    assert!(off(settings().seed) < 1e-4, "{}", off(settings().seed));
    assert!(off(2) > 0.1, "the check has no teeth");
}

/// A floor and a lamp below the sky: what a frame says is seen first, and what of it has no noise.
#[test]
fn frames_tell_what_is_met_first() {
    let (color, lamp, sky) = (Vec3::new(0.2, 0.5, 0.8), Vec3::splat(7.0), Vec3::new(1.0, 2.0, 3.0));
    let mut stage = Stage::default();
    let floor = stage.material(lambert(color, Vec3::ZERO));
    stage.quad(Vec3::new(-9.0, 0.0, 9.0), Vec3::X * 18.0, Vec3::NEG_Z * 18.0, floor);
    let panel = stage.material(lambert(Vec3::ZERO, lamp));
    stage.quad(Vec3::new(-9.0, 1.0, -9.0), Vec3::X * 9.0, Vec3::Y * 9.0, panel);
    stage.environment(Environment::Constant { radiance: sky });
    let view = View::look_at(Vec3::new(0.0, 1.0, 0.0), Vec3::new(0.0, 0.8, -9.0), 1.2).unwrap();
    let frame = Renderer::new(&stage.snapshot(), view, settings()).unwrap().frame(3);
    let (mut floors, mut lamps, mut skies) = (0, 0, 0);
    for sample in &frame.samples {
        match (sample.emitted, sample.surface) {
            (emitted, None) => {
                assert_eq!((emitted, sample.radiance), (sky, sky));
                skies += 1;
            }
            (Vec3::ZERO, Some(surface)) => {
                assert!(surface.position.y.abs() < 1e-5 && surface.position.z > -9.001);
                assert_eq!((surface.normal, surface.base_color), (Vec3::Y, color));
                assert!(sample.radiance.is_finite() && sample.radiance.min_element() >= 0.0);
                floors += 1;
            }
            (emitted, Some(surface)) => {
                assert_eq!((emitted, sample.radiance), (lamp, lamp));
                assert_eq!((surface.normal, surface.base_color), (Vec3::Z, Vec3::ZERO));
                assert!((surface.position.z + 9.0).abs() < 1e-4 && surface.position.x <= 0.0);
                lamps += 1;
            }
        }
    }
    assert!(floors.min(lamps).min(skies) > 100, "{floors} {lamps} {skies}");
}

/// A room with a window, and the sun in it, `angle` radians wide: on a ball of metal and one of glass, or
/// of what the walls are of.
fn sunlit_room(angle: f32, shines: bool) -> (Arc<Snapshot>, View) {
    let mut stage = Stage::default();
    let wall = lambert(Vec3::new(0.8, 0.6, 0.4), Vec3::ZERO);
    let shiny = Material { metallic: 1.0, roughness: 0.7, ..wall.clone() };
    let glass = Material { transmission: 0.7, roughness: 0.5, specular: 1.0, ..wall.clone() };
    let [wall, mut shiny, mut glass] = [wall, shiny, glass].map(|m| stage.material(m));
    if !shines {
        (shiny, glass) = (wall, wall);
    }
    let quad = |stage: &mut Stage, at: [f32; 3], u: [f32; 3], v: [f32; 3]| {
        stage.quad(at.into(), u.into(), v.into(), wall);
    };
    quad(&mut stage, [-2.0, 0.0, 2.0], [4.0, 0.0, 0.0], [0.0, 0.0, -4.0]);
    quad(&mut stage, [-2.0, 2.5, -2.0], [4.0, 0.0, 0.0], [0.0, 0.0, 4.0]);
    quad(&mut stage, [-2.0, 0.0, -2.0], [4.0, 0.0, 0.0], [0.0, 2.5, 0.0]);
    quad(&mut stage, [2.0, 0.0, 2.0], [-4.0, 0.0, 0.0], [0.0, 2.5, 0.0]);
    quad(&mut stage, [2.0, 0.0, -2.0], [0.0, 0.0, 4.0], [0.0, 2.5, 0.0]);
    // The wall with the window: below, above, left, right of it.
    quad(&mut stage, [-2.0, 0.0, 2.0], [0.0, 0.0, -4.0], [0.0, 1.2, 0.0]);
    quad(&mut stage, [-2.0, 1.8, 2.0], [0.0, 0.0, -4.0], [0.0, 0.7, 0.0]);
    quad(&mut stage, [-2.0, 1.2, 2.0], [0.0, 0.0, -1.7], [0.0, 0.6, 0.0]);
    quad(&mut stage, [-2.0, 1.2, -0.3], [0.0, 0.0, -1.7], [0.0, 0.6, 0.0]);
    stage.sphere(Vec3::new(-0.6, 0.5, 0.2), 0.4, 12, shiny);
    stage.sphere(Vec3::new(0.9, 0.5, -0.9), 0.4, 12, glass);
    let kind = LightKind::Directional { angle };
    let sun = PunctualLight { kind, color: Vec3::ONE, intensity: 10.0, range: None };
    stage.light(sun, Vec3::ZERO, Vec3::new(1.0, -0.9, -0.1));
    let lamp = PunctualLight { kind: LightKind::Point { radius: 0.0 }, intensity: 0.02, ..sun };
    stage.light(lamp, Vec3::new(1.5, 2.2, 1.0), Vec3::NEG_Y);
    let view = View::look_at(Vec3::new(1.7, 1.6, 1.7), Vec3::new(-0.4, 0.6, -0.4), 1.2).unwrap();
    (stage.snapshot(), view)
}

/// Connected to what the sun was followed to, paths show the same light, with less noise: of a sun that
/// is a point and of wide ones, whose discs rays meet by chance as well.
#[test]
fn following_the_sun_changes_noise_only() {
    for (angle, shines) in [(0.0, false), (0.5, false), (0.0, true), (0.05, true), (0.5, true)] {
        let (scene, view) = sunlit_room(angle, shines);
        let parts = Parts::Indirect;
        let of = |follow_sun: bool| {
            let settings = PictureSettings { follow_sun, parts, ..settings() };
            assert_eq!(Renderer::new(&scene, view, settings).unwrap().follows_sun(), follow_sun);
            render(&scene, view, settings, if angle == 0.0 { 1024 } else { 256 })
        };
        let (without, with) = (of(false), of(true));
        let noise = |film: &Film| film.noise(1.0).unwrap().relative_rms;
        let (noisy, quiet) = (noise(&without), noise(&with));
        let most = if angle < 0.1 { 0.45 } else { 0.65 };
        assert!(quiet < most * noisy, "{angle} {shines}: {quiet} of {noisy}");
        // In blocks of pixels and as a whole they agree within five standard errors.
        let [a, b] = [without.picture(), with.picture()];
        let size = settings().size;
        let mean = |of: &[Vec3], pixels: &[u32]| {
            pixels.iter().map(|n| of[*n as usize]).sum::<Vec3>() / pixels.len() as f32
        };
        let whole: Vec<u32> = (0..size.x * size.y).collect();
        let corners = (0..size.y).step_by(14).flat_map(|y| [0, 20].map(|x| (x, y)));
        let blocks =
            corners.map(|(x, y)| (0..280).map(|n| (y + n / 20) * size.x + x + n % 20).collect());
        let blocks: Vec<Vec<u32>> = blocks.chain([whole.clone()]).collect();
        // By how many standard errors they differ at most, with so many times the light in one.
        let apart = |times: f32| {
            let of = |pixels: &Vec<u32>| {
                let error = noisy.hypot(quiet) / (pixels.len() as f64).sqrt();
                let apart = (mean(&a, pixels) - times * mean(&b, pixels)) / mean(&a, &whole);
                f64::from(apart.abs().max_element()) / error
            };
            blocks.iter().map(of).fold(0.0, f64::max)
        };
        let off = apart(1.0);
        assert!(off < 5.0, "{angle} {shines}: {off} standard errors");
        let bias = if angle == 0.0 { 1.05 } else { 1.15 };
        let biased = apart(bias);
        assert!(biased > 5.0, "{angle} {shines}: {bias} times the light is not noticed, {biased}");
    }
}

/// Where little of the noise is the sun's, or there is none, its rays would be wasted.
#[test]
fn the_sun_is_not_followed_where_that_gains_nothing() {
    let follows = |scene: &Arc<Snapshot>, view: View, settings: PictureSettings| {
        Renderer::new(scene, view, settings).unwrap().follows_sun()
    };
    let (scene, view) = sunlit_room(0.0, false);
    assert!(follows(&scene, view, settings()));
    assert!(!follows(&scene, view, PictureSettings { follow_sun: false, ..settings() }));
    assert!(!follows(&scene, view, PictureSettings { parts: Parts::Direct, ..settings() }));
    assert!(!follows(&scene, view, PictureSettings { bounces: 1, ..settings() }));
    let bright = Environment::Constant { radiance: Vec3::splat(1000.0) };
    let under_sky = Arc::new(Snapshot { environment: bright, ..(*scene).clone() });
    assert!(!follows(&under_sky, view, settings()));
    let (scene, view) = cornell();
    assert!(!follows(&scene, view, settings()));
}
