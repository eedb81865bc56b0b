//! How noisy light is, as it is shown.

use glam::Vec3;
use lumencast_light::FieldId;

use crate::solver::Solver;

/// Share of all irradiances that lie below what is displayed as white.
const WHITE: f32 = 0.99;

/// Root of the mean square by which two states of the same fields differ where they are read, in codes
/// of 0 to 255: v^(1/2.2) for surfaces alike, where the brightest hundredth is white. Volumes are read
/// on the surfaces that they know, or in all directions at their probes; lightmaps at their lumels.
pub(crate) fn shown(one: &Solver, other: &Solver, fields: &[FieldId]) -> f32 {
    let seen = |solver: &Solver| -> Vec<Vec3> {
        let all = fields.iter().flat_map(|field| solver.seen(*field));
        all.map(|irradiance| irradiance.max(Vec3::ZERO)).collect()
    };
    let [one, other] = [one, other].map(seen);
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
