//! One tile as halves.

use lumencast_light::{Lightmap, Told};

use super::halves::{Lumel, from_rgb};
use super::header::LumelHeader;
use super::model::code_tile;
use super::slope_codes::{self, as_light};
use super::tiles::Tile;
use crate::range_coder::Encoder;
use crate::{EncodedRegion, UpdateInfo};

/// Every so many updates one of a tile is a keyframe, staggered over tiles.
const KEYFRAME_EVERY: u64 = 60;

/// Encodes one tile as halves. Costs 6 bytes a lumel while somebody watches.
#[derive(Debug)]
pub(crate) struct TileEncoder {
    tile: Tile,
    newest: Option<Coded>,
}

/// What decoders hold of a tile.
#[derive(Clone, Debug)]
struct Coded {
    update: u64,
    scale_log2: i8,
    lumels: Vec<Lumel>,
}

impl TileEncoder {
    pub(crate) fn new(tile: Tile) -> Self {
        Self { tile, newest: None }
    }

    pub(crate) fn tile(&self) -> Tile {
        self.tile
    }

    /// Nobody watches: whoever comes next begins with a keyframe.
    pub(crate) fn rest(&mut self) {
        self.newest = None;
    }

    /// The frame of an update.
    pub(crate) fn encode(
        &mut self,
        lightmap: &Lightmap,
        info: UpdateInfo,
        scale_log2: i8,
    ) -> EncodedRegion {
        let Tile { id, told, size, .. } = self.tile;
        let scale_log2 = match told {
            Told::Irradiance => scale_log2,
            Told::Slopes => slope_codes::MAPPING.scale_log2,
        };
        let rows = self.tile.rows(lightmap.layout.page_size);
        let lumels: Vec<Lumel> = rows
            .flat_map(|row| as_light(lightmap, told, row).into_owned())
            .map(|light| from_rgb(light, scale_log2))
            .collect();
        let base = self.newest.as_ref().filter(|newest| {
            !(info.update + u64::from(id)).is_multiple_of(KEYFRAME_EVERY)
                && newest.scale_log2 == scale_log2
                && (1..=255).contains(&info.update.wrapping_sub(newest.update))
        });
        let mut bytes = Vec::with_capacity(64 + lumels.len());
        let header = LumelHeader { info, base: base.map(|base| base.update), scale_log2, size };
        header.write(&mut bytes);
        let mut encoder = Encoder::new(bytes);
        code_tile(&mut encoder, size, base.map(|base| &base.lumels[..]), Some(&lumels))
            .expect("halves can be coded");
        let new_group = base.is_none();
        self.newest = Some(Coded { update: info.update, scale_log2, lumels });
        EncodedRegion { region: id, layer: 0, new_group, bytes: encoder.finish(), error: 0.0 }
    }
}
