//! Rays that reach for light.

use std::f32::consts::PI;

use glam::{Affine3A, Vec3};
use lumencast_gather::path_trace::{CpuPathTracer, Levels, Options};
use lumencast_gather::{Gather, Job, Receiver, Shading};
use lumencast_scene::{AlphaMode, Environment, Filter, LightKind, Material};

use super::common::*;

/// Under a sheet of opacity α a floor receives 1 − α of every kind of light; under two of them, which
/// decide independently, (1 − α)².
#[test]
fn light_through_sheets() {
    for Source { name, light, irradiance } in sources() {
        for levels in LEVELS {
            let under = |sheets: &[(f32, Material)]| {
                let mut stage = floor();
                light(&mut stage);
                for (height, material) in sheets.iter().cloned() {
                    stage = with_sheet(stage, height, material);
                }
                on_floor(&stage.snapshot(), BLACK, levels)
            };
            let name = format!("{name}, {levels:?}");
            let (one, slack) = (1.0 - ALPHA, 1e-3 * irradiance);
            let share = |s: f32| s * irradiance;
            let wrong = [share(0.0), share(ALPHA), share(1.0), share(1.04 * one)];
            under(&[(1.0, veil())]).check(&name, share(one), &wrong, slack);
            let wrong = [share(one), share(1.0 - 2.0 * ALPHA)];
            let two = under(&[(0.8, veil()), (1.0, veil())]);
            two.check(&name, share(one * one), &wrong, slack);
            // Faults planted in the scene: no sheet, and one whose alpha is ignored.
            let opaque = Material { alpha_mode: AlphaMode::Opaque, ..veil() };
            for (fault, is) in [(under(&[]), 1.0), (under(&[(1.0, opaque)]), 0.0)] {
                fault.check(&name, share(is), &[share(one)], slack);
            }
        }
    }
}

/// What covers is the product of factor, texture and vertex colour; of a mask, whether that reaches the
/// cutoff. Sheets that are unlit are no exception.
#[test]
fn opacity_is_a_product() {
    let texture = || Some(stripes(&[204], 1.0, Filter::Nearest));
    for (alpha_mode, covers) in [
        (AlphaMode::Blend, 0.5 * 0.8 * 0.75),
        (AlphaMode::Mask(0.299), 1.0),
        (AlphaMode::Mask(0.301), 0.0),
        (AlphaMode::Opaque, 1.0),
    ] {
        for unlit in [false, true] {
            let mut stage = floor();
            let material = Material { unlit, ..black(alpha_mode, 0.5, texture()) };
            let material = stage.material(material);
            stage.primitive(sheet(1.0, WIDE, 0.75, material), Affine3A::IDENTITY);
            stage.light(
                light(LightKind::Point { radius: 0.0 }, LAMP.y.powi(2)),
                LAMP.y * Vec3::Y,
                Vec3::X,
            );
            let found = on_floor(&stage.snapshot(), BLACK, Levels::One);
            // Without the factor, the texture, the colour.
            let wrong = [0.8 * 0.75, 0.5 * 0.75, 0.5 * 0.8].map(|covers| 1.0 - covers);
            found.check(&format!("{alpha_mode:?}"), 1.0 - covers, &wrong, 1e-3);
        }
    }
}

/// Light that comes from one direction meets a masked sheet at one place: all of it passes, or none.
#[test]
fn masks_hold_up_narrow_light_by_place() {
    for name in ["point", "spot", "sun without a size"] {
        let source = source(name);
        let mut stage = floor();
        (source.light)(&mut stage);
        let open = stage.snapshot();
        let masked = with_sheet(stage, 1.0, mask(Filter::Nearest)).snapshot();
        // Two to a stripe, a quarter of its width from its edges.
        for (step, levels) in (0..8).flat_map(|step| LEVELS.map(|levels| (step, levels))) {
            let through = Vec3::new(0.25 * step as f32 - 0.875, 1.0, 0.2);
            let along = if name.contains("sun") { -SUN } else { through - LAMP };
            let at = through + along / -along.y;
            let received = on_floor(&open, at, levels).mean;
            assert!(received > 0.4 * source.irradiance, "{name} does not reach {at}");
            let whole = is_whole(through.x);
            let [passes, opacity] = if whole { [0.0, 180.0] } else { [1.0, 100.0] };
            // Where the sheet were what it is not, and where it were blended.
            let wrong = [1.0 - passes, 1.0 - opacity / 255.0].map(|share| share * received);
            let name = format!("{name}, {levels:?}, {step}");
            let found = on_floor(&masked, at, levels);
            found.check(&name, passes * received, &wrong, 1e-3 * received);
        }
    }
}

/// Of wide light, a floor receives what it sees through the holes: the form factors of open stripes.
#[test]
fn masks_hold_up_wide_light_by_form_factor() {
    // Of the sheet; at a metre, stripes of half a metre are all but a grey.
    let height = 0.25;
    // Radiance of the source, how far up it is, and half its size; and where the floor is asked: below
    // the middle of a stripe and of a hole, or where an edge divides the source.
    for (name, radiance, up, half, places) in [
        ("constant sky", 1.0, f32::INFINITY, f32::INFINITY, [0.25, 0.75]),
        ("emissive square", 4.0, 3.0, 1.5, [0.45, 0.6]),
    ] {
        let mut stage = floor();
        (source(name).light)(&mut stage);
        let scene = with_sheet(stage, height, mask(Filter::Nearest)).snapshot();
        // What is seen of it through such stripes.
        let shown = |x: f32, shows: fn(f32) -> bool| {
            // Half its size, and its middle, where they cross the sheet.
            let half = if half < f32::INFINITY { half * height / up } else { WIDE };
            let middle = x * (1.0 - height / up);
            let edges = (-4 * WIDE as i32..4 * WIDE as i32).map(|k| 0.5 * k as f32);
            let stripes = edges.filter(|left| shows(left + 0.25));
            let bounds = stripes.map(|left| {
                [left, left + 0.5].map(|edge| edge.clamp(middle - half, middle + half) - x)
            });
            let [y, half] = [-half, half].map(|y| y / height);
            let factor = |x: [f32; 2]| form_factor(x.map(|x| x / height), [y, half]);
            PI * radiance * bounds.map(factor).sum::<f32>()
        };
        for (x, levels) in places.into_iter().flat_map(|x| LEVELS.map(|l| (x, l))) {
            let all = shown(x, |_| true);
            let expected = shown(x, |x| !is_whole(x));
            let blended = (1.0 - 140.0 / 255.0) * all;
            let wrong = [0.0, all, all - expected, blended, 1.2 * expected];
            let found = on_floor(&scene, x * Vec3::X, levels);
            found.check(&format!("{name}, {levels:?}, {x}"), expected, &wrong, 1e-3 * all);
        }
    }
}

/// Between texels opacity is interpolated before it is compared with the cutoff, so filtering moves
/// the edges. Everywhere below, a floor receives on average the share that is open.
#[test]
fn masks_are_compared_after_filtering() {
    let [high, low] = OPACITIES.map(|a| f32::from(a) / 255.0);
    // Linear from the middle of a stripe to that of the next.
    let filtered = (high - CUTOFF) / (high - low);
    for (filter, covers) in [(Filter::Nearest, 0.5), (Filter::Linear, filtered)] {
        let mut stage = floor();
        stage.environment(Environment::Constant { radiance: Vec3::ONE });
        let scene = with_sheet(stage, 1.0, mask(filter)).snapshot();
        // Over two periods.
        let footprint = [2.0 * Vec3::X, Vec3::Z];
        let (position, shading) = (2e-3 * Vec3::Y, Shading::Own);
        let lumel = Receiver::Lumel { position, normal: Vec3::Y, footprint, shading };
        let mut tracer = CpuPathTracer::new(Options::default()).unwrap();
        let ticket = tracer.submit(Job { bounces: 0, ..Job::new(scene, [lumel; 32], 1024) });
        let sums = tracer.wait(ticket).unwrap().sums;
        let found =
            Estimate::of(&sums.iter().flat_map(|s| s.mean().map(|e| e.x)).collect::<Vec<_>>());
        let wrong = [1.0, 0.0, 0.5 + filtered - covers, 0.5 * (high + low)].map(|c| PI * (1.0 - c));
        found.check(&format!("{filter:?}"), PI * (1.0 - covers), &wrong, 1e-3 * PI);
    }
}
