//! Rays of cameras and probes, and scattered ones.

use std::f32::consts::PI;
use std::sync::Arc;

use glam::{Affine3A, Vec2, Vec3};
use lumencast_gather::path_trace::Levels;
use lumencast_gather::reference::{PictureSettings, Renderer};
use lumencast_scene::{AlphaMode, Filter, LightKind, Material, Snapshot, View};
use lumencast_testkit::scenes::{Stage, lambert};

use super::common::*;

/// A sheet that shines over a floor that shines, seen from above.
fn seen_from_above(material: Material) -> Arc<Snapshot> {
    let mut stage = many_triangles();
    let side = 2.0 * WIDE;
    for (height, material) in [(0.0, lambert(BLACK, BEHIND * Vec3::ONE)), (1.0, material)] {
        let material = stage.material(material);
        let corner = Vec3::new(-WIDE, height, WIDE) + BESIDE;
        stage.quad(corner, Vec3::X * side, Vec3::NEG_Z * side, material);
    }
    stage.snapshot()
}

/// Radiance of that sheet, and of the floor behind it, cd/m².
const FRONT: f32 = 2.0;
const BEHIND: f32 = 7.0;

/// A camera sees α of the sheet and 1 − α of what is behind, and probes do.
#[test]
fn cameras_see_through_sheets() {
    let emissive = FRONT * Vec3::ONE;
    let scene = seen_from_above(Material { emissive, ..veil() });
    let expected = ALPHA * FRONT + (1.0 - ALPHA) * BEHIND;
    let wrong = [FRONT, BEHIND, ALPHA * BEHIND + (1.0 - ALPHA) * FRONT, 1.03 * expected];
    for view in views() {
        let film = picture(&scene, view, PictureSettings { bounces: 0, ..settings() }, 256);
        let pixels: Vec<f32> = film.picture().iter().map(|v| v.x).collect();
        Estimate::of(&pixels).check("picture", expected, &wrong, 1e-5);
        let frame = Renderer::new(&scene, view, settings()).unwrap().frame(0);
        let whole = frame.samples.iter().filter(|s| s.emitted.x == FRONT).count();
        assert!(frame.samples.iter().all(|s| [FRONT, BEHIND].contains(&s.emitted.x)));
        let share = whole as f32 / frame.samples.len() as f32;
        assert!((share - ALPHA).abs() < 0.06, "{share} of a frame is of the sheet");
    }
    let wrong = wrong.map(|radiance| PI * radiance);
    for levels in LEVELS {
        let found = irradiance(&scene, (2.0 * Vec3::Y, Vec3::NEG_Y), levels, 0, 1024);
        found.check(&format!("{levels:?}"), PI * expected, &wrong, 1e-3);
    }
}

/// Through a mask, every pixel sees either what is whole or what is behind, by place.
#[test]
fn cameras_see_through_masks() {
    let of = |mask: Material| seen_from_above(Material { emissive: FRONT * Vec3::ONE, ..mask });
    let opaque = of(Material { alpha_mode: AlphaMode::Opaque, ..mask(Filter::Nearest) });
    let scene = of(mask(Filter::Nearest));
    for view in views() {
        let size = settings().size;
        let rays = view.rays(size.x as f32 / size.y as f32);
        // Where a point of the picture lies on the sheet.
        let place = |pixel: Vec2| {
            let (origin, direction) = rays.through(pixel / size.as_vec2());
            (origin + (1.0 - origin.y) / direction.y * direction).x
        };
        let pixels =
            (0..size.x * size.y).map(|n| Vec2::new((n % size.x) as f32, (n / size.x) as f32));
        let expected: Vec<Option<f32>> = pixels
            .map(|corner| {
                let corners = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]].map(Vec2::from);
                let stripes = corners.map(|c| (2.0 * place(corner + c)).floor());
                let is_one = stripes.iter().all(|stripe| *stripe == stripes[0]);
                is_one.then_some(if is_whole(0.5 * stripes[0] + 0.25) { FRONT } else { BEHIND })
            })
            .collect();
        let compare = |scene: &Arc<Snapshot>| {
            let film = picture(scene, view, PictureSettings { bounces: 0, ..settings() }, 4);
            let seen = film.picture().into_iter().map(|v| v.x);
            let known = expected.iter().zip(seen).filter_map(|(e, seen)| Some((seen, (*e)?)));
            let (same, others): (Vec<_>, Vec<_>) =
                known.partition(|(seen, expected)| (seen - expected).abs() < 1e-4);
            [same.len(), others.len()]
        };
        let [same, others] = compare(&scene);
        assert!(same > 400 && others == 0, "{same} {others}");
        let [same, others] = compare(&opaque);
        assert!(same.min(others) > 100, "the check has no teeth: {same} {others}");
    }
}

/// The ray of a camera and the one that its surface reaches for light with cross the same triangle,
/// and decide independently: (1 − α)². The same decision for both would give 1 − α.
#[test]
fn rays_of_a_path_decide_independently() {
    // Other sources are seen by the camera too, or hide the floor from it.
    for name in ["point", "sphere", "sun without a size", "wide sun"] {
        let Source { light, irradiance: received, .. } = source(name);
        let mut stage = floor();
        light(&mut stage);
        let scene = with_sheet(stage, 1.0, veil()).snapshot();
        let view = View::look_at(Vec3::new(0.0, 2.0, 0.0), BLACK, 0.002).unwrap();
        let film = picture(&scene, view, PictureSettings { bounces: 1, ..settings() }, 64);
        let pixels: Vec<f32> = film.picture().iter().map(|v| v.x).collect();
        let expected = (1.0 - ALPHA).powi(2) * received / PI;
        let wrong = [expected / (1.0 - ALPHA), received / PI, 0.0];
        Estimate::of(&pixels).check(name, expected, &wrong, 1e-3 * expected);
    }
}

/// Sheets that shine are as bright as they are there, reached for or met by chance: a floor receives
/// α of what an opaque one sends.
#[test]
fn sheets_shine_by_what_is_there() {
    let emissive = Vec3::splat(2.0);
    for half in [0.5, 20.0] {
        let all = 2.0 * PI * form_factor([-half, half], [-half, half]);
        for levels in LEVELS {
            let under = |material: Material| {
                let mut stage = floor();
                let material = stage.material(material);
                stage.primitive(sheet(1.0, half, 1.0, material), Affine3A::IDENTITY);
                on_floor(&stage.snapshot(), BLACK, levels)
            };
            let name = format!("{half} {levels:?}");
            let wrong = [all, (1.0 - ALPHA) * all, ALPHA * ALPHA * all, 0.0];
            let found = under(Material { emissive, ..veil() });
            found.check(&name, ALPHA * all, &wrong, 1e-3 * all);
            let opaque = Material { alpha_mode: AlphaMode::Opaque, emissive, ..veil() };
            under(opaque).check(&name, all, &[ALPHA * all], 1e-3 * all);
        }
    }
}

/// A hollow white sphere, its lamp in a black ball of opacity α: the wall receives (1 − α) I/R². Of what
/// it scatters, the share s = (r/R)² crosses the ball, twice, so that each bounce brings
/// ρ (1 − s (1 − (1 − α)²)) of the one before.
#[test]
fn bounces_cross_sheets() {
    let (albedo, radius, ball, intensity) = (0.8, 2.0, 1.4, 30.0);
    let scene = |alpha_mode: AlphaMode| {
        let mut stage = Stage::default();
        let wall = stage.material(lambert(Vec3::splat(albedo), BLACK));
        let veil = stage.material(Material { alpha_mode, ..veil() });
        stage.sphere(BLACK, -radius, 64, wall).sphere(BLACK, ball, 64, veil);
        stage.light(light(LightKind::Point { radius: 0.0 }, intensity), BLACK, Vec3::X);
        stage.snapshot()
    };
    let crosses = (ball / radius).powi(2);
    let once = 1.0 - ALPHA;
    let series = |first: f32, passes: f32, bounces: u32| {
        let next = albedo * (1.0 - crosses * (1.0 - passes));
        let sum: f32 = (0..bounces).map(|k| next.powi(k as i32)).sum();
        albedo * first * intensity / (radius * radius) * sum
    };
    let blended = scene(AlphaMode::Blend);
    // Near the wall, facing it or all the rest, of which the share r²/d² is behind the ball.
    let distance = radius - 0.1;
    let at = distance * Vec3::NEG_Y;
    let behind: f32 = (ball / distance).powi(2);
    for (levels, bounces) in [(Levels::One, 2), (Levels::Two, 5)] {
        for (normal, behind) in [(Vec3::NEG_Y, 0.0), (Vec3::Y, behind)] {
            let found = irradiance(&blended, (at, normal), levels, bounces, 2048);
            let seen = |passes: f32| 1.0 - behind * (1.0 - passes);
            let expected = seen(once * once) * series(once, once * once, bounces);
            // To scattered rays the ball is there once, or never, or whole; to the lamp's, never.
            let wrong = [
                seen(once * once) * series(once, once, bounces),
                seen(once * once) * series(once, 1.0, bounces),
                seen(once * once) * series(once, 0.0, bounces),
                seen(once * once) * series(1.0, once * once, bounces),
                1.03 * expected,
            ];
            let name = format!("{levels:?}, {bounces}, {normal}");
            found.check(&name, expected, &wrong, 5e-3 * expected);
            let to_the_eye = [once, 1.0, 0.0].map(|p| seen(p) * expected / seen(once * once));
            if behind > 0.0 {
                found.check(&name, expected, &to_the_eye, 5e-3 * expected);
            }
        }
    }
    let opaque = irradiance(&scene(AlphaMode::Opaque), (at, Vec3::NEG_Y), Levels::One, 2, 1024);
    opaque.check("opaque", 0.0, &[series(once, once * once, 2)], 1e-6);
}
