//! What a lightmap of a scene's still surfaces would be like.

use anyhow::Result;
use lumencast_charts::{LaidOut, Progress, Sheet, Sheets, Store, laid_out, lumels, sheets};
use lumencast_light::Surface;
use lumencast_scene::{LightmapSpec, Scene};
use serde_json::{Value, json};

use crate::output;

/// Pages, charts, density and coverage, with what has no lumels and why.
pub(crate) fn lightmap_report(scene: &mut Scene, spec: LightmapSpec) -> Result<Value> {
    let bar = output::share_bar("Cutting surfaces");
    let show = |Progress { done, total }: Progress| {
        bar.set_position(output::SHARE_BAR_LENGTH as u64 * done as u64 / total.max(1) as u64);
        true
    };
    let Sheets { sheets, notes } = sheets(&scene.snapshot(), Store::of_user().as_ref(), &show)?;
    bar.finish_and_clear();
    if sheets.is_empty() {
        return Ok(json!({ "pages": 0, "surfaces": 0, "notes": notes }));
    }
    let LaidOut { layout, texel, coarser } = laid_out(&sheets, spec)?;
    let covered: usize = layout.surfaces().iter().map(|s: &Surface| lumels(&s.charts).len()).sum();
    Ok(json!({
        "pages": layout.pages,
        "page_size": layout.page_size,
        "texel": texel,
        "coarser_than_asked": coarser,
        "surfaces": layout.surfaces().len(),
        "charts": sheets.iter().map(Sheet::charts).sum::<usize>(),
        "lumels": covered,
        "coverage": covered as f32 / layout.lumel_count().max(1) as f32,
        "notes": notes,
    }))
}
