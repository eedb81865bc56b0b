//! All pages as video, in turns.

use std::borrow::Cow;

use glam::Vec3;
use lumencast_light::{Lightmap, ScaleRule};
use lumencast_video::VideoError;

use super::page_encoder::PageEncoder;
use crate::{EncodedRegion, UpdateInfo};

/// So many lumels become pictures in an update, so that large pages cost half the bits, at half the rate.
const LUMELS_AN_UPDATE: usize = 1 << 19;
/// Each page has its turn within so many updates, however many there are.
const LONGEST_TURN: usize = 8;

/// The encoders of all pages.
pub(crate) struct Pages {
    encoders: Vec<PageEncoder>,
    /// The page whose turn is next.
    next: usize,
    /// How many lumels may become pictures now.
    room: usize,
}

impl Pages {
    pub(crate) fn new(encoders: Vec<PageEncoder>) -> Self {
        let [_, room] = rooms(&encoders);
        Self { encoders, next: 0, room }
    }

    /// Encodes an update for the pages that somebody watches, as far as it is their turn. `scale` follows
    /// the brightest light of all pages, of each as it was at its last turn.
    pub(crate) fn encode(
        &mut self,
        lightmap: &Lightmap,
        info: UpdateInfo,
        scale: &mut ScaleRule,
        watched: impl Fn(u32) -> bool,
    ) -> Result<Vec<EncodedRegion>, VideoError> {
        let turn = self.turn(watched);
        let first_light = scale.log2().is_none();
        let mut looks: Vec<Option<Cow<'_, [Vec3]>>> = vec![None; self.encoders.len()];
        for (number, encoder) in self.encoders.iter_mut().enumerate() {
            if first_light || turn.contains(&number) {
                looks[number] = Some(encoder.look(lightmap));
            }
        }
        let brightest = self.encoders.iter().map(PageEncoder::brightest).fold(0.0, f32::max);
        let scale_log2 = scale.follow(brightest);
        let mut frames = Vec::new();
        for number in turn {
            if let Some(page) = &looks[number] {
                frames.extend(self.encoders[number].encode(page, info, scale_log2)?);
            }
        }
        Ok(frames)
    }

    /// The pages whose turn it is. Those that nobody watches rest.
    fn turn(&mut self, watched: impl Fn(u32) -> bool) -> Vec<usize> {
        let Self { encoders, next, room } = self;
        let mut turn = Vec::new();
        for _ in 0..encoders.len() {
            let encoder = &mut encoders[*next];
            let lumels = encoder.tile().lumel_count();
            if !watched(encoder.tile().id) {
                encoder.rest();
            } else if lumels <= *room {
                *room -= lumels;
                turn.push(*next);
            } else {
                break;
            }
            *next = (*next + 1) % encoders.len();
        }
        let [more, most] = rooms(encoders);
        *room = (*room + more).min(most);
        turn
    }
}

/// How many lumels more may become pictures with each update, and how many at most.
fn rooms(pages: &[PageEncoder]) -> [usize; 2] {
    let lumels = || pages.iter().map(|page| page.tile().lumel_count());
    let more = LUMELS_AN_UPDATE.max(lumels().sum::<usize>().div_ceil(LONGEST_TURN));
    [more, more.max(lumels().max().unwrap_or(0))]
}
