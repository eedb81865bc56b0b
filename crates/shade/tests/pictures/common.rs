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

/// How two pictures differ, errors being relative to the reference's brightest percent. Edges, of
/// shadows and of surfaces, are counted apart: there a renderer that filters and one that samples need
/// not agree pixel by pixel.
#[derive(Clone, Copy, Debug)]
pub(super) struct Difference {
    /// Root mean square.
    pub(super) rms: f32,
    /// Share of the pixels beyond edges that differ by more than a tolerance.
    pub(super) off: f32,
    /// Share of pixels at edges.
    pub(super) edges: f32,
    /// Root mean square at edges.
    pub(super) rms_at_edges: f32,
    /// Mean of the errors at edges, with their sign: how much an edge has been moved.
    pub(super) mean_at_edges: f32,
}

/// Contrast between neighbours that makes an edge.
const EDGE: f32 = 0.08;

/// Pixels around which the reference differs by more than [`EDGE`].
fn edges(reference: &[Vec3], scale: f32) -> Vec<bool> {
    let [width, height] = SIZE.as_ivec2().to_array();
    let at = |x: i32, y: i32| {
        reference[(y.clamp(0, height - 1) * width + x.clamp(0, width - 1)) as usize] / scale
    };
    let pixels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
    let is_edge = |(x, y): (i32, i32)| {
        let around = || (-1..=1).flat_map(|v| (-1..=1).map(move |u| at(x + u, y + v)));
        let (least, most) =
            around().fold((Vec3::MAX, Vec3::MIN), |(least, most), p| (least.min(p), most.max(p)));
        (most - least).max_element() > EDGE
    };
    pixels.map(is_edge).collect()
}

/// Compares a picture with a reference, and leaves both, their difference, eight times as bright, and
/// what counts as edges where one can look at them: `name`.png in the tests' folder of the target.
pub(super) fn difference(
    name: &str,
    picture: &[Vec3],
    reference: &[Vec3],
    tolerance: f32,
) -> Difference {
    let mut brightness: Vec<f32> = reference.iter().map(|p| p.max_element()).collect();
    brightness.sort_by(f32::total_cmp);
    let scale = brightness[brightness.len() * 99 / 100].max(1e-6);
    let signed: Vec<Vec3> = picture.iter().zip(reference).map(|(a, b)| (*a - *b) / scale).collect();
    let errors: Vec<f32> = signed.iter().map(|e| e.abs().max_element()).collect();
    let edges = edges(reference, scale);

    let at = |x: u32, y: u32| {
        let i = (y * SIZE.x + x % SIZE.x) as usize;
        match x / SIZE.x {
            0 => picture[i] / scale,
            1 => reference[i] / scale,
            2 => Vec3::splat(8.0 * errors[i]),
            _ => Vec3::splat(f32::from(edges[i])),
        }
    };
    let side_by_side = Picture::from_fn(4 * SIZE.x, SIZE.y, at);
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("{name}.png"));
    side_by_side.write_png(&path, ToneMap::Srgb, 1.0).unwrap();

    assert!(errors.iter().all(|e| e.is_finite()), "{name}: a pixel is no number");
    let pixels = || errors.iter().zip(&edges);
    let rms = |errors: &mut dyn Iterator<Item = f32>| {
        let (sum, count) = errors.fold((0.0, 0), |(sum, count), e| (sum + e * e, count + 1));
        (sum / count.max(1) as f32).sqrt()
    };
    let at_edges = edges.iter().filter(|edge| **edge).count();
    let off = pixels().filter(|(error, edge)| !**edge && **error > tolerance).count();
    let signed = signed.iter().zip(&edges).filter(|(_, edge)| **edge);
    let moved: f32 = signed.map(|(e, _)| e.element_sum() / 3.0).sum();
    let found = Difference {
        rms: rms(&mut errors.iter().copied()),
        off: off as f32 / (errors.len() - at_edges).max(1) as f32,
        edges: at_edges as f32 / errors.len() as f32,
        rms_at_edges: rms(&mut pixels().filter(|(_, edge)| **edge).map(|(error, _)| *error)),
        mean_at_edges: moved / at_edges.max(1) as f32,
    };
    eprintln!("{name}: {found:?}, {}", path.display());
    found
}
