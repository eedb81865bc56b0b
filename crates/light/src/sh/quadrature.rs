//! Integration over the sphere.

use std::f32::consts::TAU;

use glam::Vec3;

use super::{Order, Sh, basis};

/// Nodes and weights of Gauss–Legendre quadrature with 5 points, exact to degree 9 (Abramowitz and
/// Stegun, table 25.4).
const GAUSS: [(f32, f32); 5] = [
    (-0.906_179_84, 0.236_926_89),
    (-0.538_469_3, 0.478_628_67),
    (0.0, 0.568_888_9),
    (0.538_469_3, 0.478_628_67),
    (0.906_179_84, 0.236_926_89),
];
/// Equal steps of azimuth: nine integrate waves up to the eighth.
const AZIMUTHS: usize = 9;

/// Unit vectors and weights (of sum 4π) that integrate polynomials of degree 8 over the sphere
/// exactly: products of two functions of order up to 4.
pub fn quadrature() -> impl Iterator<Item = (Vec3, f32)> {
    GAUSS.into_iter().flat_map(|(z, weight)| {
        let radius = (1.0 - z * z).sqrt();
        (0..AZIMUTHS).map(move |i| {
            let (sin, cos) = (TAU * i as f32 / AZIMUTHS as f32).sin_cos();
            (Vec3::new(radius * cos, radius * sin, z), weight * TAU / AZIMUTHS as f32)
        })
    })
}

/// The expansion of a function of direction. Exact for polynomials of direction of degree
/// 8 − `order`; sharper functions alias and want a Monte Carlo sum instead.
pub fn project(order: Order, radiance: impl Fn(Vec3) -> Vec3) -> Sh {
    let mut sh = Sh::dark(order);
    for (direction, weight) in quadrature() {
        let radiance = radiance(direction) * weight;
        let basis = basis(order, direction);
        for (c, b) in sh.values_mut().iter_mut().zip(basis) {
            *c += radiance * b;
        }
    }
    sh
}
