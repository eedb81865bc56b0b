//! Several volumes as one light field.

use glam::Vec3;

use crate::sh::{Sh, convolve};
use crate::zh::{self, Bands};
use crate::{Offset, Order, ProbeVolume};

/// The light of a scene: volumes, the finer ones laid over the coarser.
///
/// Where a volume ends, light passes smoothly into the next coarser one over the outermost half
/// cell, or into those that abut: on a shared face the mean of both counts. Beyond all volumes the
/// nearest one's border counts.
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

    /// Light at a world position on a surface with a world `normal` (zero in free space); `None`
    /// when there is no volume.
    pub fn sample(&self, position: Vec3, normal: Vec3) -> Option<Sh> {
        if self.volumes.is_empty() {
            return None;
        }
        // Of the lowest order; what is added raises it to its own.
        let mut light = Sh::dark(Order::L1);
        let mut add = |volume: &ProbeVolume, weight: f32| {
            if weight > 0.0 {
                light.add_scaled(&volume.sample(position, normal), weight);
            }
        };
        let mut left = 1.0;
        for volume in &self.volumes {
            let weight = left * volume.grid.weight(position);
            add(volume, weight);
            left -= weight;
            if left <= 0.0 {
                return Some(light);
            }
        }
        let reach: f32 = self.volumes.iter().map(|volume| volume.grid.reach(position)).sum();
        if reach > 0.0 {
            for volume in &self.volumes {
                add(volume, left * volume.grid.reach(position) / reach);
            }
        } else {
            add(self.nearest(position)?, left);
        }
        Some(light)
    }

    fn nearest(&self, position: Vec3) -> Option<&ProbeVolume> {
        let distance = |volume: &ProbeVolume| volume.grid.distance(position);
        self.volumes.iter().min_by(|a, b| distance(a).total_cmp(&distance(b)))
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
