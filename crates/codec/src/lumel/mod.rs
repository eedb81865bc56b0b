//! Lumel frames: one tile of one lightmap at one update (docs/wire.md, "Lumel frames").
//!
//! As halves, a page is many tiles (`tile_encoder`, `tile_decoder`); as video it is one.

mod coding;
mod decoder;
mod encoder;
mod halves;
mod header;
mod mapping;
mod model;
mod news;
mod page_decoder;
mod page_encoder;
mod pages;
mod planes;
mod residual;
mod slope_codes;
mod tile_decoder;
mod tile_encoder;
mod tile_light;
mod tiles;
mod video_frame;

pub use coding::{Coding, LumelCoding};
pub use decoder::LumelDecoder;
pub use encoder::LumelEncoder;
pub use header::LumelHeader;
pub use tile_light::TileLight;
pub(crate) use tiles::Cut;
pub use tiles::Tile;
