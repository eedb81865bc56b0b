//! Lightmap → frames.

use lumencast_light::{Lightmap, ScaleRule};
use lumencast_video::VideoError;

use super::coding::LumelCoding;
use super::page_encoder::PageEncoder;
use super::pages::Pages;
use super::tile_encoder::TileEncoder;
use crate::{EncodedRegion, LightmapShape, UpdateInfo};

/// Encodes the updates of one lightmap.
///
/// Costs, in memory: 6 bytes a lumel of the tiles that are watched; as video what
/// [`lumencast_video::H264Encoder`] takes, and a few bytes a lumel beside.
pub struct LumelEncoder {
    shape: LightmapShape,
    scale: ScaleRule,
    regions: Regions,
}

/// What each region keeps.
enum Regions {
    Tiles(Vec<TileEncoder>),
    Pages(Pages),
}

impl LumelEncoder {
    /// For lightmaps of a shape, whose coding is that of `coding`.
    ///
    /// # Panics
    /// If the codings differ.
    pub fn new(shape: LightmapShape, coding: LumelCoding) -> Self {
        assert_eq!(shape.coding, coding.coding(), "the shape tells how lumels are coded");
        let regions = match coding.video() {
            None => Regions::Tiles(shape.tiles().map(TileEncoder::new).collect()),
            Some((packing, qp)) => {
                let count = shape.tiles().count();
                let encoder = |tile| PageEncoder::new(tile, count, packing, qp);
                Regions::Pages(Pages::new(shape.tiles().map(encoder).collect()))
            }
        };
        Self { shape, scale: ScaleRule::default(), regions }
    }

    /// Goes on with lightmaps that differ in their layout alone; whether these do.
    pub(crate) fn follow(&mut self, shape: LightmapShape) -> bool {
        let is_alike = self.shape.is_coded_alike(&shape);
        if is_alike {
            self.shape = shape;
        }
        is_alike
    }

    /// The shape.
    pub fn shape(&self) -> &LightmapShape {
        &self.shape
    }

    /// log2 of the field's scale after the last update; none before there was any light.
    pub fn scale_log2(&self) -> Option<i8> {
        self.scale.log2()
    }

    /// Encodes an update for the regions that somebody watches. One newly watched begins with a
    /// keyframe, and so does one whose scale has changed. Values below 0 and those that are no numbers
    /// count as 0. As video, pages that have not changed have no frame, and where there are many, they
    /// take turns.
    ///
    /// # Errors
    /// [`VideoError`] where pages cannot be coded as video ([`LumelCoding::check`]). Those that follow
    /// begin with keyframes.
    ///
    /// # Panics
    /// If `lightmap` is not of the shape given to [`LumelEncoder::new`].
    pub fn encode(
        &mut self,
        lightmap: &Lightmap,
        info: UpdateInfo,
        watched: impl Fn(u32) -> bool,
    ) -> Result<Vec<EncodedRegion>, VideoError> {
        let LightmapShape { page_size, pages, .. } = self.shape;
        assert_eq!((lightmap.layout.page_size, lightmap.layout.pages), (page_size, pages));
        match &mut self.regions {
            Regions::Tiles(encoders) => {
                let scale_log2 = self.scale.update(&lightmap.irradiance);
                let mut frames = Vec::new();
                for encoder in encoders {
                    if watched(encoder.tile().id) {
                        frames.push(encoder.encode(lightmap, info, scale_log2));
                    } else {
                        encoder.rest();
                    }
                }
                Ok(frames)
            }
            Regions::Pages(pages) => pages.encode(lightmap, info, &mut self.scale, watched),
        }
    }
}
impl std::fmt::Debug for LumelEncoder {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("LumelEncoder").field("shape", &self.shape).finish_non_exhaustive()
    }
}
