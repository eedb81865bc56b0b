//! Ambient occlusion in screen space, beside closed forms of what it is defined as: the share of the
//! cosine-weighted half space that is visible, in which what lies at distance t < R hides 1 − (t/R)².

use std::f32::consts::{FRAC_2_PI, FRAC_PI_2};
use std::sync::Arc;

use crate::common::renderer;
use glam::{Quat, UVec2, UVec3, Vec3};
use lumencast_light::{FieldId, Grid, Light, Order, ProbeVolume};
use lumencast_scene::{
    AlphaMode, LightKind, Material, MaterialId, Projection, PunctualLight, Snapshot, View,
};
use lumencast_shade::{Lighting, Occlusion, Renderer, Settings, Shading};
use lumencast_testkit::scenes::{Stage, lambert};

const SIZE: UVec2 = UVec2::new(192, 128);

fn settings(radius: f32) -> Settings {
    Settings {
        size: SIZE,
        samples: 1,
        lighting: Lighting::INDIRECT,
        occlusion: Some(Occlusion { radius, ..Occlusion::default() }),
        ..Settings::default()
    }
}

/// So dark that no light is scattered twice.
fn dark() -> Material {
    lambert(Vec3::splat(0.01), Vec3::ZERO)
}

/// The same light from everywhere.
fn uniform() -> Light {
    let grid = Grid {
        center: Vec3::ZERO,
        rotation: Quat::IDENTITY,
        size: Vec3::splat(10.0),
        resolution: UVec3::ONE,
    };
    let mut volume = ProbeVolume::dark(FieldId(0), grid, Order::L1);
    volume.probe_mut(0)[0] = Vec3::splat(100.0);
    Light::new(vec![volume])
}

fn lit(scene: &Arc<Snapshot>, settings: &Settings) -> Renderer {
    let mut renderer = renderer(scene, settings);
    renderer.set_light(&uniform()).unwrap();
    renderer
}

/// What occlusion leaves of each pixel's light; nothing where there is none.
fn visibility(scene: &Arc<Snapshot>, view: View, settings: &Settings) -> Vec<Option<f32>> {
    let mut renderer = lit(scene, settings);
    let mut draw = |settings: &Settings| renderer.pictures(&[view], settings).unwrap().remove(0);
    let open = draw(&Settings { occlusion: None, ..*settings });
    let occluded = draw(settings);
    let share = |(left, all): (&Vec3, &Vec3)| (all.x > 0.0).then(|| left.x / all.x);
    occluded.iter().zip(&open).map(share).collect()
}

/// The least and the greatest.
fn range(visibility: &[Option<f32>]) -> (f32, f32) {
    let seen = || visibility.iter().flatten().copied();
    assert!(seen().count() > 1000, "something is seen");
    (seen().fold(f32::MAX, f32::min), seen().fold(f32::MIN, f32::max))
}

/// The same camera without perspective.
fn orthographic(view: View) -> View {
    let projection =
        Projection::Orthographic { half_width: 1.2, half_height: 0.8, near: 0.0, far: 40.0 };
    View { projection, ..view }
}

fn floor(stage: &mut Stage, material: MaterialId) {
    let side = 200.0;
    stage.quad(
        Vec3::new(-side, 0.0, side),
        Vec3::X * 2.0 * side,
        Vec3::NEG_Z * 2.0 * side,
        material,
    );
}

/// A box whose fronts face outwards.
fn block(stage: &mut Stage, center: Vec3, size: Vec3, material: MaterialId) {
    for axis in 0..3 {
        for side in [-1.0, 1.0] {
            let u = Vec3::AXES[(axis + 1) % 3] * size;
            let v = side * Vec3::AXES[(axis + 2) % 3] * size;
            let corner = center + 0.5 * (side * Vec3::AXES[axis] * size - u - v);
            stage.quad(corner, u, v, material);
        }
    }
}

#[test]
fn a_plane_is_open() {
    let mut stage = Stage::default();
    let material = stage.material(dark());
    floor(&mut stage, material);
    let scene = stage.snapshot();
    for (height, down) in [(0.05, 0.02), (0.5, 0.3), (0.7, 1.0), (3.0, 5.0)] {
        for radius in [0.1, 1.0] {
            let eye = Vec3::new(0.3, height, 0.0);
            let target = eye + Vec3::new(0.4, -down, -1.0);
            let view = View::look_at(eye, target, 0.9).unwrap();
            for view in [view, orthographic(view)] {
                let (least, greatest) = range(&visibility(&scene, view, &settings(radius)));
                let told = format!("{height} m above, {down} down, {radius} m: {least}");
                assert!(least > 0.998 && greatest < 1.001, "{told}");
            }
        }
    }
}

/// A floor, and a wall a metre high along the x axis that faces +z.
fn corner() -> (Arc<Snapshot>, View) {
    let mut stage = Stage::default();
    let material = stage.material(dark());
    stage.quad(Vec3::new(-9.0, 0.0, 9.0), Vec3::X * 18.0, Vec3::NEG_Z * 9.0, material);
    stage.quad(Vec3::new(-9.0, 0.0, 0.0), Vec3::X * 18.0, Vec3::Y, material);
    let view = View::look_at(Vec3::new(0.3, 1.1, 2.0), Vec3::new(0.0, 0.2, 0.0), 0.6).unwrap();
    (stage.snapshot(), view)
}

/// Visibility at δ radii from a wall that is at least a radius high: 1 − 2/π ∫ (1 − δ²/x²) √(1 − x²) dx
/// over x from δ to 1, x being the cosine of a direction with the wall's normal.
fn beside_wall(delta: f32) -> f32 {
    if delta >= 1.0 {
        return 1.0;
    }
    let (root, angle) = ((1.0 - delta * delta).sqrt(), delta.asin());
    let all = 0.5 * (FRAC_PI_2 - delta * root - angle);
    let left = delta * root + delta * delta * (angle - FRAC_PI_2);
    1.0 - FRAC_2_PI * (all - left)
}

#[test]
fn the_closed_form_is_the_integral() {
    const STEPS: u32 = 100_000;
    for delta in [0.0, 0.01, 0.3, 0.8, 1.0] {
        let width = f64::from(1.0 - delta) / f64::from(STEPS);
        let delta64 = f64::from(delta);
        let hidden: f64 = (0..STEPS)
            .map(|i| {
                let x = delta64 + (f64::from(i) + 0.5) * width;
                (1.0 - delta64 * delta64 / (x * x)) * (1.0 - x * x).sqrt()
            })
            .sum();
        let integral = 1.0 - std::f64::consts::FRAC_2_PI * hidden * width;
        assert!((f64::from(beside_wall(delta)) - integral).abs() < 1e-4, "{delta}: {integral}");
    }
}

/// Root mean square and largest difference from the closed form for `expected` metres, at pixels that
/// are farther than three pixels from where the planes meet, and a radius from the picture's sides.
fn off_corner(view: View, settings: &Settings, expected: f32) -> (f32, f32) {
    let (scene, _) = corner();
    let seen = visibility(&scene, view, settings);
    let size = settings.size;
    let aspect = size.x as f32 / size.y as f32;
    let hit = |x: u32, y: u32| {
        let at = (UVec2::new(x, y).as_vec2() + 0.5) / size.as_vec2();
        let (origin, direction) = view.ray(at, aspect);
        let on_wall = origin - direction * (origin.z / direction.z);
        let on_floor = origin - direction * (origin.y / direction.y);
        (on_wall.y > 0.0, if on_wall.y > 0.0 { on_wall.y } else { on_floor.z })
    };
    // What hides light beyond the picture's sides is not seen.
    let side = (130.0 * expected) as u32;
    let (mut squares, mut worst, mut count) = (0.0, 0.0f32, 0.0);
    for y in 3..size.y - 3 {
        for x in side..size.x - side {
            let (is_wall, distance) = hit(x, y);
            // At the upper edge of the wall nothing is left of the half space above.
            if hit(x, y - 3).0 != is_wall
                || hit(x, y + 3).0 != is_wall
                || (is_wall && distance > 0.9)
            {
                continue;
            }
            let found = seen[(y * size.x + x) as usize].expect("light");
            let off = (found - beside_wall(distance / expected)).abs();
            squares += off * off;
            worst = worst.max(off);
            count += 1.0;
        }
    }
    assert!(count > 1000.0, "both planes are seen");
    (f32::sqrt(squares / count), worst)
}

#[test]
fn walls_hide_what_they_should() {
    let (_, view) = corner();
    for view in [view, orthographic(view)] {
        for radius in [0.1, 0.25, 0.5] {
            let (rms, worst) = off_corner(view, &settings(radius), radius);
            eprintln!("{radius} m: root mean square {rms:.4}, largest {worst:.4}");
            assert!(rms < 0.025 && worst < 0.08, "{radius} m: {rms}, {worst}");
        }
        let (rms, _) = off_corner(view, &settings(0.5), 0.7);
        assert!(rms > 0.05, "another radius is noticed: {rms}");
    }
}

#[test]
fn resolution_changes_little() {
    let (scene, view) = corner();
    let fine = Settings { size: 3 * SIZE, ..settings(0.3) };
    let (coarse, fine) =
        (visibility(&scene, view, &settings(0.3)), visibility(&scene, view, &fine));
    let (mut sum, mut count) = (0.0, 0.0);
    for y in 0..SIZE.y {
        for x in 0..SIZE.x {
            let middle = fine[((3 * y + 1) * 3 * SIZE.x + 3 * x + 1) as usize];
            if let (Some(a), Some(b)) = (coarse[(y * SIZE.x + x) as usize], middle) {
                sum += (a - b).abs();
                count += 1.0;
            }
        }
    }
    assert!(count > 1000.0 && sum / count < 0.01, "mean difference {}", sum / count);
}

/// A block in front of a wall.
fn before_wall(distance: f32) -> (Arc<Snapshot>, View) {
    let mut stage = Stage::default();
    let material = stage.material(dark());
    stage.quad(Vec3::new(-5.0, -5.0, 0.0), Vec3::X * 10.0, Vec3::Y * 10.0, material);
    let size = Vec3::new(0.5, 0.4, 0.2);
    block(&mut stage, Vec3::Z * (distance + 0.1), size, material);
    let eye = Vec3::new(0.4, 0.5, distance + 1.8);
    (stage.snapshot(), View::look_at(eye, Vec3::Z * distance, 0.7).unwrap())
}

/// Nothing lies within the radius of anything else, so no pixel loses light, at edges either, however
/// pixels are sampled.
#[test]
fn what_is_far_behind_has_no_halo() {
    let (scene, view) = before_wall(0.5);
    for (samples, shading) in [(1, Shading::Pixels), (4, Shading::Pixels), (8, Shading::Samples)] {
        let settings = Settings { samples, shading, ..settings(0.3) };
        let (least, greatest) = range(&visibility(&scene, view, &settings));
        assert!(least > 0.97 && greatest < 1.005, "{samples}, {shading:?}: {least} {greatest}");
    }
    let (least, _) = range(&visibility(&scene, view, &settings(2.0)));
    assert!(least < 0.9, "a larger radius reaches the wall: {least}");
    let (scene, view) = before_wall(0.02);
    let (least, _) = range(&visibility(&scene, view, &settings(0.3)));
    assert!(least < 0.7, "so does a nearer block: {least}");
}

/// A block on a floor whose light is much less at its foot: each pixel of an edge between them is as
/// samples of its own would have it, neither darker nor brighter.
#[test]
fn edges_have_no_seam() {
    let mut stage = Stage::default();
    let material = stage.material(dark());
    floor(&mut stage, material);
    block(&mut stage, Vec3::Y * 0.2, Vec3::new(0.7, 0.4, 0.5), material);
    let scene = stage.snapshot();
    let view = View::look_at(Vec3::new(0.9, 0.9, 1.3), Vec3::Y * 0.1, 0.7).unwrap();
    let fine = Settings { size: 4 * SIZE, samples: 1, ..settings(0.3) };
    let truth = visibility(&scene, view, &fine);
    for (samples, shading) in [(4, Shading::Pixels), (8, Shading::Samples)] {
        let settings = Settings { samples, shading, ..settings(0.3) };
        let found = visibility(&scene, view, &settings);
        let mut off: Vec<f32> = Vec::new();
        for (i, found) in (0..).zip(&found) {
            let (x, y) = (i % SIZE.x, i / SIZE.x);
            let of = |k: u32| truth[((4 * y + k / 4) * 4 * SIZE.x + 4 * x + k % 4) as usize];
            let all: Option<Vec<f32>> = (0..16).map(of).collect();
            if let (Some(found), Some(all)) = (found, all) {
                off.push((found - all.iter().sum::<f32>() / 16.0).abs());
            }
        }
        off.sort_by(f32::total_cmp);
        let worst = off[off.len() - off.len() / 1000 - 1];
        eprintln!("{samples}, {shading:?}: {worst} at one pixel in a thousand");
        assert!(off.len() > 10_000 && worst < 0.1, "{samples}, {shading:?}: {worst}");
    }
}

#[test]
fn gaps_are_dark() {
    let mut stage = Stage::default();
    let material = stage.material(dark());
    floor(&mut stage, material);
    block(&mut stage, Vec3::new(0.0, 0.55, 0.0), Vec3::new(1.0, 1.0, 1.0), material);
    let scene = stage.snapshot();
    // Through a gap of 5 cm.
    let fov = 0.2;
    let view = View::look_at(Vec3::new(0.0, 0.15, 1.5), Vec3::new(0.0, 0.0, 0.6), fov).unwrap();
    let seen = visibility(&scene, view, &settings(0.25));
    // The floor 10 cm behind the block's front.
    let at = |point: Vec3| {
        let camera = view.world_from_camera.inverse().transform_point3(point);
        let up = camera.y / -camera.z / (0.5f32 * fov).tan();
        let row = (0.5 - 0.5 * up) * SIZE.y as f32;
        seen[(row as u32 * SIZE.x + SIZE.x / 2) as usize].expect("light")
    };
    let (inside, outside) = (at(Vec3::Z * 0.4), at(Vec3::Z * 0.85));
    assert!(inside < 0.35 && outside > 0.98, "{inside} {outside}");
}

/// Holes hide nothing, and neither do blended surfaces.
#[test]
fn only_what_is_solid_hides() {
    let veil = |alpha, alpha_mode| Material {
        base_color: Vec3::splat(0.01).extend(alpha),
        alpha_mode,
        double_sided: true,
        ..dark()
    };
    for (name, material, hides) in [
        ("opaque", veil(0.3, AlphaMode::Opaque), true),
        ("masked", veil(0.7, AlphaMode::Mask(0.5)), true),
        ("a hole", veil(0.3, AlphaMode::Mask(0.5)), false),
        ("blended", veil(0.5, AlphaMode::Blend), false),
    ] {
        let mut stage = Stage::default();
        let (ground, veil) = (stage.material(dark()), stage.material(material));
        floor(&mut stage, ground);
        stage.quad(Vec3::new(-0.5, 0.0, 0.0), Vec3::X, Vec3::Y * 0.6, veil);
        let view = View::look_at(Vec3::new(0.2, 1.0, 1.5), Vec3::ZERO, 0.8).unwrap();
        let (least, _) = range(&visibility(&stage.snapshot(), view, &settings(0.3)));
        assert!(if hides { least < 0.7 } else { least > 0.98 }, "{name}: {least}");
    }
}

/// A lit, glossy corner with a lamp in it.
fn furnished() -> (Arc<Snapshot>, View) {
    let mut stage = Stage::default();
    let white = Vec3::splat(0.8).extend(1.0);
    let glossy = Material { base_color: white, roughness: 0.4, metallic: 0.3, ..dark() };
    let (glossy, lamp) = (stage.material(glossy), stage.material(lambert(Vec3::ONE, Vec3::ONE)));
    floor(&mut stage, glossy);
    block(&mut stage, Vec3::new(0.0, 0.2, 0.0), Vec3::splat(0.4), glossy);
    block(&mut stage, Vec3::new(0.5, 0.1, 0.2), Vec3::splat(0.2), lamp);
    let kind = LightKind::Point { radius: 0.0 };
    let light = PunctualLight { kind, color: Vec3::ONE, intensity: 30.0, range: None };
    stage.light(light, Vec3::new(1.0, 2.0, 1.0), Vec3::NEG_Y);
    let view = View::look_at(Vec3::new(0.9, 1.1, 1.4), Vec3::ZERO, 0.8).unwrap();
    (stage.snapshot(), view)
}

#[test]
fn only_indirect_light_is_taken_and_only_where_asked() {
    let (scene, view) = furnished();
    for samples in [1, 4] {
        let settings = Settings { samples, ..settings(0.3) };
        let mut renderer = lit(&scene, &settings);
        let mut draw = |lighting, occlusion| {
            let settings = Settings { lighting, occlusion, ..settings };
            let (pictures, drawn) = renderer.pictures_with(&[view], &settings).unwrap();
            (pictures, drawn.time)
        };
        let (open, time) = draw(Lighting::FIELD, None);
        assert!(time.is_none_or(|time| time.occlusion == 0.0 && time.pictures > 0.0));
        let (occluded, time) = draw(Lighting::FIELD, settings.occlusion);
        assert!(time.is_none_or(|time| time.occlusion > 0.0 && time.pictures > 0.0));
        assert!(occluded != open, "it does something");
        let no_radius = Some(Occlusion { radius: 0.0, ..Occlusion::default() });
        assert!(draw(Lighting::FIELD, no_radius).0 == open, "0 m is none");
        assert!(draw(Lighting::FIELD, None).0 == open, "none is as before");
        for lighting in [Lighting::DIRECT, Lighting::NONE] {
            assert!(draw(lighting, None).0 == draw(lighting, settings.occlusion).0);
        }
    }
}

#[test]
fn views_have_their_own() {
    let (scene, view) = furnished();
    let other = View::look_at(Vec3::new(-0.9, 0.7, 1.0), Vec3::ZERO, 0.9).unwrap();
    let settings = settings(0.3);
    let mut renderer = lit(&scene, &settings);
    let both = renderer.pictures(&[view, other], &settings).unwrap();
    for (picture, view) in both.iter().zip([view, other]) {
        assert!(renderer.pictures(&[view], &settings).unwrap()[0] == *picture);
    }
}
