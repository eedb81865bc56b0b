//! Several volumes as one light field.

use glam::Vec3;

use crate::sh::{Sh, convolve};
use crate::zh::{self, Bands};
use crate::{Offset, Order, ProbeVolume};

/// The light of a scene: volumes, the finer ones laid over the coarser.
///
/// Where a volume ends, light passes smoothly into the next coarser one over the outermost half
/// cell, or into those that abut: on a shared face the mean of both counts. Beyond all volumes the
/// nearest one's border counts. A surface's point counts where its light is read, half a cell in front
/// of it at least ([`ProbeVolume::place`]), so that a wall in a shared face parts them.
///
/// ```
/// use glam::{Quat, UVec3, Vec3};
/// use lumencast_light::{Grid, LightField, Order, ProbeVolume, VolumeId};
///
/// let grid = Grid {
///     center: Vec3::ZERO,
///     rotation: Quat::IDENTITY,
///     size: Vec3::splat(4.0),
///     resolution: UVec3::splat(2),
/// };
/// let mut volume = ProbeVolume::dark(VolumeId(0), grid, Order::L2);
/// for probe in 0..grid.probe_count() {
///     volume.probe_mut(probe)[0] = Vec3::splat(3.544_908); // radiance 1 from everywhere
/// }
/// let light = LightField::new(vec![volume]);
/// let irradiance = light.irradiance(Vec3::ZERO, Vec3::Y);
/// assert!((irradiance.x - std::f32::consts::PI).abs() < 1e-3);
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LightField {
    /// By size of cell, the smallest first.
    volumes: Vec<ProbeVolume>,
}

impl LightField {
    /// Of volumes in any order.
    pub fn new(mut volumes: Vec<ProbeVolume>) -> Self {
        volumes.sort_by(|a, b| cell_volume(a).total_cmp(&cell_volume(b)));
        Self { volumes }
    }

    /// The volumes, that with the smallest cells first.
    pub fn volumes(&self) -> &[ProbeVolume] {
        &self.volumes
    }

    /// The volumes, to give them other light.
    pub fn volumes_mut(&mut self) -> &mut [ProbeVolume] {
        &mut self.volumes
    }

    /// The volumes as they are.
    pub fn into_volumes(self) -> Vec<ProbeVolume> {
        self.volumes
    }

    /// All light convolved by a lobe, or through a window (see [`crate::zh`]).
    #[must_use]
    pub fn convolved(mut self, bands: &Bands) -> Self {
        for volume in &mut self.volumes {
            let probe = volume.order.coefficients();
            volume.coefficients.chunks_mut(probe).for_each(|probe| convolve(probe, bands));
        }
        self
    }

    /// The same light as someone wishes to see it: read at another offset than its volumes' own,
    /// and through a Hann window of this width in bands, where given.
    #[must_use]
    pub fn seen(self, offset: Option<Offset>, window: Option<f32>) -> Self {
        let light = offset.into_iter().fold(self, Self::read_at);
        window.map(zh::hann).iter().fold(light, Self::convolved)
    }

    /// The same light, all volumes of which are to be read at another offset than their own.
    #[must_use]
    pub fn read_at(mut self, offset: Offset) -> Self {
        self.volumes.iter_mut().for_each(|volume| volume.offset = offset);
        self
    }

    /// How much each volume counts for a point of a surface with a world `normal` (zero in free space):
    /// their numbers and shares above 0, together 1. None where there is no volume.
    pub fn shares(&self, position: Vec3, normal: Vec3) -> Vec<(usize, f32)> {
        let volumes = &self.volumes;
        let places: Vec<Vec3> = volumes.iter().map(|v| v.place(position, normal)).collect();
        let each = || volumes.iter().map(|v| &v.grid).zip(&places);
        let mut unclaimed = 1.0;
        let mut shares: Vec<f32> = each()
            .map(|(grid, place)| {
                let claimed = unclaimed * grid.weight(*place);
                unclaimed -= claimed;
                claimed
            })
            .collect();
        if unclaimed > 0.0 {
            let reaches: Vec<f32> = each().map(|(grid, place)| grid.reach(*place)).collect();
            let all: f32 = reaches.iter().sum();
            let distances = each().map(|(grid, place)| grid.beyond(*place)).enumerate();
            if all > 0.0 {
                shares
                    .iter_mut()
                    .zip(&reaches)
                    .for_each(|(s, reach)| *s += unclaimed * reach / all);
            } else if let Some((nearest, _)) = distances.min_by(|a, b| a.1.total_cmp(&b.1)) {
                shares[nearest] += unclaimed;
            }
        }
        shares.into_iter().enumerate().filter(|(_, share)| *share > 0.0).collect()
    }

    /// Light at a world position on a surface with a world `normal` (zero in free space); `None`
    /// when there is no volume.
    pub fn sample(&self, position: Vec3, normal: Vec3) -> Option<Sh> {
        if let [only] = &self.volumes[..] {
            return Some(only.sample(position, normal));
        }
        // Of the lowest order; what is added raises it to its own.
        let dark = (!self.volumes.is_empty()).then(|| Sh::dark(Order::L1));
        self.shares(position, normal).into_iter().fold(dark, |light, (volume, share)| {
            let mut light = light?;
            light.add_scaled(&self.volumes[volume].sample(position, normal), share);
            Some(light)
        })
    }

    /// Irradiance on a surface, lux; black when there is no volume.
    pub fn irradiance(&self, position: Vec3, normal: Vec3) -> Vec3 {
        self.sample(position, normal).map_or(Vec3::ZERO, |light| light.irradiance(normal))
    }
}

fn cell_volume(volume: &ProbeVolume) -> f32 {
    volume.grid.spacing().element_product()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Grid, Order, VolumeId};
    use glam::{Quat, UVec3};

    fn uniform(id: u32, center: Vec3, size: f32, cells: u32, value: f32) -> ProbeVolume {
        let grid = Grid {
            center,
            rotation: Quat::IDENTITY,
            size: Vec3::splat(size),
            resolution: UVec3::splat(cells),
        };
        let mut volume = ProbeVolume::dark(VolumeId(id), grid, Order::L1);
        for probe in 0..grid.probe_count() {
            volume.probe_mut(probe)[0] = Vec3::splat(value);
        }
        volume
    }

    fn read(field: &LightField, x: f32) -> f32 {
        read_at(field, Vec3::X * x)
    }

    fn read_at(field: &LightField, position: Vec3) -> f32 {
        field.sample(position, Vec3::ZERO).unwrap().coefficients[0].x
    }

    #[test]
    fn every_probe_is_convolved() {
        let mut field = LightField::new(vec![uniform(0, Vec3::ZERO, 4.0, 2, 1.0)]);
        field.volumes_mut()[0].coefficients.iter_mut().for_each(|c| *c = Vec3::ONE);
        let field = field.convolved(&[3.0, 0.5, 9.0, 9.0, 9.0]);
        for probe in 0..8 {
            let [c0, rest @ ..] = field.volumes()[0].probe(probe) else { unreachable!() };
            assert_eq!((*c0, rest), (Vec3::splat(3.0), &[Vec3::splat(0.5); 3][..]));
        }
    }

    #[test]
    fn finer_volumes_lie_over_coarser_ones_and_pass_smoothly() {
        let field = LightField::new(vec![
            uniform(0, Vec3::ZERO, 20.0, 5, 1.0),
            uniform(1, Vec3::ZERO, 4.0, 4, 2.0),
        ]);
        assert_eq!(field.volumes()[0].id, VolumeId(1));
        assert_eq!(read(&field, 0.0), 2.0);
        assert_eq!(read(&field, 1.5), 2.0);
        assert_eq!(read(&field, 1.75), 1.5);
        assert_eq!(read(&field, 2.0), 1.0);
        let steps: Vec<f32> = (0..=400).map(|i| read(&field, i as f32 * 0.01)).collect();
        assert!(steps.windows(2).all(|pair| pair[1] <= pair[0] + 1e-6 && pair[0] - pair[1] < 0.04));
    }

    /// The halves of a room, cut into cells alike and not.
    #[test]
    fn light_passes_smoothly_through_a_shared_face() {
        for cells in [4, 2] {
            let field = LightField::new(vec![
                uniform(0, Vec3::X * -2.0, 4.0, 4, 1.0),
                uniform(1, Vec3::X * 2.0, 4.0, cells, 2.0),
            ]);
            // Amid the face, along its edge, outside above both, and beyond the reach of either.
            for (y, steepest) in [(0.0, 0.04), (1.9, 0.04), (2.2, 0.04), (4.0, 1.0)] {
                let at = |x: f32| read_at(&field, Vec3::new(x, y, 0.0));
                let values: Vec<f32> = (-300..=300).map(|i| at(i as f32 * 0.01)).collect();
                assert!((values[0] - 1.0).abs() < 1e-6 && (values[600] - 2.0).abs() < 1e-6);
                let steps = || values.windows(2).map(|pair| pair[1] - pair[0]);
                assert!(steps().all(|step| step >= -1e-6), "{cells} {y}");
                let worst = steps().fold(0.0, f32::max);
                assert!(worst <= steepest, "{cells} {y}: {worst}");
            }
            assert!((read(&field, 0.0) - 1.5).abs() < 1e-6, "the mean on the face");
        }
    }

    /// The sides of a wall belong to the volumes that they face, however near to the face it stands, and
    /// wherever light is read.
    #[test]
    fn a_wall_in_a_shared_face_parts_the_volumes() {
        let field = LightField::new(vec![
            uniform(0, Vec3::X * -2.0, 4.0, 4, 1.0),
            uniform(1, Vec3::X * 2.0, 4.0, 4, 2.0),
        ]);
        for offset in [Offset::NONE, Offset::Cells(0.125), Offset::HALF_CELL, Offset::Metres(0.2)] {
            let field = field.clone().read_at(offset);
            for (x, normal, own) in [(-0.1, Vec3::NEG_X, 1.0), (0.1, Vec3::X, 2.0)] {
                for x in [x, 0.0, 0.5 * x] {
                    let light = field.sample(Vec3::X * x, normal).unwrap();
                    assert!((light.coefficients[0].x - own).abs() < 1e-6, "{offset:?} {x}");
                }
                // What crosses the wall still passes smoothly.
                let floor = field.sample(Vec3::ZERO, Vec3::Y).unwrap();
                assert_eq!(floor.coefficients[0].x, 1.5);
            }
        }
    }

    #[test]
    fn shares_add_up_to_one() {
        let field = LightField::new(vec![
            uniform(0, Vec3::X * -2.0, 4.0, 4, 1.0),
            uniform(1, Vec3::X * 2.0, 4.0, 2, 2.0),
            uniform(2, Vec3::ZERO, 20.0, 5, 3.0),
        ]);
        for x in -120..=120 {
            for normal in [Vec3::ZERO, Vec3::X, Vec3::new(-0.6, 0.8, 0.0)] {
                let shares = field.shares(Vec3::new(x as f32 * 0.1, 1.9, 0.0), normal);
                let sum: f32 = shares.iter().map(|(_, share)| share).sum();
                assert!((sum - 1.0).abs() < 1e-6, "{x}: {shares:?}");
            }
        }
    }

    #[test]
    fn beyond_all_volumes_the_nearest_counts() {
        let field = LightField::new(vec![
            uniform(0, Vec3::X * -10.0, 4.0, 2, 1.0),
            uniform(1, Vec3::X * 10.0, 4.0, 2, 2.0),
        ]);
        assert_eq!(read(&field, -12.5), 1.0);
        assert_eq!(read(&field, -3.0), 1.0);
        assert_eq!(read(&field, 3.0), 2.0);
        assert_eq!(LightField::default().sample(Vec3::ZERO, Vec3::Y), None);
    }
}
