//! Lumels: light on surfaces.

mod charts;
mod layout;
mod pages;

pub use charts::{ChartVertex, Charts};
pub use layout::{Layout, Rectangle, Surface, SurfaceId};
pub use pages::Lightmap;
