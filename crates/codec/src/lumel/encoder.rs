//! Lightmap → frames, tile by tile.

use lumencast_light::{Lightmap, ScaleRule};

use super::halves::{Lumel, from_rgb};
use super::header::LumelHeader;
use super::model::code_tile;
use super::tiles::Tile;
use crate::range_coder::Encoder;
use crate::{EncodedRegion, LightmapShape, UpdateInfo};

/// Every so many updates one of a tile is a keyframe, staggered over tiles.
const KEYFRAME_EVERY: u64 = 60;

/// Encodes the updates of one lightmap.
///
/// Costs, in memory: 6 bytes a lumel of the tiles that are watched.
#[derive(Clone, Debug)]
pub struct LumelEncoder {
    shape: LightmapShape,
    scale: ScaleRule,
    tiles: Vec<TileState>,
}

#[derive(Clone, Debug)]
struct TileState {
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

impl LumelEncoder {
    /// For lightmaps of a shape.
    pub fn new(shape: LightmapShape) -> Self {
        let tiles = shape.tiles().map(|tile| TileState { tile, newest: None }).collect();
        Self { shape, scale: ScaleRule::default(), tiles }
    }

    /// The shape.
    pub fn shape(&self) -> &LightmapShape {
        &self.shape
    }

    /// log2 of the field's scale after the last update; none before there was any light.
    pub fn scale_log2(&self) -> Option<i8> {
        self.scale.log2()
    }

    /// Encodes an update for the tiles that somebody watches. A tile newly watched begins with a
    /// keyframe, and so does one whose scale has changed. Values below 0 and those that are no numbers
    /// count as 0.
    ///
    /// # Panics
    /// If `lightmap` is not of the shape given to [`LumelEncoder::new`].
    pub fn encode(
        &mut self,
        lightmap: &Lightmap,
        info: UpdateInfo,
        watched: impl Fn(u32) -> bool,
    ) -> Vec<EncodedRegion> {
        let LightmapShape { page_size, pages, .. } = self.shape;
        assert_eq!((lightmap.layout.page_size, lightmap.layout.pages), (page_size, pages));
        let scale_log2 = self.scale.update(&lightmap.irradiance);
        let mut frames = Vec::with_capacity(self.tiles.len());
        for state in &mut self.tiles {
            if watched(state.tile.id) {
                frames.push(state.encode(lightmap, info, scale_log2));
            } else {
                state.newest = None;
            }
        }
        frames
    }
}

impl TileState {
    fn encode(&mut self, lightmap: &Lightmap, info: UpdateInfo, scale_log2: i8) -> EncodedRegion {
        let Tile { id, size, .. } = self.tile;
        let rows = self.tile.rows(lightmap.layout.page_size);
        let lumels: Vec<Lumel> = rows
            .flat_map(|row| &lightmap.irradiance[row])
            .map(|irradiance| from_rgb(*irradiance, scale_log2))
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
