//! Lumels: light on surfaces.

mod ages;
mod charts;
mod layout;
mod pages;
mod slope;

pub use ages::LumelAges;
pub use charts::{ChartVertex, Charts};
pub use layout::{Layout, Rectangle, Surface, SurfaceId};
pub use pages::{Lightmap, Told};
pub use slope::{STEEPEST, TILT, slope, slope_by, tilted};
