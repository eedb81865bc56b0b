//! Which backs of surfaces have lumels.
//!
//! Most materials of real files are double-sided, and most of their backs lie within something. What
//! the back of a chart sees decides: where its points see the fronts of surfaces, backs that are lit, or
//! nothing at all, light can arrive.

use std::sync::Arc;

use lumencast_charts::Sheet;
use lumencast_gather::{Gather, Job, Receiver};
use lumencast_scene::Snapshot;

use super::places::PlacedSurface;
use crate::error::SolveError;

/// Points of a chart that look.
const POINTS: usize = 4;
/// Directions in which each looks.
const DIRECTIONS: u32 = 32;
/// A point sees light if fewer of its directions than this share meet the back of a surface that is dark.
const DARK_BACKS: f32 = 0.5;
/// Light that is scattered so often tells whether a back is dark.
const BOUNCES: u32 = 1;

/// The sheets, and those of their backs that light can reach: charts of double-sided materials that see
/// something.
///
/// # Errors
/// A gatherer that gave up.
pub fn with_backs(
    sheets: Vec<Sheet>,
    scene: &Arc<Snapshot>,
    gatherer: &mut dyn Gather,
) -> Result<Vec<Sheet>, SolveError> {
    let mut receivers = Vec::new();
    // For each receiver, its sheet and chart.
    let mut asked = Vec::new();
    for (number, sheet) in sheets.iter().enumerate() {
        let instance = &scene.instances[sheet.instance];
        let primitive = &instance.mesh.primitives[sheet.id.primitive as usize];
        let is_double_sided = scene
            .materials
            .get(primitive.material.0 as usize)
            .is_some_and(|material| material.double_sided);
        let back = lumencast_light::SurfaceId { back: true, ..sheet.id };
        let Some(placed) = PlacedSurface::new(scene, instance, back).filter(|_| is_double_sided)
        else {
            continue;
        };
        for (chart, triangle) in largest(sheet, &placed) {
            let (position, normal) = placed.at(triangle, glam::Vec3::splat(1.0 / 3.0));
            receivers.push(Receiver::point(position, normal));
            asked.push((number, chart));
        }
    }
    if receivers.is_empty() {
        return Ok(sheets);
    }
    let look = Job { bounces: BOUNCES, ..Job::new(scene.clone(), receivers, DIRECTIONS) };
    let ticket = gatherer.submit(look);
    let found = gatherer.wait(ticket).ok_or(SolveError::Gather)?;
    let mut reached: Vec<Option<Vec<bool>>> = vec![None; sheets.len()];
    for ((sheet, chart), sums) in asked.into_iter().zip(found.sums.iter()) {
        if sums.dark_back_fraction < DARK_BACKS {
            let charts = sheets[sheet].charts();
            reached[sheet].get_or_insert_with(|| vec![false; charts])[chart as usize] = true;
        }
    }
    let backs: Vec<Sheet> = sheets
        .iter()
        .zip(reached)
        .filter_map(|(sheet, charts)| Some(sheet.back(charts?)))
        .collect();
    Ok(sheets.into_iter().chain(backs).collect())
}

/// The largest triangles of each chart, with its number.
fn largest(sheet: &Sheet, placed: &PlacedSurface<'_>) -> Vec<(u32, u32)> {
    let mut of_chart: Vec<Vec<(f32, u32)>> = vec![Vec::new(); sheet.charts()];
    for triangle in 0..sheet.triangle_count() {
        if let Some(chart) = sheet.chart_of(triangle) {
            of_chart[chart as usize].push((placed.area(triangle as u32), triangle as u32));
        }
    }
    let mut chosen = Vec::new();
    for (chart, mut triangles) in (0..).zip(of_chart) {
        triangles.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        chosen.extend(triangles.into_iter().take(POINTS).map(|(_, triangle)| (chart, triangle)));
    }
    chosen
}
