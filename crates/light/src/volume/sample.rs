//! Reading light at a point.

use glam::{UVec3, Vec3};

use super::ProbeVolume;
use crate::sh::Sh;

/// The probes that light at a point is read from: trilinear between the eight about it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Corners {
    /// Indices of the probes; at the border one may stand here more than once.
    pub probes: [usize; 8],
    /// What each of them counts; together 1.
    pub shares: [f32; 8],
}

impl ProbeVolume {
    /// Where a point of a surface counts as lying when volumes share it, in cells: moved along its
    /// world `normal` (zero in free space) as far as light is read, and half a cell at least. So the two
    /// sides of a wall in which volumes meet belong to the volumes that they face.
    pub fn counted_at(&self, position: Vec3, normal: Vec3) -> Vec3 {
        self.moved(position, normal, self.offset.in_cells(&self.grid).max(Vec3::splat(0.5)))
    }

    /// A world position in cells, moved by so many of them along a world normal.
    fn moved(&self, position: Vec3, normal: Vec3, cells: Vec3) -> Vec3 {
        let out = self.grid.rotation.inverse() * normal.normalize_or_zero();
        self.grid.cell_from_world(position) + cells * out
    }

    /// Where light is read for a point of a surface with a world `normal` (zero in free space).
    /// Points that are not finite read the first probe.
    pub fn corners(&self, position: Vec3, normal: Vec3) -> Corners {
        let grid = &self.grid;
        let cell = self.moved(position, normal, self.offset.in_cells(grid));
        let last = (grid.resolution - 1).as_vec3();
        let clamped = if cell.is_finite() { cell.clamp(Vec3::ZERO, last) } else { Vec3::ZERO };
        let low = clamped.floor();
        let t = clamped - low;
        let (low, high) = (low.as_uvec3(), (low + 1.0).min(last).as_uvec3());
        let far = |corner: usize, axis: usize| corner >> axis & 1 != 0;
        let pick = |corner, axis: usize| if far(corner, axis) { high[axis] } else { low[axis] };
        let share = |corner, axis: usize| if far(corner, axis) { t[axis] } else { 1.0 - t[axis] };
        Corners {
            probes: std::array::from_fn(|c| {
                grid.index(UVec3::new(pick(c, 0), pick(c, 1), pick(c, 2)))
            }),
            shares: std::array::from_fn(|c| share(c, 0) * share(c, 1) * share(c, 2)),
        }
    }

    /// Light at a world position on a surface with a world `normal` (zero in free space), read as
    /// [`Self::corners`] says.
    pub fn sample(&self, position: Vec3, normal: Vec3) -> Sh {
        let Corners { probes, shares, .. } = self.corners(position, normal);
        let mut light = Sh::dark(self.order);
        for (probe, share) in probes.into_iter().zip(shares).filter(|(_, share)| *share > 0.0) {
            for (sum, c) in light.coefficients.iter_mut().zip(self.probe(probe)) {
                *sum += *c * share;
            }
        }
        light
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{FieldId, Grid, Offset, Order};
    use glam::Quat;

    /// A volume whose c0 is an affine function of world position, which trilinear sampling keeps.
    fn affine(rotation: Quat) -> ProbeVolume {
        let grid = Grid {
            center: Vec3::new(1.0, 2.0, 3.0),
            rotation,
            size: Vec3::new(4.0, 2.0, 6.0),
            resolution: UVec3::new(4, 3, 5),
        };
        let mut volume = ProbeVolume::dark(FieldId(0), grid, Order::L1);
        for i in 0..grid.probe_count() {
            volume.probe_mut(i)[0] = value(grid.position(grid.cell(i)));
        }
        volume
    }

    fn value(position: Vec3) -> Vec3 {
        Vec3::new(position.x - 2.0 * position.y, position.z, 1.0)
    }

    #[test]
    fn probes_and_the_space_between_read_as_they_are() {
        for rotation in [Quat::IDENTITY, Quat::from_xyzw(0.1, 0.5, -0.3, 0.8).normalize()] {
            let volume = affine(rotation);
            for i in 0..volume.grid.probe_count() {
                let position = volume.grid.position(volume.grid.cell(i));
                let sampled = volume.sample(position, Vec3::ZERO);
                assert!((sampled.coefficients[0] - volume.probe(i)[0]).length() < 1e-4);
            }
            let between = volume.grid.center + rotation * Vec3::new(0.7, -0.3, 1.1);
            let sampled = volume.sample(between, Vec3::ZERO);
            assert!((sampled.coefficients[0] - value(between)).length() < 1e-4);
        }
    }

    #[test]
    fn beyond_the_outermost_probes_light_stays() {
        let volume = affine(Quat::IDENTITY);
        let last = volume.grid.resolution - 1;
        let far = volume.grid.position(last) + Vec3::splat(100.0);
        let sampled = volume.sample(far, Vec3::ZERO);
        assert_eq!(sampled.coefficients[0], volume.probe(volume.grid.index(last))[0]);
        let nowhere = volume.sample(Vec3::NAN, Vec3::ZERO);
        assert_eq!(nowhere.coefficients[0], volume.probe(0)[0]);
    }

    #[test]
    fn offsets_move_along_the_normal() {
        for rotation in [Quat::IDENTITY, Quat::from_rotation_y(0.8)] {
            let volume = affine(rotation);
            let spacing = volume.grid.spacing();
            let position = volume.grid.center;
            let normal = rotation * Vec3::new(0.6, 0.8, 0.0);
            let read =
                |offset| volume.clone().read_at(offset).sample(position, normal).coefficients[0];
            let half = position + rotation * (0.5 * spacing * Vec3::new(0.6, 0.8, 0.0));
            assert!((read(Offset::HALF_CELL) - value(half)).length() < 1e-4);
            assert!((read(Offset::Metres(0.25)) - value(position + 0.25 * normal)).length() < 1e-4);
            assert!((read(Offset::NONE) - value(position)).length() < 1e-4);
        }
    }

    #[test]
    fn a_volume_of_one_probe_reads_everywhere() {
        let grid = Grid {
            center: Vec3::ZERO,
            rotation: Quat::IDENTITY,
            size: Vec3::ONE,
            resolution: UVec3::ONE,
        };
        let mut volume = ProbeVolume::dark(FieldId(0), grid, Order::L1);
        volume.probe_mut(0)[0] = Vec3::ONE;
        for position in [Vec3::ZERO, Vec3::splat(7.0), Vec3::splat(-0.2)] {
            assert_eq!(volume.sample(position, Vec3::Y).coefficients[0], Vec3::ONE);
        }
        assert_eq!(grid.weight(Vec3::ZERO), 1.0);
        assert_eq!(grid.weight(Vec3::X * 0.25), 0.5);
        assert_eq!(grid.weight(Vec3::X * 0.5), 0.0);
        assert_eq!(grid.reach(Vec3::X * 0.5), 1.0);
        assert_eq!(grid.reach(Vec3::new(0.75, -0.75, 0.2)), 0.25);
        assert_eq!(grid.reach(Vec3::X), 0.0);
    }
}
