//! Points spread over the surfaces that have lumels.

use glam::{Vec2, Vec3};
use lumencast_light::{Layout, OnTriangle, Place};
use lumencast_scene::Snapshot;

use super::places::surfaces;

/// So many points of the surfaces of a layout, evenly by area: always the same ones. Fewer where the
/// scene has none of the surfaces.
pub fn spread(scene: &Snapshot, layout: &Layout, count: usize) -> Vec<Place> {
    let all: Vec<_> = surfaces(scene, layout).collect();
    let mut ends = Vec::new();
    let mut area = 0.0;
    for (number, (surface, placed)) in all.iter().enumerate() {
        for triangle in 0..surface.charts.triangles.len() as u32 {
            if surface.charts.corners(triangle).is_some() {
                area += f64::from(placed.area(triangle));
                ends.push((area, number, triangle));
            }
        }
    }
    if area <= 0.0 {
        return Vec::new();
    }
    let place = |k: usize| {
        // Strata of the area, and an additive recurrence within triangles (Roberts 2018).
        let at = area * (k as f64 + 0.5) / count as f64;
        let (_, surface, triangle) =
            ends[ends.partition_point(|end| end.0 < at).min(ends.len() - 1)];
        let u = (Vec2::new(0.754_877_7, 0.569_840_3) * (k as f32 + 0.5)).fract();
        let root = u.x.sqrt();
        let weights = Vec3::new(1.0 - root, root * (1.0 - u.y), root * u.y);
        let (surface, placed) = &all[surface];
        let (position, normal) = placed.at(triangle, weights);
        Place { position, normal, on: Some(OnTriangle { surface: surface.id, triangle, weights }) }
    };
    (0..count).map(place).collect()
}
