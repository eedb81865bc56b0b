//! Surfaces of a scene cut into charts, and laid out on pages of lumels.
//!
//! [`sheets`] cuts the still surfaces, once for all equal ones, and keeps what it made in a [`Store`].
//! [`laid_out`] gives them places on pages, at a density. [`extended`] finds room for more. [`lumels`] tells where each lumel lies on its surface.
//!
//! ```
//! use lumencast_charts::{laid_out, lumels, sheets};
//! use lumencast_scene::{LightmapSpec, Scene};
//!
//! let mut scene = Scene::open("cornell")?;
//! let sheets = sheets(&scene.snapshot(), None, &|_| true)?.sheets;
//! let laid_out = laid_out(&sheets, LightmapSpec::Size(128))?;
//! let count: usize = laid_out.layout.surfaces().iter().map(|s| lumels(&s.charts).len()).sum();
//! assert!(count > 64 * 64 && count <= 128 * 128);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#![forbid(unsafe_code)]

mod cut;
mod error;
mod extend;
mod layout;
mod lumels;
mod overlaps;
mod parts;
mod raster;
mod sheet;
mod store;

pub use error::ChartError;
pub use extend::{Extended, extended};
pub use layout::{LaidOut, MOST_PAGES, PAGE, laid_out};
pub use lumels::{Lumel, lumels, lumels_on_pages};
pub use parts::{UnionFind, chart_count};
pub use raster::barycentric;
pub use sheet::{Progress, Sheet, Sheets, sheets, takes_lumels};
pub use store::Store;
