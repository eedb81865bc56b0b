//! All that is known of a scene's light.

use std::f32::consts::PI;

use glam::Vec3;

use crate::sh::{Sh, convolve};
use crate::zh::{self, Bands};
use crate::{Field, FieldId, Lightmap, Offset, Order, Place, ProbeVolume};

/// The exponent of a display's codes.
const GAMMA: f32 = 2.2;

/// The light of a scene: fields, of which the finer volumes are laid over the coarser, and lightmaps
/// over all of them.
///
/// Where a surface has lumels, its irradiance is theirs alone. All other light is that of volumes. A
/// surface that passes from one to the other does so by even steps of a display's codes
/// ([`Layout::share`](crate::Layout::share)).
///
/// Where a volume ends, light passes smoothly into the next coarser one over the outermost half
/// cell, or into those that abut: on a shared face the mean of both counts. Beyond all volumes the
/// nearest one's border counts. A surface's point counts where its light is read, half a cell in front
/// of it at least ([`ProbeVolume::counted_at`]), so that a wall in a shared face parts them.
///
/// ```
/// use glam::{Quat, UVec3, Vec3};
/// use lumencast_light::{FieldId, Grid, Light, Order, ProbeVolume};
///
/// let grid = Grid {
///     center: Vec3::ZERO,
///     rotation: Quat::IDENTITY,
///     size: Vec3::splat(4.0),
///     resolution: UVec3::splat(2),
/// };
/// let mut volume = ProbeVolume::dark(FieldId(0), grid, Order::L2);
/// for probe in 0..grid.probe_count() {
///     volume.probe_mut(probe)[0] = Vec3::splat(3.544_908); // radiance 1 from everywhere
/// }
/// let light = Light::new([volume]);
/// let irradiance = light.irradiance(Vec3::ZERO, Vec3::Y);
/// assert!((irradiance.x - std::f32::consts::PI).abs() < 1e-3);
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Light {
    /// Volumes first, by size of cell, the smallest first; then lightmaps.
    fields: Vec<Field>,
}

impl Light {
    /// Light of fields, which may stand in any order.
    pub fn new(fields: impl IntoIterator<Item = impl Into<Field>>) -> Self {
        let mut fields: Vec<Field> = fields.into_iter().map(Into::into).collect();
        fields.sort_by(|a, b| cell_volume(a).total_cmp(&cell_volume(b)));
        Self { fields }
    }

    /// The fields, the volume with the smallest cells first.
    pub fn fields(&self) -> &[Field] {
        &self.fields
    }

    /// The fields, to give them other light.
    pub fn fields_mut(&mut self) -> &mut [Field] {
        &mut self.fields
    }

    /// The field of a number.
    pub fn field(&self, id: FieldId) -> Option<&Field> {
        self.fields.iter().find(|field| field.id() == id)
    }

    /// The fields as they are.
    pub fn into_fields(self) -> Vec<Field> {
        self.fields
    }

    /// Number of the probes of all fields.
    pub fn probe_count(&self) -> usize {
        self.fields.iter().map(Field::probe_count).sum()
    }

    /// The lightmaps.
    pub fn lightmaps(&self) -> impl Iterator<Item = &Lightmap> {
        self.fields.iter().filter_map(Field::as_lightmap)
    }

    /// The volumes, that with the smallest cells first.
    pub fn volumes(&self) -> impl Iterator<Item = &ProbeVolume> {
        self.fields.iter().filter_map(Field::as_volume)
    }

    /// The volumes, to give them other light.
    pub fn volumes_mut(&mut self) -> impl Iterator<Item = &mut ProbeVolume> {
        self.fields.iter_mut().filter_map(Field::as_volume_mut)
    }

    /// All light of volumes convolved by a lobe, or through a window (see [`crate::zh`]).
    #[must_use]
    pub fn convolved(mut self, bands: &Bands) -> Self {
        for volume in self.volumes_mut() {
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
        self.volumes_mut().for_each(|volume| volume.offset = offset);
        self
    }

    /// How much each volume counts at a place: their numbers in the order of [`Self::volumes`] and
    /// shares above 0, together 1. None where there is no volume.
    pub fn shares(&self, place: &Place) -> Vec<(usize, f32)> {
        let counted_at = |v: &ProbeVolume| v.counted_at(place.position, place.normal);
        let places: Vec<Vec3> = self.volumes().map(counted_at).collect();
        let each = || self.volumes().map(|v| &v.grid).zip(&places);
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

    /// The volumes' light at a place; `None` where there is no volume.
    pub fn sample(&self, place: &Place) -> Option<Sh> {
        if let [Field::Volume(only)] = &self.fields[..] {
            return Some(only.sample(place.position, place.normal));
        }
        // It begins with the lowest order; what is added raises it to its own.
        let dark = self.volumes().next().map(|_| Sh::dark(Order::L1));
        self.shares(place).into_iter().fold(dark, |light, (volume, share)| {
            let mut light = light?;
            let volume = self.volumes().nth(volume)?;
            light.add_scaled(&volume.sample(place.position, place.normal), share);
            Some(light)
        })
    }

    /// The lumels' irradiance at a place, lux, and how far the place has come from probes to them, 0 to 1;
    /// `None` where it has none.
    pub fn at_lumels(&self, place: &Place) -> Option<(Vec3, f32)> {
        let on = place.on.as_ref()?;
        self.lightmaps().find_map(|lightmap| {
            Some((lightmap.irradiance_at(on)?, lightmap.layout.share(on.surface)))
        })
    }

    /// Radiance that arrives at a place from a direction, cd/m²; `None` where nothing is known. Lumels
    /// know irradiance alone, which counts as arriving evenly.
    pub fn radiance(&self, place: &Place, direction: Vec3) -> Option<Vec3> {
        let of_probes = || Some(self.sample(place)?.radiance(direction));
        mixed(self.at_lumels(place).map(|(irradiance, share)| (irradiance / PI, share)), of_probes)
    }

    /// Irradiance at a place of a surface, lux; black where there is no light.
    pub fn irradiance_at(&self, place: &Place) -> Vec3 {
        let of_probes = || Some(self.sample(place)?.irradiance(place.normal));
        mixed(self.at_lumels(place), of_probes).unwrap_or(Vec3::ZERO)
    }

    /// The volumes' irradiance on a surface at a world position with a world normal, lux; black where
    /// there is no light.
    pub fn irradiance(&self, position: Vec3, normal: Vec3) -> Vec3 {
        self.irradiance_at(&Place::on_surface(position, normal))
    }
}

/// Light of probes, of lumels, or on the way from one to the other.
fn mixed(lumels: Option<(Vec3, f32)>, probes: impl FnOnce() -> Option<Vec3>) -> Option<Vec3> {
    match lumels {
        None => probes(),
        Some((light, share)) if share >= 1.0 => Some(light),
        Some((light, share)) => {
            Some(probes().map_or(light, |probes| between(probes, light, share)))
        }
    }
}

/// Light on the way from one to another: its codes on a display of gamma 2.2 change evenly.
fn between(from: Vec3, to: Vec3, way: f32) -> Vec3 {
    let code = |light: Vec3| light.max(Vec3::ZERO).powf(GAMMA.recip());
    code(from).lerp(code(to), way).powf(GAMMA)
}

/// The size of a volume's cells, cubic metres: finer volumes lie over coarser ones. Other kinds come
/// after all volumes.
fn cell_volume(field: &Field) -> f32 {
    match field {
        Field::Volume(volume) => volume.grid.spacing().element_product(),
        Field::Lightmap(_) => f32::INFINITY,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ChartVertex, Charts, Grid, Layout, OnTriangle, Rectangle, Surface, SurfaceId};
    use glam::{Quat, UVec2, UVec3, Vec2};
    use std::sync::Arc;

    fn uniform(id: u32, center: Vec3, size: f32, cells: u32, value: f32) -> ProbeVolume {
        let grid = Grid {
            center,
            rotation: Quat::IDENTITY,
            size: Vec3::splat(size),
            resolution: UVec3::splat(cells),
        };
        let mut volume = ProbeVolume::dark(FieldId(id), grid, Order::L1);
        for probe in 0..grid.probe_count() {
            volume.probe_mut(probe)[0] = Vec3::splat(value);
        }
        volume
    }

    fn read(light: &Light, x: f32) -> f32 {
        read_at(light, Vec3::X * x)
    }

    fn read_at(light: &Light, position: Vec3) -> f32 {
        light.sample(&Place::in_space(position)).unwrap().coefficients[0].x
    }

    #[test]
    fn every_probe_is_convolved() {
        let mut light = Light::new(vec![uniform(0, Vec3::ZERO, 4.0, 2, 1.0)]);
        light.volumes_mut().next().unwrap().coefficients.iter_mut().for_each(|c| *c = Vec3::ONE);
        let light = light.convolved(&[3.0, 0.5, 9.0, 9.0, 9.0]);
        let volume = light.volumes().next().unwrap();
        for probe in 0..8 {
            let [c0, rest @ ..] = volume.probe(probe) else { unreachable!() };
            assert_eq!((*c0, rest), (Vec3::splat(3.0), &[Vec3::splat(0.5); 3][..]));
        }
    }

    #[test]
    fn finer_volumes_lie_over_coarser_ones_and_pass_smoothly() {
        let light = Light::new(vec![
            uniform(0, Vec3::ZERO, 20.0, 5, 1.0),
            uniform(1, Vec3::ZERO, 4.0, 4, 2.0),
        ]);
        assert_eq!(light.volumes().next().unwrap().id, FieldId(1));
        assert_eq!(read(&light, 0.0), 2.0);
        assert_eq!(read(&light, 1.5), 2.0);
        assert_eq!(read(&light, 1.75), 1.5);
        assert_eq!(read(&light, 2.0), 1.0);
        let steps: Vec<f32> = (0..=400).map(|i| read(&light, i as f32 * 0.01)).collect();
        assert!(steps.windows(2).all(|pair| pair[1] <= pair[0] + 1e-6 && pair[0] - pair[1] < 0.04));
    }

    /// The halves of a room, cut into cells alike and not.
    #[test]
    fn light_passes_smoothly_through_a_shared_face() {
        for cells in [4, 2] {
            let light = Light::new(vec![
                uniform(0, Vec3::X * -2.0, 4.0, 4, 1.0),
                uniform(1, Vec3::X * 2.0, 4.0, cells, 2.0),
            ]);
            // Amid the face, along its edge, outside above both, and beyond the reach of either.
            for (y, steepest) in [(0.0, 0.04), (1.9, 0.04), (2.2, 0.04), (4.0, 1.0)] {
                let at = |x: f32| read_at(&light, Vec3::new(x, y, 0.0));
                let values: Vec<f32> = (-300..=300).map(|i| at(i as f32 * 0.01)).collect();
                assert!((values[0] - 1.0).abs() < 1e-6 && (values[600] - 2.0).abs() < 1e-6);
                let steps = || values.windows(2).map(|pair| pair[1] - pair[0]);
                assert!(steps().all(|step| step >= -1e-6), "{cells} {y}");
                let worst = steps().fold(0.0, f32::max);
                assert!(worst <= steepest, "{cells} {y}: {worst}");
            }
            assert!((read(&light, 0.0) - 1.5).abs() < 1e-6, "the mean on the face");
        }
    }

    /// The sides of a wall belong to the volumes that they face, however near to the face it stands, and
    /// wherever light is read.
    #[test]
    fn a_wall_in_a_shared_face_parts_the_volumes() {
        let light = Light::new(vec![
            uniform(0, Vec3::X * -2.0, 4.0, 4, 1.0),
            uniform(1, Vec3::X * 2.0, 4.0, 4, 2.0),
        ]);
        for offset in [Offset::NONE, Offset::Cells(0.125), Offset::HALF_CELL, Offset::Metres(0.2)] {
            let light = light.clone().read_at(offset);
            for (x, normal, own) in [(-0.1, Vec3::NEG_X, 1.0), (0.1, Vec3::X, 2.0)] {
                for x in [x, 0.0, 0.5 * x] {
                    let light = light.sample(&Place::on_surface(Vec3::X * x, normal)).unwrap();
                    assert!((light.coefficients[0].x - own).abs() < 1e-6, "{offset:?} {x}");
                }
                // What crosses the wall still passes smoothly.
                let floor = light.sample(&Place::on_surface(Vec3::ZERO, Vec3::Y)).unwrap();
                assert_eq!(floor.coefficients[0].x, 1.5);
            }
        }
    }

    #[test]
    fn shares_add_up_to_one() {
        let light = Light::new(vec![
            uniform(0, Vec3::X * -2.0, 4.0, 4, 1.0),
            uniform(1, Vec3::X * 2.0, 4.0, 2, 2.0),
            uniform(2, Vec3::ZERO, 20.0, 5, 3.0),
        ]);
        for x in -120..=120 {
            for normal in [Vec3::ZERO, Vec3::X, Vec3::new(-0.6, 0.8, 0.0)] {
                let shares =
                    light.shares(&Place::on_surface(Vec3::new(x as f32 * 0.1, 1.9, 0.0), normal));
                let sum: f32 = shares.iter().map(|(_, share)| share).sum();
                assert!((sum - 1.0).abs() < 1e-6, "{x}: {shares:?}");
            }
        }
    }

    /// Lumels count before volumes where the place has some, and nowhere else.
    #[test]
    fn lumels_lie_over_volumes() {
        let surface = SurfaceId { node: 3, ..SurfaceId::default() };
        let at = |x: f32, y: f32| ChartVertex { source: 0, rectangle: 0, at: Vec2::new(x, y) };
        let charts = Charts {
            sizes: vec![UVec2::splat(4)],
            vertices: vec![at(1.0, 1.0), at(3.0, 1.0), at(1.0, 3.0)],
            triangles: vec![[0, 1, 2]],
        };
        let rectangles = vec![Rectangle::default()];
        let of = Surface { id: surface, charts: Arc::new(charts), rectangles };
        let mut lumels = Lightmap::dark(FieldId(1), Arc::new(Layout::new(4, 1, vec![of])));
        lumels.irradiance.fill(Vec3::splat(6.0));
        let volume = uniform(0, Vec3::ZERO, 4.0, 2, 1.0 / 0.282_094_8);
        let light = Light::new([Field::from(lumels), volume.into()]);
        assert!(light.fields()[0].as_volume().is_some(), "volumes first");
        let point = OnTriangle { surface, triangle: 0, weights: Vec3::splat(1.0 / 3.0) };
        let place = Place { on: Some(point), ..Place::on_surface(Vec3::ZERO, Vec3::Y) };
        assert_eq!(light.irradiance_at(&place), Vec3::splat(6.0));
        let radiance = light.radiance(&place, Vec3::X).unwrap();
        assert!(radiance.abs_diff_eq(Vec3::splat(6.0 / PI), 1e-5));
        let back = OnTriangle { surface: SurfaceId { back: true, ..surface }, ..point };
        let behind = Place { on: Some(back), ..place };
        assert!((light.irradiance_at(&behind).x - PI).abs() < 1e-3, "the volume's");
        assert!((light.radiance(&behind, Vec3::X).unwrap().x - 1.0).abs() < 1e-3);
        let passing = light.lightmaps().next().unwrap();
        let layout = Layout::clone(&passing.layout).with_shares([(surface, 0.25)].into());
        let passing = Lightmap { layout: Arc::new(layout), ..passing.clone() };
        let passing = Light::new([Field::from(passing), light.fields()[0].clone()]);
        let code = |light: f32| light.powf(1.0 / 2.2);
        let right = (0.75 * code(PI) + 0.25 * code(6.0)).powf(2.2);
        assert!((passing.irradiance_at(&place).x - right).abs() < 1e-3, "a quarter of the way");
        let dark = Light::new(light.lightmaps().cloned());
        assert_eq!(dark.radiance(&behind, Vec3::X), None);
        assert_eq!(dark.irradiance_at(&behind), Vec3::ZERO);
    }

    #[test]
    fn beyond_all_volumes_the_nearest_counts() {
        let light = Light::new(vec![
            uniform(0, Vec3::X * -10.0, 4.0, 2, 1.0),
            uniform(1, Vec3::X * 10.0, 4.0, 2, 2.0),
        ]);
        assert_eq!(read(&light, -12.5), 1.0);
        assert_eq!(read(&light, -3.0), 1.0);
        assert_eq!(read(&light, 3.0), 2.0);
        assert_eq!(Light::default().sample(&Place::default()), None);
    }
}
