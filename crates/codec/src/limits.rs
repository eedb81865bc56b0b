//! What decoders refuse to exceed (docs/wire.md, "Limits"). Every allocation of a decoder is bounded
//! by these before a byte of it is made.

/// Bytes of a frame.
pub const FRAME_BYTES: usize = 1 << 20;
/// Bytes of a frame of a client's edits.
pub const EDIT_BYTES: usize = 4 * 1024;
/// The largest number on the wire that is no measure: the largest that JavaScript tells from its
/// neighbours.
pub const LARGEST_NUMBER: u64 = (1 << 53) - 1;
/// Fields of a catalog.
pub const FIELDS: usize = 256;
/// Regions of a field.
pub const REGIONS: usize = 4096;
/// Probes of a field.
pub const FIELD_PROBES: usize = 1 << 18;
/// Probes of all fields of a catalog together.
pub const CATALOG_PROBES: usize = 1 << 19;
/// Cells of a region along an axis.
pub const REGION_CELLS: u32 = 16;
/// Lumels of a tile along a side.
pub const TILE_LUMELS: u32 = 256;
/// Lumels of a page along a side.
pub const PAGE_LUMELS: u32 = 4096;
/// Lumels of a field.
pub const FIELD_LUMELS: usize = 8 << 20;
/// Lumels of all fields of a catalog together.
pub const CATALOG_LUMELS: usize = 8 << 20;
/// Bytes of a resource.
pub const RESOURCE_BYTES: usize = 64 << 20;
/// Bytes of all resources that a client keeps.
pub const CATALOG_RESOURCE_BYTES: usize = 256 << 20;
/// Bytes of the text that names a field's source.
pub const SOURCE_BYTES: usize = 128;
/// Edits of a snapshot.
pub const SNAPSHOT_EDITS: usize = 1 << 16;
/// Edits of a delta, and refusals.
pub const DELTA_EDITS: usize = 4096;
/// Bytes of a file.
pub const FILE_BYTES: u64 = 1 << 30;
