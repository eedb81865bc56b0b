//! Which tracks are read, and which go first on a link too slow for all.

use glam::Vec3;
use lumencast_codec::{Catalog, Field, Region};
use lumencast_light::Grid;

/// Priorities of the tracks that are always read (docs/wire.md).
pub(crate) const CATALOG_PRIORITY: u8 = 255;
pub(crate) const STATE_PRIORITY: u8 = 254;
/// The highest of light.
const LIGHT_PRIORITY: u8 = 250;
/// Regions of different priority in each layer; those farther away share the last.
const RANKS: usize = 80;

/// A track of light.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct LightTrack {
    pub(crate) field: u32,
    pub(crate) region: u32,
    pub(crate) layer: u8,
}

impl LightTrack {
    pub(crate) fn name(&self) -> String {
        format!("f{}/r{}/l{}", self.field, self.region, self.layer)
    }
}

/// The tracks of a catalog with their priorities: layer 0 of all regions before layer 1 of any, since
/// light that is seldom renewed beats light that is not; within a layer near regions before far ones.
pub(crate) fn plan(catalog: &Catalog, eye: Option<Vec3>) -> Vec<(LightTrack, u8)> {
    let mut regions: Vec<(f32, &Field, &Region)> = catalog
        .fields
        .iter()
        .flat_map(|field| field.regions.iter().map(move |region| (field, region)))
        .map(|(field, region)| {
            let distance = eye.map_or(0.0, |eye| part(&field.grid, region).distance(eye));
            (distance, field, region)
        })
        .collect();
    regions.sort_by(|a, b| a.0.total_cmp(&b.0));
    let of_layer = |layer: u8| {
        regions.iter().enumerate().filter_map(move |(rank, (_, field, region))| {
            let below = RANKS * usize::from(layer) + rank.min(RANKS - 1);
            let track = LightTrack { field: field.id, region: region.id, layer };
            (layer < field.layers).then_some((track, LIGHT_PRIORITY - below as u8))
        })
    };
    (0..3).flat_map(of_layer).collect()
}

/// The box of a region.
fn part(grid: &Grid, region: &Region) -> Grid {
    let cell = grid.size / grid.resolution.as_vec3();
    let size = region.size.as_vec3() * cell;
    let from_corner = region.min.as_vec3() * cell + 0.5 * size;
    let center = grid.center + grid.rotation * (from_corner - 0.5 * grid.size);
    Grid { center, size, resolution: region.size, ..*grid }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{Quat, UVec3};
    use lumencast_codec::{Epoch, ProbeEncoder, SceneInfo, Use};
    use lumencast_light::Order;

    fn catalog(resolution: UVec3) -> Catalog {
        let grid = Grid {
            center: Vec3::new(5.0, 0.0, 0.0),
            rotation: Quat::from_rotation_y(0.5),
            size: resolution.as_vec3(),
            resolution,
        };
        let field = Field {
            id: 3,
            order: Order::L1,
            usage: Use::All,
            grid,
            offset: lumencast_light::Offset::default(),
            cells_min: glam::IVec3::ZERO,
            regions: ProbeEncoder::new(resolution, Order::L1).regions().collect(),
            layers: 3,
            scale_log2: None,
            source: String::new(),
            epoch: None,
        };
        let scene = SceneInfo { name: "room".into(), root: "room.glb".into() };
        Catalog { epoch: Epoch(1), scene, tick_seconds: 0.04, fields: vec![field] }
    }

    #[test]
    fn near_regions_and_low_layers_come_first() {
        let catalog = catalog(UVec3::new(40, 4, 20));
        let grid = &catalog.fields[0].grid;
        for region in &catalog.fields[0].regions {
            let eye = part(grid, region).center;
            let plan = plan(&catalog, Some(eye));
            assert_eq!(plan.len(), 3 * catalog.fields[0].regions.len());
            assert_eq!((plan[0].0.region, plan[0].0.layer), (region.id, 0));
            assert!(plan.is_sorted_by(|a, b| a.1 >= b.1));
            assert!(plan[0].1 > plan[1].1);
        }
    }

    #[test]
    fn any_number_of_regions_has_its_priority() {
        let catalog = catalog(UVec3::new(120, 40, 120));
        let plan = plan(&catalog, None);
        assert!(plan.len() > 3 * 500);
        assert!(plan.iter().all(|(_, priority)| (1..=LIGHT_PRIORITY).contains(priority)));
        assert!(plan.iter().all(|(t, p)| *p > LIGHT_PRIORITY - 80 * (t.layer + 1)));
    }
}
