//! What the tests share: an adapter, and pictures of both renderers.

use std::path::Path;
use std::sync::Arc;

use glam::{UVec2, Vec3};
use lumencast_gather::path_trace::MaterialModel;
use lumencast_gather::reference::{Film, Parts, PictureSettings};
use lumencast_picture::{Picture, ToneMap};
use lumencast_scene::{Snapshot, View};
use lumencast_shade::{Gpu, Lighting, Materials, Renderer, Settings, Shading};

pub(super) const SIZE: UVec2 = UVec2::new(96, 64);

/// A renderer of a scene, on whatever adapter there is. Tests fail where there is none: drawing in
/// software is part of what they are for.
pub(super) fn renderer(scene: &Arc<Snapshot>, settings: &Settings) -> Renderer {
    let mut renderer = Renderer::new(Gpu::new().expect("an adapter"), settings);
    renderer.set_scene(scene);
    renderer
}

/// Direct light alone, at every sample of many.
pub(super) fn direct() -> Settings {
    Settings {
        size: SIZE,
        samples: 16,
        shading: Shading::Samples,
        lighting: Lighting::DIRECT,
        ..Settings::default()
    }
}

/// What an adapter draws.
pub(super) fn drawn(scene: &Arc<Snapshot>, view: View, settings: &Settings) -> Vec<Vec3> {
    renderer(scene, settings).pictures(&[view], settings).expect("a picture").remove(0)
}

/// What the path tracer finds.
pub(super) fn traced(
    scene: &Arc<Snapshot>,
    view: View,
    settings: &Settings,
    parts: Parts,
    samples: u32,
) -> Vec<Vec3> {
    let settings = PictureSettings {
        size: settings.size,
        bounces: if parts == Parts::Direct { 1 } else { 4 },
        parts,
        materials: match settings.materials {
            Materials::Full => MaterialModel::Full,
            Materials::Lambert => MaterialModel::Lambert,
        },
        ..PictureSettings::default()
    };
    let renderer = lumencast_gather::reference::Renderer::new(scene, view, settings).unwrap();
    let mut film = Film::new(settings.size, samples);
    while film.samples() < samples {
        renderer.pass(&mut film, samples, &|_| true).unwrap();
    }
    film.picture()
}

/// How two pictures differ.
#[derive(Clone, Copy, Debug)]
pub(super) struct Difference {
    /// Root mean square, relative to the reference's brightest percent.
    pub(super) rms: f32,
    /// Share of pixels that differ by more than a tolerance.
    pub(super) off: f32,
}

/// Compares a picture with a reference, and leaves both and their difference, eight times as bright,
/// where one can look at them: `name`.png in the tests' folder of the target.
pub(super) fn difference(
    name: &str,
    picture: &[Vec3],
    reference: &[Vec3],
    tolerance: f32,
) -> Difference {
    let mut brightness: Vec<f32> = reference.iter().map(|p| p.max_element()).collect();
    brightness.sort_by(f32::total_cmp);
    let scale = brightness[brightness.len() * 99 / 100].max(1e-6);
    let pairs = || picture.iter().zip(reference);
    let errors: Vec<f32> = pairs().map(|(a, b)| (*a - *b).abs().max_element() / scale).collect();

    let at = |x: u32, y: u32| {
        let i = (y * SIZE.x + x % SIZE.x) as usize;
        match x / SIZE.x {
            0 => picture[i] / scale,
            1 => reference[i] / scale,
            _ => Vec3::splat(8.0 * errors[i]),
        }
    };
    let side_by_side = Picture::from_fn(3 * SIZE.x, SIZE.y, at);
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("{name}.png"));
    side_by_side.write_png(&path, ToneMap::Srgb, 1.0).unwrap();

    assert!(errors.iter().all(|e| e.is_finite()), "{name}: a pixel is no number");
    let count = errors.len() as f32;
    let found = Difference {
        rms: (errors.iter().map(|e| e * e).sum::<f32>() / count).sqrt(),
        off: errors.iter().filter(|e| **e > tolerance).count() as f32 / count,
    };
    eprintln!("{name}: {found:?}, {}", path.display());
    found
}
