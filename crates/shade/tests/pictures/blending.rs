//! Blended surfaces, sorted or by coverage, beside the path tracer: two panes, one behind the other, over a lit floor, from before
//! and from behind. Pixels are told apart by what covers them, and averaged, since the tracer decides by
//! chance what a sample meets.

use std::sync::Arc;

use crate::common::{SIZE, direct, renderer, traced};
use glam::{UVec2, Vec3};
use lumencast_gather::reference::Parts;
use lumencast_scene::{AlphaMode, LightKind, Material, PunctualLight, Snapshot, View};
use lumencast_shade::{Settings, Shadows, Transparency};
use lumencast_testkit::scenes::{Stage, lambert};

/// Both ways to draw them, samples a pixel, and how far means may be apart, of the brightest mean: which
/// samples are covered is left to chance.
const WAYS: [(Transparency, u32, f32); 2] =
    [(Transparency::Sorted, 16, 0.005), (Transparency::Coverage, 64, 0.01)];

/// A pane across z, half seen through.
#[derive(Clone, Copy, Debug)]
struct Pane {
    z: f32,
    /// x and y of two corners.
    low: [f32; 2],
    high: [f32; 2],
    color: Vec3,
    opacity: f32,
    emission: Vec3,
}

const FRONT: Pane = Pane {
    z: 0.5,
    low: [-1.3, 0.9],
    high: [0.4, 1.8],
    color: Vec3::new(0.9, 0.3, 0.2),
    opacity: 0.6,
    emission: Vec3::new(0.5, 0.1, 0.0),
};

const BACK: Pane = Pane {
    z: -0.5,
    low: [-0.4, 0.6],
    high: [1.0, 1.6],
    color: Vec3::new(0.2, 0.4, 0.9),
    opacity: 0.4,
    emission: Vec3::new(0.0, 0.3, 0.9),
};

/// Two panes, in this order, and what they are seen against. The sun stands so low at their side that
/// their shadows fall beside what is looked at.
fn scene(panes: [Pane; 2]) -> Arc<Snapshot> {
    let mut stage = Stage::default();
    let floor = stage.material(lambert(Vec3::new(0.8, 0.7, 0.6), Vec3::ZERO));
    stage.quad(Vec3::new(-9.0, 0.0, 9.0), Vec3::X * 18.0, Vec3::NEG_Z * 18.0, floor);
    for pane in panes {
        let material = stage.material(Material {
            base_color: pane.color.extend(pane.opacity),
            alpha_mode: AlphaMode::Blend,
            double_sided: true,
            ..lambert(pane.color, pane.emission)
        });
        let [[x0, y0], [x1, y1]] = [pane.low, pane.high];
        let (u, v) = (Vec3::X * (x1 - x0), Vec3::Y * (y1 - y0));
        stage.quad(Vec3::new(x0, y0, pane.z), u, v, material);
    }
    let kind = LightKind::Directional { angle: 0.0 };
    let sun = PunctualLight { kind, color: Vec3::ONE, intensity: 8.0, range: None };
    stage.light(sun, Vec3::ZERO, Vec3::new(1.0, -0.25, -0.3));
    stage.snapshot()
}

/// From before the panes, or from behind them.
fn view(side: f32) -> View {
    View::look_at(Vec3::new(0.2, 2.4, 6.0 * side), Vec3::new(0.0, 1.2, 0.0), 0.4).unwrap()
}

/// No shadow falls on what is looked at.
fn settings(transparency: Transparency, samples: u32) -> Settings {
    let shadows = Shadows { resolution: 0, ..Shadows::default() };
    Settings { transparency, samples, shadows, ..direct() }
}

/// Whether a ray goes through a pane; nothing near its edge.
fn covers(pane: &Pane, origin: Vec3, direction: Vec3) -> Option<bool> {
    let at = origin + direction * ((pane.z - origin.z) / direction.z);
    let ([x0, y0], [x1, y1]) = (pane.low, pane.high);
    let inside = (at.x - x0).min(x1 - at.x).min(at.y - y0).min(y1 - at.y);
    (inside.abs() > 0.08).then_some(inside > 0.0)
}

/// What is seen, on average, where there is no pane, the front one, the back one, and both; neither of
/// the sky nor of shadows.
fn means(picture: &[Vec3], view: View) -> [Vec3; 4] {
    let mut sums = [(Vec3::ZERO, 0); 4];
    for (i, pixel) in (0..).zip(picture) {
        let at = (UVec2::new(i % SIZE.x, i / SIZE.x).as_vec2() + 0.5) / SIZE.as_vec2();
        let (origin, direction) = view.ray(at, SIZE.x as f32 / SIZE.y as f32);
        let floor = origin - direction * (origin.y / direction.y);
        let covered = covers(&FRONT, origin, direction).zip(covers(&BACK, origin, direction));
        let Some((front, back)) = covered else { continue };
        if direction.y < 0.0 && floor.z.abs() < 8.5 && floor.x < 1.9 {
            let (sum, count) = &mut sums[usize::from(front) + 2 * usize::from(back)];
            *sum += *pixel;
            *count += 1;
        }
    }
    assert!(sums.iter().all(|(_, count)| *count > 100), "each is seen: {sums:?}");
    sums.map(|(sum, count)| sum / count as f32)
}

/// By how much the most different of the means are apart.
fn apart(found: &[Vec3; 4], expected: &[Vec3; 4]) -> f32 {
    let largest = expected.iter().map(|mean| mean.max_element()).fold(0.0, f32::max);
    let errors = found.iter().zip(expected).map(|(a, b)| (*a - *b).abs().max_element());
    errors.fold(0.0, f32::max) / largest
}

/// Whichever is listed first, the farther one lies behind. What a wrong order looks like, opacities and
/// colours exchanged, a pane that lies over all and one that is opaque are told from it.
#[test]
fn farther_panes_lie_behind() {
    for (transparency, samples, tolerance) in WAYS {
        for side in [1.0, -1.0] {
            farther_panes_lie_behind_by(&settings(transparency, samples), tolerance, view(side));
        }
    }
}

fn farther_panes_lie_behind_by(settings: &Settings, tolerance: f32, view: View) {
    let transparency = settings.transparency;
    let scene_as_meant = scene([FRONT, BACK]);
    let reference = traced(&scene_as_meant, view, settings, Parts::Direct, 256);
    let reference = means(&reference, view);
    let mut renderer = renderer(&scene_as_meant, settings);
    let mut found = |panes: [Pane; 2]| {
        renderer.set_scene(&scene(panes));
        let picture = renderer.pictures(&[view], settings).unwrap().remove(0);
        apart(&means(&picture, view), &reference)
    };
    for (order, panes) in [("in order", [FRONT, BACK]), ("in the other", [BACK, FRONT])] {
        let error = found(panes);
        eprintln!("{transparency:?}, {order}: {error}");
        assert!(error < tolerance, "{transparency:?}, {order}: {error}");
    }
    // Where both are seen: the same panes, the one behind before the other.
    let swapped = [Pane { z: BACK.z, ..FRONT }, Pane { z: FRONT.z, ..BACK }];
    let colors = [
        Pane { color: BACK.color, emission: BACK.emission, ..FRONT },
        Pane { color: FRONT.color, emission: FRONT.emission, ..BACK },
    ];
    let opacities =
        [Pane { opacity: BACK.opacity, ..FRONT }, Pane { opacity: FRONT.opacity, ..BACK }];
    let opaque = [Pane { opacity: 1.0, ..FRONT }, BACK];
    for (fault, panes) in [
        ("the other before", swapped),
        ("colours exchanged", colors),
        ("opacities exchanged", opacities),
        ("opaque", opaque),
    ] {
        let error = found(panes);
        eprintln!("{transparency:?}, {fault}: {error}");
        assert!(error > 2.0 * tolerance, "{transparency:?}, {fault}: {error}");
    }
}
