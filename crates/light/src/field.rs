//! Several volumes as one light field.

use glam::Vec3;

use crate::{OffsetPolicy, ProbeVolume, sh::Sh};

/// The light of a scene: volumes, the finer ones laid over the coarser.
///
/// Where a volume ends, light passes smoothly into the next coarser one over the outermost half
/// cell. Beyond all volumes the nearest one's border counts.
///
/// ```
/// use glam::{Quat, UVec3, Vec3};
/// use lumencast_light::{Grid, LightField, OffsetPolicy, Order, ProbeVolume, VolumeId};
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
/// let irradiance = light.irradiance(Vec3::ZERO, Vec3::Y, OffsetPolicy::HalfCell);
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

    /// Light at a world position on a surface with a world `normal` (zero in free space); `None`
    /// when there is no volume.
    pub fn sample(&self, position: Vec3, normal: Vec3, offset: OffsetPolicy) -> Option<Sh> {
        let nearest = self
            .volumes
            .iter()
            .min_by(|a, b| a.grid.distance(position).total_cmp(&b.grid.distance(position)))?;
        let mut light = Sh::dark(nearest.order);
        let mut left = 1.0;
        for volume in &self.volumes {
            let weight = left * volume.grid.weight(position);
            if weight > 0.0 {
                light.add_scaled(&volume.sample(position, normal, offset), weight);
                left -= weight;
            }
            if left <= 0.0 {
                return Some(light);
            }
        }
        light.add_scaled(&nearest.sample(position, normal, offset), left);
        Some(light)
    }

    /// Irradiance on a surface, lux; black when there is no volume.
    pub fn irradiance(&self, position: Vec3, normal: Vec3, offset: OffsetPolicy) -> Vec3 {
        self.sample(position, normal, offset).map_or(Vec3::ZERO, |light| light.irradiance(normal))
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
        field.sample(Vec3::new(x, 0.0, 0.0), Vec3::ZERO, OffsetPolicy::None).unwrap().coefficients
            [0]
        .x
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

    #[test]
    fn beyond_all_volumes_the_nearest_counts() {
        let field = LightField::new(vec![
            uniform(0, Vec3::X * -10.0, 4.0, 2, 1.0),
            uniform(1, Vec3::X * 10.0, 4.0, 2, 2.0),
        ]);
        assert_eq!(read(&field, -12.5), 1.0);
        assert_eq!(read(&field, -3.0), 1.0);
        assert_eq!(read(&field, 3.0), 2.0);
        assert_eq!(LightField::default().sample(Vec3::ZERO, Vec3::Y, OffsetPolicy::None), None);
    }
}
