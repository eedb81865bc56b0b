//! The tracks of a broadcast: their names, and what goes first (docs/wire.md, "Broadcasts and tracks").

use std::fmt;

use crate::Catalog;

/// The track of catalogs.
pub const CATALOG: &str = "catalog";
/// The track of state frames.
pub const STATE: &str = "state";
/// The track of a client's edits, in a broadcast of its own.
pub const EDITS: &str = "edits";

/// Priority of [`CATALOG`]; greater ones go first.
pub const CATALOG_PRIORITY: u8 = 255;
/// Priority of [`STATE`].
pub const STATE_PRIORITY: u8 = 254;
/// The highest priority of light; a client grades regions from here on down.
pub const LIGHT_PRIORITY: u8 = 250;
/// Temporal layers of a region, at most.
pub const LAYERS: u8 = 3;

/// A track of light: a temporal layer of a region, the same for every kind of field.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct LightTrack {
    /// Number of the field.
    pub field: u32,
    /// Number of the region within the field.
    pub region: u32,
    /// Temporal layer, 0 to 2.
    pub layer: u8,
}

impl LightTrack {
    /// All tracks of a catalog's fields: all layers of a region after one another.
    pub fn of_catalog(catalog: &Catalog) -> impl Iterator<Item = Self> + '_ {
        catalog.fields.iter().flat_map(|field| {
            field.shape.regions().flat_map(move |region| {
                let track = move |layer| Self { field: field.id, region, layer };
                (0..field.shape.layers()).map(track)
            })
        })
    }

    /// The priority that a server gives it: lower layers first.
    pub fn server_priority(self) -> u8 {
        LAYERS.saturating_sub(self.layer + 1)
    }
}

impl fmt::Display for LightTrack {
    /// The track's name.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "f{}/r{}/l{}", self.field, self.region, self.layer)
    }
}
