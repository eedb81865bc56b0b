//! What is seen at the edges of charts: seams, and light from beyond them.

use glam::{IVec2, UVec2, Vec3};
use lumencast_charts::lumels;
use lumencast_light::{Lightmap, Place, luminance};

use super::display::{code, most};

/// Lux over white of lumels that must not be read.
const POISON: f32 = 1e4;

/// By how much both sides of seams differ, as a share of what they read; none where there are no seams.
pub(super) fn relative(sides: &[[Vec3; 2]]) -> Option<f64> {
    let difference = |sides: &[Vec3; 2]| {
        let [a, b] = sides.map(luminance);
        let larger = a.max(b);
        (larger > 0.0).then(|| f64::from((a - b).abs() / larger))
    };
    most(sides.iter().filter_map(difference).collect())
}

/// By how many codes of a display both sides of seams differ.
pub(super) fn codes(sides: &[[Vec3; 2]], white: f32) -> Option<f64> {
    most(sides.iter().map(|[a, b]| code_difference(*a, *b, white)).collect())
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
    let codes = |e: Vec3| e.map(|channel| code(channel, white));
    f64::from((codes(a) - codes(b)).abs().max_element())
}
