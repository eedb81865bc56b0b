//! Curves over time: glTF 2.0, section 3.11 and appendix C.

use glam::{Quat, Vec4};

/// The property of a node that a curve moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Property {
    Translation,
    Rotation,
    Scale,
    Weights,
}

/// The interpolation between keys.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Interpolation {
    Step,
    Linear,
    CubicSpline,
}

/// A value over time. Before the first key it is the first key's, after the last key the last
/// key's.
#[derive(Clone, Debug)]
pub(crate) struct Curve {
    pub(crate) property: Property,
    pub(crate) interpolation: Interpolation,
    /// Numbers in a value: 3, 4 for rotations, or the number of morph targets.
    pub(crate) width: usize,
    /// Times of the keys, seconds, in ascending order; at least one. Where several keys have the
    /// same time, the value jumps there from the first one's to the last one's.
    pub(crate) times: Vec<f32>,
    /// `width` numbers for each key. Cubic splines have three times as many: in-tangent, value and
    /// out-tangent.
    pub(crate) values: Vec<f32>,
}

impl Curve {
    /// Number of values that a curve of `keys` keys needs.
    pub(crate) fn values_needed(interpolation: Interpolation, width: usize, keys: usize) -> usize {
        let a_key = if interpolation == Interpolation::CubicSpline { 3 } else { 1 };
        a_key * width * keys
    }

    /// The value at a time, `width` numbers; rotations have unit length.
    pub(crate) fn sample(&self, time: f32) -> Vec<f32> {
        let next = self.times.partition_point(|t| *t <= time);
        let last = self.times.len() - 1;
        let mut value = if next == 0 {
            self.value(0).to_vec()
        } else if next > last {
            self.value(last).to_vec()
        } else {
            self.between(next - 1, time)
        };
        if self.property == Property::Rotation {
            let unit = quat(&value).to_array();
            value.copy_from_slice(&unit);
        }
        value
    }

    fn between(&self, key: usize, time: f32) -> Vec<f32> {
        let (from, to) = (self.times[key], self.times[key + 1]);
        let span = to - from;
        let t = (time - from) / span;
        let (a, b) = (self.value(key), self.value(key + 1));
        match self.interpolation {
            Interpolation::Step => a.to_vec(),
            Interpolation::Linear if self.property == Property::Rotation => {
                quat(a).slerp(quat(b), t).to_array().to_vec()
            }
            Interpolation::Linear => a.iter().zip(b).map(|(a, b)| a + t * (b - a)).collect(),
            Interpolation::CubicSpline => {
                let (out, into) = (self.part(key, 2), self.part(key + 1, 0));
                let [h00, h10, h01, h11] = hermite(t);
                (0..self.width)
                    .map(|i| h00 * a[i] + span * h10 * out[i] + h01 * b[i] + span * h11 * into[i])
                    .collect()
            }
        }
    }

    fn value(&self, key: usize) -> &[f32] {
        match self.interpolation {
            Interpolation::CubicSpline => self.part(key, 1),
            _ => &self.values[key * self.width..][..self.width],
        }
    }

    /// In-tangent, value or out-tangent of a key of a cubic spline.
    fn part(&self, key: usize, part: usize) -> &[f32] {
        &self.values[(3 * key + part) * self.width..][..self.width]
    }
}

/// The cubic Hermite basis: start, start tangent, end, end tangent.
fn hermite(t: f32) -> [f32; 4] {
    let (t2, t3) = (t * t, t * t * t);
    [2.0 * t3 - 3.0 * t2 + 1.0, t3 - 2.0 * t2 + t, -2.0 * t3 + 3.0 * t2, t3 - t2]
}

fn quat(value: &[f32]) -> Quat {
    let v = Vec4::from_slice(value);
    v.try_normalize().map_or(Quat::IDENTITY, Quat::from_vec4)
}

/// Wraps a time into 0 to `duration` by repeating the animation, also for times before 0.
pub(crate) fn wrap(time: f64, duration: f64) -> f64 {
    if duration > 0.0 { time - (time / duration).floor() * duration } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    fn curve(property: Property, interpolation: Interpolation, values: &[&[f32]]) -> Curve {
        let width = values[0].len();
        let values = values.concat();
        let keys = values.len() / Curve::values_needed(interpolation, width, 1);
        let times = (0..keys).map(|k| 1.0 + 2.0 * k as f32).collect();
        Curve { property, interpolation, width, times, values }
    }

    #[test]
    fn step_holds_and_linear_interpolates() {
        let values: [&[f32]; 2] = [&[0.0, 10.0], &[4.0, 20.0]];
        let step = curve(Property::Weights, Interpolation::Step, &values);
        let linear = curve(Property::Weights, Interpolation::Linear, &values);
        for (time, stepped, straight) in [
            (-5.0, [0.0, 10.0], [0.0, 10.0]),
            (1.0, [0.0, 10.0], [0.0, 10.0]),
            (1.5, [0.0, 10.0], [1.0, 12.5]),
            (2.999, [0.0, 10.0], [3.998, 19.995]),
            (3.0, [4.0, 20.0], [4.0, 20.0]),
            (9.0, [4.0, 20.0], [4.0, 20.0]),
        ] {
            assert_eq!(step.sample(time), stepped);
            for (got, want) in linear.sample(time).iter().zip(straight) {
                assert!((got - want).abs() < 1e-5, "{time}: {got} {want}");
            }
        }
    }

    #[test]
    fn rotations_take_the_short_way_at_constant_speed() {
        let (a, b) = (Quat::IDENTITY, Quat::from_rotation_y(1.2));
        let keys = [a.to_array(), (-b).to_array()];
        let c = curve(Property::Rotation, Interpolation::Linear, &[&keys[0], &keys[1]]);
        for k in 0..=10 {
            let t = k as f32 / 10.0;
            let got = Quat::from_slice(&c.sample(1.0 + 2.0 * t));
            let want = Quat::from_rotation_y(1.2 * t);
            assert!(got.dot(want).abs() > 1.0 - 1e-6, "{t}: {got} {want}");
        }
    }

    /// A cubic polynomial is its own Hermite spline.
    #[test]
    fn cubic_splines_reproduce_cubics() {
        let f = |t: f32| Vec3::new(t * t * t - 2.0 * t, 3.0 - t * t, 5.0 * t);
        let slope = |t: f32| Vec3::new(3.0 * t * t - 2.0, -2.0 * t, 5.0);
        let parts: Vec<[f32; 3]> =
            [1.0, 3.0].iter().flat_map(|&t| [slope(t), f(t), slope(t)].map(Vec3::into)).collect();
        let parts: Vec<&[f32]> = parts.iter().map(|p| &p[..]).collect();
        let c = curve(Property::Translation, Interpolation::CubicSpline, &parts);
        for k in 0..=16 {
            let t = 1.0 + 2.0 * k as f32 / 16.0;
            let got = Vec3::from_slice(&c.sample(t));
            assert!((got - f(t)).length() < 1e-4, "{t}: {got} {}", f(t));
        }
    }

    #[test]
    fn cubic_rotations_have_unit_length() {
        let (q, zero) = (Quat::from_rotation_x(2.0).to_array(), [0.0; 4]);
        let one = Quat::IDENTITY.to_array();
        let parts: [&[f32]; 6] = [&zero, &one, &zero, &zero, &q, &zero];
        let c = curve(Property::Rotation, Interpolation::CubicSpline, &parts);
        for time in [1.0, 1.7, 2.0, 2.9, 3.0] {
            assert!((Quat::from_slice(&c.sample(time)).length() - 1.0).abs() < 1e-6);
        }
    }

    #[test]
    fn times_repeat() {
        assert_eq!(wrap(2.5, 2.0), 0.5);
        assert_eq!(wrap(-0.5, 2.0), 1.5);
        assert_eq!(wrap(7.0, 0.0), 0.0);
    }
}
