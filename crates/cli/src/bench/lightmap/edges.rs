//! What is seen at the edges of charts: seams, and light from beyond them.

use glam::{IVec2, UVec2, Vec3};
use lumencast_charts::lumels;
use lumencast_light::{Lightmap, Place, luminance};

use super::super::quantile;

/// The quantile of a seam's differences that is told.
const MOST: f64 = 0.99;
/// Lux over white of lumels that must not be read.
const POISON: f32 = 1e4;

/// By how much both sides of seams differ, as a share of what they read; none where there are no seams.
pub(super) fn relative(sides: &[[Vec3; 2]]) -> Option<f64> {
    let difference = |sides: &[Vec3; 2]| {
        let [a, b] = sides.map(luminance);
        let most = a.max(b);
        (most > 0.0).then(|| f64::from((a - b).abs() / most))
    };
    of(sides.iter().filter_map(difference).collect())
}

/// By how many codes of a display both sides of seams differ.
pub(super) fn codes(sides: &[[Vec3; 2]], white: f32) -> Option<f64> {
    of(sides.iter().map(|[a, b]| code_difference(*a, *b, white)).collect())
}

fn of(mut differences: Vec<f64>) -> Option<f64> {
    differences.sort_unstable_by(f64::total_cmp);
    (!differences.is_empty()).then(|| quantile(&differences, MOST))
}

/// By how many codes, at most, light at places changes where all lumels glow that are neither covered by
/// a chart nor beside one that is.
pub(super) fn poisoned(lightmap: &Lightmap, places: &[Place], white: f32) -> f64 {
    let mut poisoned = lightmap.clone();
    let layout = &lightmap.layout;
    poisoned.irradiance.fill(Vec3::splat(POISON * white));
    for surface in layout.surfaces() {
        for lumel in lumels(&surface.charts) {
            let rectangle = surface.rectangles[lumel.rectangle as usize];
            let at = (rectangle.corner + lumel.at).as_ivec2();
            for beside in (-1..=1).flat_map(|y| (-1..=1).map(move |x| IVec2::new(x, y))) {
                let side = IVec2::splat(layout.page_size as i32 - 1);
                let lumel: UVec2 = (at + beside).clamp(IVec2::ZERO, side).as_uvec2();
                let index = layout.index(rectangle.page, lumel);
                poisoned.irradiance[index] = lightmap.irradiance[index];
            }
        }
    }
    let differences = places.iter().filter_map(|place| {
        let [a, b] =
            [lightmap, &poisoned].map(|lightmap| lightmap.irradiance_at(place.on.as_ref()?));
        Some(code_difference(a?, b?, white))
    });
    differences.fold(0.0, f64::max)
}

fn code_difference(a: Vec3, b: Vec3, white: f32) -> f64 {
    let code = |e: Vec3| 255.0 * (e / white).clamp(Vec3::ZERO, Vec3::ONE).powf(1.0 / 2.2);
    f64::from((code(a) - code(b)).abs().max_element())
}
