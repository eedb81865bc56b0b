//! What adapters may lack: pictures are the same without it, as far as they can be.

use std::sync::Arc;

use glam::Vec3;
use lumencast_scene::{Scene, Snapshot, View};
use lumencast_shade::{Abilities, Drawn, Gpu, Renderer, Settings, Shading};

use super::common::{SIZE, direct};

fn cornell() -> (Arc<Snapshot>, View) {
    let mut scene = Scene::open("cornell").unwrap();
    let view = scene.cameras()[0].view();
    (scene.snapshot(), view)
}

/// What an adapter with no more abilities draws, and what it took.
fn drawn(most: Abilities, settings: &Settings) -> (Vec<Vec3>, Drawn) {
    let (scene, view) = cornell();
    let gpu = Gpu::new().expect("an adapter").limited_to(most);
    let mut renderer = Renderer::new(gpu, settings);
    renderer.set_scene(&scene);
    let (mut pictures, drawn) = renderer.pictures_with(&[view], settings).expect("a picture");
    (pictures.remove(0), drawn)
}

/// Root mean square of the difference of v / (v + mean), so that the lamp's edge does not decide.
fn difference(a: &[Vec3], b: &[Vec3]) -> f32 {
    let mean = b.iter().sum::<Vec3>() / b.len() as f32;
    let code = |p: &Vec3| *p / (*p + mean);
    let squares = a.iter().zip(b).map(|(a, b)| (code(a) - code(b)).length_squared());
    (squares.sum::<f32>() / (3 * b.len()) as f32).sqrt()
}

const ALL: Abilities = Abilities { samples: 8, sample_shading: true, clock: true };

/// Frames of one sample take the place of samples shaded one by one, frames of fewer samples that of
/// more: pixels are the same mean of sixteen points, spread otherwise.
#[test]
fn frames_take_the_place_of_samples() {
    let settings = Settings { size: SIZE, ..direct() };
    let (whole, by_samples) = drawn(ALL, &settings);
    assert!(by_samples.samples > 1 && by_samples.frames < 16, "{by_samples:?}");
    for most in [
        Abilities { sample_shading: false, ..ALL },
        Abilities { samples: 1, sample_shading: false, ..ALL },
        Abilities { samples: 1, ..ALL },
    ] {
        let (picture, frames) = drawn(most, &settings);
        assert_eq!((frames.samples, frames.frames), (1, 16), "{most:?}");
        let off = difference(&picture, &whole);
        assert!(off < 0.01, "{most:?}: {off}");
    }
    // A pixel's one point is not their mean.
    let (one, _) = drawn(ALL, &Settings { samples: 1, ..settings });
    let off = difference(&one, &whole);
    assert!(off > 0.03, "{off}");
}

/// Shaded once a pixel, samples are drawn at once whether or not they could be shaded.
#[test]
fn shading_pixels_needs_no_sample_shading() {
    let settings = Settings { shading: Shading::Pixels, ..direct() };
    let (with, _) = drawn(ALL, &settings);
    let (without, drawn) = drawn(Abilities { sample_shading: false, ..ALL }, &settings);
    assert!(drawn.samples > 1);
    assert_eq!(with, without);
}

#[test]
fn without_a_clock_there_are_no_times() {
    let (_, timed) = drawn(Abilities { clock: false, ..ALL }, &direct());
    assert_eq!(timed.time, None);
}
