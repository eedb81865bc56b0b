//! Which tracks are read, and which go first on a link too slow for all.

use glam::Vec3;
use lumencast_codec::tracks::{LAYERS, LIGHT_PRIORITY, LightTrack};
use lumencast_codec::{Catalog, FieldInfo};

/// Regions of different priority in each layer; those farther away share the last.
const RANKS: usize = 80;

/// The tracks of a catalog with their priorities: layer 0 of all regions before layer 1 of any, since
/// light that is seldom renewed beats light that is not; within a layer near regions before far ones.
pub(crate) fn plan(catalog: &Catalog, eye: Option<Vec3>) -> Vec<(LightTrack, u8)> {
    let mut regions: Vec<(f32, &FieldInfo, u32)> = catalog
        .fields
        .iter()
        .flat_map(|field| field.shape.regions().map(move |region| (field, region)))
        .map(|(field, region)| {
            let distance = eye.map_or(0.0, |eye| field.shape.distance(region, eye));
            (distance, field, region)
        })
        .collect();
    regions.sort_by(|a, b| a.0.total_cmp(&b.0));
    let of_layer = |layer: u8| {
        regions.iter().enumerate().filter_map(move |(rank, &(_, field, region))| {
            let below = RANKS * usize::from(layer) + rank.min(RANKS - 1);
            let track = LightTrack { field: field.id, region, layer };
            (layer < field.shape.layers()).then_some((track, LIGHT_PRIORITY - below as u8))
        })
    };
    (0..LAYERS).flat_map(of_layer).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{Quat, UVec3};
    use lumencast_codec::{Epoch, SceneInfo};
    use lumencast_light::{FieldId, Grid, Order, ProbeVolume};

    fn catalog(resolution: UVec3) -> Catalog {
        let grid = Grid {
            center: Vec3::new(5.0, 0.0, 0.0),
            rotation: Quat::from_rotation_y(0.5),
            size: resolution.as_vec3(),
            resolution,
        };
        let volume = ProbeVolume::dark(FieldId(3), grid, Order::L1);
        let field = FieldInfo::of_volume(&volume, None, "");
        let scene = SceneInfo { name: "room".into(), root: "room.glb".into() };
        Catalog { epoch: Epoch(1), scene, tick_seconds: 0.04, fields: vec![field], unknown: vec![] }
    }

    #[test]
    fn near_regions_and_low_layers_come_first() {
        let catalog = catalog(UVec3::new(40, 4, 20));
        let shape = catalog.fields[0].shape.as_volume().unwrap();
        for region in &shape.regions {
            let middle = region.min.as_vec3() + 0.5 * (region.size.as_vec3() - 1.0);
            let eye = shape.grid.world_from_cell(middle);
            let plan = plan(&catalog, Some(eye));
            assert_eq!(plan.len(), 3 * shape.regions.len());
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
