//! How noisy light is, as it is shown.

use glam::Vec3;
use lumencast_light::{Light, Place};

use crate::solver::Solver;

/// Points of surfaces, or directions at probes, that are looked at, about so many at most.
const PLACES: usize = 1 << 16;
/// Share of all irradiances that lie below what is displayed as white.
const WHITE: f32 = 0.99;

/// Root of the mean square by which two states of the same fields differ where they are read, in codes
/// of 0 to 255: v^(1/2.2) for surfaces alike, where the brightest hundredth is white. They are read on
/// the surfaces that the fields know, or in all directions at their probes.
pub(crate) fn shown(one: &Solver, other: &Solver) -> f32 {
    let places = one.places();
    let step = places.len().div_ceil(PLACES).max(1);
    let read = |light: &Light| -> Vec<Vec3> {
        let irradiance =
            |place: &Place| light.irradiance(place.position, place.normal).max(Vec3::ZERO);
        places.iter().step_by(step).map(irradiance).collect()
    };
    let [one, other] = [one, other].map(|solver| read(solver.light()));
    let white = white(&one);
    if white <= 0.0 {
        return 0.0;
    }
    let code = |irradiance: &Vec3| (irradiance / white).min(Vec3::ONE).powf(1.0 / 2.2);
    let squares = one.iter().zip(&other).map(|(a, b)| (code(a) - code(b)).length_squared() / 3.0);
    255.0 * (squares.sum::<f32>() / one.len() as f32).sqrt()
}

/// The largest channel that is displayed as white; 0 where there is no light.
fn white(irradiances: &[Vec3]) -> f32 {
    let mut values: Vec<f32> = irradiances.iter().map(|e| e.max_element()).collect();
    values.sort_unstable_by(f32::total_cmp);
    values.get((WHITE * values.len() as f32) as usize).copied().unwrap_or(0.0)
}
