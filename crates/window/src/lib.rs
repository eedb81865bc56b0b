//! A window onto a scene: the reference client's renderer ([`lumencast_shade`]) with cameras, controls,
//! statistics and screenshots.
//!
//! What is shown is a [`World`]: a scene with its light, saved ([`Still`]) or from a
//! server ([`Live`]). [`open`] shows it in a window of the platform's; a [`Stage`] is the same without the
//! window, for tests and for programs with windows of their own, and [`shoot`] saves a picture of it.

#![forbid(unsafe_code)]

mod app;
mod camera;
mod error;
mod exposure;
mod live;
mod panel;
mod shot;
mod stage;
mod statistics;
mod surface;
mod world;

use std::path::PathBuf;

use glam::UVec2;
use lumencast_scene::View;

pub use app::open;
pub use camera::{Camera, Steering};
pub use error::WindowError;
pub use exposure::Exposure;
pub use live::Live;
pub use panel::Controls;
pub use shot::shoot;
pub use stage::Stage;
pub use world::{Still, World};

/// How a window begins.
#[derive(Clone, Debug)]
pub struct Options {
    /// Pixels in width and height.
    pub size: UVec2,
    /// From where it is looked; the world's first camera unless given.
    pub view: Option<View>,
    /// How pictures are drawn and shown.
    pub controls: Controls,
    /// The folder where screenshots are saved.
    pub screenshots: PathBuf,
}
