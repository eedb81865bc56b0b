//! Rotation of expansions.

use glam::Quat;

use super::{BAND, MAX_COEFFICIENTS, Order, Sh, basis, quadrature};

/// A rotation of light of a given order.
///
/// Rotated light f'(d) = f(R⁻¹d) has in each band c'ₘ = Σ Mₘₙ cₙ with Mₘₙ = ∫ Yₘ(d) Yₙ(R⁻¹d) dω.
/// The integrand is a polynomial of degree 2l, so the 45 points of [`quadrature`] give M up to
/// rounding. Building it costs about 10,000 multiplications at order 4, applying it 165 a channel.
#[derive(Clone, Debug)]
pub struct Rotation {
    order: Order,
    /// Only entries with both indices in the same band are used; others are 0.
    matrix: [[f32; MAX_COEFFICIENTS]; MAX_COEFFICIENTS],
}

impl Rotation {
    /// By the unit quaternion `rotation`: light that came from `d` then comes from `rotation * d`.
    pub fn new(order: Order, rotation: Quat) -> Self {
        let mut matrix = [[0.0; MAX_COEFFICIENTS]; MAX_COEFFICIENTS];
        let inverse = rotation.inverse();
        for (direction, weight) in quadrature() {
            let to = basis(order, direction);
            let from = basis(order, inverse * direction);
            for ((row, to), l) in matrix.iter_mut().zip(to).zip(BAND).take(order.coefficients()) {
                for j in band(l) {
                    row[j] += weight * to * from[j];
                }
            }
        }
        Self { order, matrix }
    }

    /// Rotated light. Bands beyond the rotation's order are left out.
    pub fn apply(&self, light: &Sh) -> Sh {
        let mut rotated = Sh::dark(self.order.min(light.order));
        for ((c, row), l) in rotated.values_mut().iter_mut().zip(&self.matrix).zip(BAND) {
            *c = band(l).map(|j| light.coefficients[j] * row[j]).sum();
        }
        rotated
    }
}

/// Indices of a band's coefficients.
fn band(l: usize) -> std::ops::Range<usize> {
    l * l..(l + 1) * (l + 1)
}

#[cfg(test)]
mod tests {
    use super::super::{project, tests::DIRECTIONS};
    use super::*;
    use glam::Vec3;

    fn light(d: Vec3) -> Vec3 {
        let value = 1.0 + d.x - 2.0 * d.y * d.z + d.x.powi(3) * d.y + 0.5 * d.z.powi(4);
        value * Vec3::new(1.0, -2.0, 0.1)
    }

    #[test]
    fn rotating_coefficients_is_rotating_the_function() {
        let rotations = [
            Quat::IDENTITY,
            Quat::from_rotation_y(1.2),
            Quat::from_xyzw(0.1, -0.5, 0.3, 0.8).normalize(),
        ];
        for order in [Order::L1, Order::L2, Order::L3, Order::L4] {
            for rotation in rotations {
                let rotated = Rotation::new(order, rotation).apply(&project(order, light));
                // `project` is exact for this function at order 4 only; compare what was projected.
                let plain = project(order, light);
                for direction in DIRECTIONS {
                    let exact = plain.radiance(rotation.inverse() * direction);
                    assert!((rotated.radiance(direction) - exact).length() < 2e-5);
                }
            }
        }
    }

    #[test]
    fn rotating_agrees_with_projecting_the_rotated_function() {
        let rotation = Quat::from_xyzw(0.1, -0.5, 0.3, 0.8).normalize();
        let rotated = Rotation::new(Order::L4, rotation).apply(&project(Order::L4, light));
        let direct = project(Order::L4, |d| light(rotation.inverse() * d));
        for (a, b) in rotated.values().iter().zip(direct.values()) {
            assert!((*a - *b).length() < 2e-5, "{a} {b}");
        }
        // A rotation the other way would be noticed.
        let wrong = Rotation::new(Order::L4, rotation.inverse()).apply(&project(Order::L4, light));
        assert!((wrong.coefficients[1] - direct.coefficients[1]).length() > 0.1);
    }

    #[test]
    fn one_after_the_other_is_their_product() {
        let (a, b) = (Quat::from_rotation_x(0.7), Quat::from_rotation_z(-1.9));
        let light = project(Order::L3, light);
        let stepwise =
            Rotation::new(Order::L3, a).apply(&Rotation::new(Order::L3, b).apply(&light));
        let at_once = Rotation::new(Order::L3, a * b).apply(&light);
        for (a, b) in stepwise.values().iter().zip(at_once.values()) {
            assert!((*a - *b).length() < 2e-5);
        }
    }
}
