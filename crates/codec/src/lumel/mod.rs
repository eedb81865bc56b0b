//! Lumel frames: one tile of one lightmap at one update (docs/wire.md, "Lumel frames").

mod decoder;
mod encoder;
mod halves;
mod header;
mod model;
mod residual;
mod tiles;

pub use decoder::{LumelDecoder, TileLight};
pub use encoder::LumelEncoder;
pub use header::LumelHeader;
pub use tiles::Tile;
pub(crate) use tiles::{per_side, tile, tiles};
