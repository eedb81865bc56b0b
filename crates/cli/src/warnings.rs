//! What every command that reads a scene says of it, on standard error.

use lumencast_scene::Scene;

use crate::output::tell;

/// A scene's warnings take so many lines at most.
const SHOWN: usize = 20;

/// What is said where nothing gives light.
pub(crate) const DARK: &str =
    "nothing in the scene gives light; --environment sky:1000 puts it under a sky";

/// Says what of a scene's files is left out, and what was mended.
pub(crate) fn left_out(scene: &Scene) {
    let warnings = scene.warnings();
    for warning in warnings.iter().take(SHOWN) {
        tell!("warning: {warning}");
    }
    if warnings.len() > SHOWN {
        let more = warnings.len() - SHOWN;
        tell!("warning: {more} more like these; `lumencast inspect --json` lists all");
    }
}

/// Says where a scene comes out black, and what to do.
pub(crate) fn dark(scene: &Scene) {
    if scene.is_dark() {
        tell!("warning: {DARK}");
    }
}
