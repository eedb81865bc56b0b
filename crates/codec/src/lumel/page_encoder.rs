//! One page as video.

use std::borrow::Cow;
use std::ops::RangeInclusive;

use glam::Vec3;
use lumencast_light::{Lightmap, Told};
use lumencast_video::{H264Encoder, PictureEncoder, Qp, VideoError};

use super::mapping::{CodeTable, Mapping};
use super::news::PageNews;
use super::planes::{Packing, Planes};
use super::slope_codes::{self, as_light};
use super::tiles::Tile;
use super::video_frame::VideoHead;
use crate::{EncodedRegion, UpdateInfo};

/// A group has so many pictures at most: whoever joins decodes all of them.
const GROUP_PICTURES: u32 = 50;
/// A group spans so many seconds of scene time at most, while there are pictures.
const GROUP_SECONDS: f64 = 2.0;
/// Where nothing changes, a frame without a picture goes out every so many updates, about a second: it
/// tells that the light is still that of now.
const IDLE_UPDATES: u64 = 25;
/// So many bytes of each of them are put by for the next keyframe, which mends what was lost. All pages
/// share them.
const IDLE_BYTES: usize = 2048;
/// A group has so many of them, at least and at most.
const IDLE_FRAMES: RangeInclusive<usize> = 2..=60;

/// Encodes one page. Costs 1.5 bytes a lumel, 3 where planes are stacked, and what the video encoder
/// takes.
pub(crate) struct PageEncoder {
    tile: Tile,
    /// Number of all pages.
    pages: usize,
    packing: Packing,
    qp: Qp,
    news: PageNews,
    planes: Planes,
    table: Option<(Mapping, CodeTable)>,
    encoder: Option<H264Encoder>,
    group: Option<Group>,
}

/// What decoders have had since the last keyframe.
#[derive(Clone, Copy, Debug)]
struct Group {
    newest: u64,
    /// Scene time of its first picture.
    began: f64,
    pictures: u32,
    /// Frames without a picture.
    idle: usize,
    /// How many of these there are at most.
    most_idle: usize,
}

impl Group {
    /// Whether a keyframe is due, at a scene time, where the light has changed or not.
    fn is_over(&self, changed: bool, time: f64) -> bool {
        match changed {
            true => {
                self.pictures >= GROUP_PICTURES
                    || !(0.0..GROUP_SECONDS).contains(&(time - self.began))
            }
            false => self.idle >= self.most_idle,
        }
    }
}

impl PageEncoder {
    /// For one of so many pages.
    pub(crate) fn new(tile: Tile, pages: usize, packing: Packing, qp: Qp) -> Self {
        let planes = Planes::new(packing, tile.size.x);
        let news = PageNews::new(tile.size.x);
        Self { tile, pages, packing, qp, news, planes, table: None, encoder: None, group: None }
    }

    pub(crate) fn tile(&self) -> Tile {
        self.tile
    }

    /// Nobody watches: whoever comes next begins with a keyframe.
    pub(crate) fn rest(&mut self) {
        self.group = None;
    }

    /// What a lightmap tells on this page, as light; it is to be encoded next.
    pub(crate) fn look<'a>(&mut self, lightmap: &'a Lightmap) -> Cow<'a, [Vec3]> {
        let lumels = self.tile.lumel_count();
        let first = self.tile.page as usize * lumels;
        let page = as_light(lightmap, self.tile.told, first..first + lumels);
        self.news.look(&page);
        page
    }

    /// The brightest channel of irradiance, lux, when this was looked at last; 0 where it tells no
    /// irradiance.
    pub(crate) fn brightest(&self) -> f32 {
        match self.tile.told {
            Told::Irradiance => self.news.brightest(),
            Told::Slopes => 0.0,
        }
    }

    /// The frame of an update of the page that was looked at last; none where nothing is to be told.
    pub(crate) fn encode(
        &mut self,
        page: &[Vec3],
        info: UpdateInfo,
        scale_log2: i8,
    ) -> Result<Option<EncodedRegion>, VideoError> {
        let before = self.table.as_ref().map(|(mapping, _)| *mapping);
        let suits = |mapping: &Mapping| {
            mapping.scale_log2 == scale_log2 && mapping.suits(self.news.brightest())
        };
        let mapping = match self.tile.told {
            Told::Slopes => slope_codes::MAPPING,
            Told::Irradiance => {
                before.filter(suits).unwrap_or_else(|| Mapping::of(page, scale_log2))
            }
        };
        let group = self.group.filter(|group| {
            before == Some(mapping) && (1..=255).contains(&info.update.wrapping_sub(group.newest))
        });
        let kept = self.table.take().filter(|(known, _)| *known == mapping);
        let (_, table) =
            self.table.insert(kept.unwrap_or_else(|| (mapping, CodeTable::new(mapping))));
        let anew = group.is_none();
        if anew {
            self.news.forget();
        }
        let changed = self.planes.follow(page, self.news.take(), table, anew);
        if let Some(group) = group.filter(|_| !changed)
            && info.update - group.newest < IDLE_UPDATES
        {
            return Ok(None);
        }
        let group = group.filter(|group| !group.is_over(changed, info.time));
        let base = group.map(|group| group.newest);
        let mut bytes = Vec::with_capacity(64);
        VideoHead { info, base, mapping }.write(&mut bytes);
        let has_picture = changed || group.is_none();
        if has_picture {
            bytes.extend(self.picture(group.is_none())?);
        }
        let before = group.unwrap_or_else(|| {
            let (start, end) = IDLE_FRAMES.into_inner();
            let most_idle = (bytes.len() * self.pages / IDLE_BYTES).clamp(start, end);
            Group { newest: 0, began: info.time, pictures: 0, idle: 0, most_idle }
        });
        self.group = Some(Group {
            newest: info.update,
            pictures: before.pictures + u32::from(has_picture),
            idle: before.idle + usize::from(!has_picture),
            ..before
        });
        let (region, new_group) = (self.tile.id, group.is_none());
        Ok(Some(EncodedRegion { region, layer: 0, new_group, bytes, error: 0.0 }))
    }

    /// The access unit of the planes as they are now.
    fn picture(&mut self, keyframe: bool) -> Result<Vec<u8>, VideoError> {
        let encoder = match &mut self.encoder {
            Some(encoder) => encoder,
            None => {
                let (width, height) = self.packing.size(self.tile.size.x);
                self.encoder.insert(H264Encoder::new(width, height, self.qp)?)
            }
        };
        encoder.encode(self.planes.picture(), keyframe).inspect_err(|_| {
            self.group = None;
        })
    }
}
