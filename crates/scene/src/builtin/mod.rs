//! Scenes made in code as .glb files, so that clients draw the same file that the server loads.
//!
//! They resemble the scenes of the first paper (NetLight): a Cornell box, a dark room behind a
//! door, and a tomb lit by a flashlight.

mod cornell;
mod door;
pub(crate) mod shapes;
mod tomb;
pub(crate) mod writer;

/// Names of the built-in scenes.
pub const NAMES: &[&str] = &["cornell", "door", "tomb"];

/// The .glb file of a built-in scene.
pub(crate) fn glb(name: &str) -> Option<Vec<u8>> {
    match name {
        "cornell" => Some(cornell::glb()),
        "door" => Some(door::glb()),
        "tomb" => Some(tomb::glb()),
        _ => None,
    }
}
