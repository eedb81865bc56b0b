//! Still surfaces cut into charts and laid out, with a bar that shows how far that is.

use std::fmt;
use std::sync::Arc;

use anyhow::Result;
use lumencast_charts::{ChartError, LaidOut, Progress, Sheets, Store, laid_out};
use lumencast_gather::Gather;
use lumencast_scene::{LightmapSpec, Snapshot};
use lumencast_solve::with_backs;
use serde::Serialize;

use crate::output::{self, tell};

/// How many lumels there are, and how large they are.
#[derive(Clone, Copy, Serialize)]
pub(crate) struct Lumels {
    pub(crate) pages: u32,
    /// Lumels on each side of a page.
    pub(crate) page_size: u32,
    /// Metres from lumel to lumel.
    pub(crate) texel: f32,
    /// The most of it, on surfaces that would not fit a page otherwise.
    pub(crate) largest: Option<f32>,
}

impl Lumels {
    pub(crate) fn of(laid_out: &LaidOut) -> Self {
        let LaidOut { layout, texel, larger, .. } = laid_out;
        let largest = larger.values().copied().reduce(f32::max);
        Self { pages: layout.pages, page_size: layout.page_size, texel: *texel, largest }
    }
}

impl fmt::Display for Lumels {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { pages, page_size, texel, largest } = self;
        write!(f, "{pages} × {page_size}², a lumel every {}", length(*texel))?;
        largest.map_or(Ok(()), |largest| write!(f, " to {}", length(largest)))
    }
}

/// A length of so many metres.
fn length(metres: f32) -> String {
    match metres {
        ..1e-3 => format!("{:.2} mm", 1000.0 * metres),
        ..1.0 => format!("{:.1} cm", 100.0 * metres),
        _ => format!("{metres:.1} m"),
    }
}

/// The fronts of a scene's still surfaces, cut into charts.
pub(crate) fn fronts(scene: &Snapshot) -> Result<Sheets> {
    let bar = output::share_bar("Cutting surfaces");
    let show = |Progress { done, total }: Progress| {
        bar.set_position(output::SHARE_BAR_LENGTH as u64 * done as u64 / total.max(1) as u64);
        true
    };
    let sheets = lumencast_charts::sheets(scene, Store::of_user().as_ref(), &show);
    bar.finish_and_clear();
    Ok(sheets?)
}

/// The lumels of a scene at a density, or at the usual one; nothing where it has no surface for any.
/// People are told where they come out otherwise than asked for.
pub(crate) fn lay_out(
    scene: &Arc<Snapshot>,
    spec: Option<LightmapSpec>,
    gatherer: &mut dyn Gather,
) -> Result<Option<LaidOut>> {
    let Sheets { sheets, notes } = fronts(scene)?;
    for note in notes {
        tell!("warning: {note}");
    }
    if sheets.is_empty() {
        tell!("warning: the scene has no still surface that lumels can lie on: probes light all");
        return Ok(None);
    }
    let all = with_backs(sheets, scene, gatherer)?;
    match laid_out(&all, spec) {
        Ok(laid_out) => {
            let Lumels { texel, largest, .. } = Lumels::of(&laid_out);
            if laid_out.coarser {
                let size = length(texel);
                tell!("warning: lumels are {size} wide, since there is no room for smaller ones");
            }
            if let Some(largest) = largest {
                let size = length(largest);
                tell!(
                    "warning: lumels are up to {size} wide where a chart would be larger than a page"
                );
            }
            Ok(Some(laid_out))
        }
        Err(error @ (ChartError::NoRoom | ChartError::NoArea)) => {
            tell!("warning: no surface has lumels: {error}");
            Ok(None)
        }
        Err(error) => Err(error.into()),
    }
}
