//! What a lightmap of a scene's still surfaces would be like.

use std::time::Instant;

use anyhow::Result;
use lumencast_charts::{LaidOut, Sheets, chart_count, laid_out, lumels};
use lumencast_gather::path_trace::{CpuPathTracer, Options};
use lumencast_light::{Charts, Surface};
use lumencast_scene::{LightmapSpec, Scene};
use lumencast_solve::with_backs;
use serde_json::{Value, json};

use crate::charting;

/// Pages, charts, density and coverage, with what has no lumels and why.
pub(crate) fn lightmap_report(scene: &mut Scene, spec: Option<LightmapSpec>) -> Result<Value> {
    let start = Instant::now();
    let Sheets { sheets, notes } = charting::fronts(&scene.snapshot())?;
    let cut = start.elapsed().as_secs_f64();
    if sheets.is_empty() {
        return Ok(json!({ "pages": 0, "surfaces": 0, "notes": notes }));
    }
    let mut tracer = CpuPathTracer::new(Options::default())?;
    let start = Instant::now();
    let sheets = with_backs(sheets, &scene.snapshot(), &mut tracer)?;
    let looked = start.elapsed().as_secs_f64();
    let start = Instant::now();
    let LaidOut { layout, texel, larger, coarser } = laid_out(&sheets, spec)?;
    let laid_out = start.elapsed().as_secs_f64();
    let covered: usize = layout.surfaces().iter().map(|s: &Surface| lumels(&s.charts).len()).sum();
    let triangles = layout.surfaces().iter().flat_map(|surface| &surface.charts.triangles);
    let left_out = triangles.filter(|triangle| **triangle == Charts::NOWHERE).count();
    Ok(json!({
        "pages": layout.pages,
        "page_size": layout.page_size,
        "texel": texel,
        "largest_texel": larger.values().copied().reduce(f32::max),
        "coarser_than_asked": coarser,
        "surfaces": layout.surfaces().len(),
        "backs": layout.surfaces().iter().filter(|surface| surface.id.back).count(),
        "charts": layout.surfaces().iter().map(|s: &Surface| chart_count(&s.charts)).sum::<usize>(),
        "triangles_left_out": left_out,
        "lumels": covered,
        "coverage": covered as f32 / layout.lumel_count().max(1) as f32,
        "seconds": { "cut": cut, "looked_at_backs": looked, "laid_out": laid_out },
        "notes": notes,
    }))
}
