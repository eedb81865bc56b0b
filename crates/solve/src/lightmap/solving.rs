//! What is known of lumels becomes light that can be shown.

use glam::{UVec2, Vec3};
use lumencast_light::{Lightmap, luminance, slope};
use rayon::prelude::*;

use super::blocks::{BLOCK, Block};
use super::filter::{Noisy, REACH, filter};
use super::{LightmapSolver, NO_RECEIVER, beyond, fill};

/// So many blocks are solved at a time, beside those that cannot wait.
const DUE_AT_ONCE: usize = 4;

/// What is shown of a block's lumels, row by row of [`BLOCK`].
struct Solved {
    irradiance: Vec<Vec3>,
    slopes: Option<Vec<Vec3>>,
}

impl LightmapSolver {
    /// Makes light of what has been taken in since the last time: filtered on the surface where
    /// `filtered`, spread to where nothing is known, and the same on both sides of seams. `shown` is what
    /// [`Self::dark`] made, with all that has been solved since.
    pub fn solve(&mut self, filtered: bool, shown: &mut Lightmap) {
        let mut news = std::mem::take(&mut self.news);
        self.due.retain(|block| !news.contains(block));
        for _ in 0..DUE_AT_ONCE {
            news.extend(self.due.pop_first());
        }
        news.iter().for_each(|block| self.ripening.solved(*block));
        let beside = news.iter().filter_map(|block| self.beside.get(block)).flatten();
        let beside: Vec<Block> = beside.copied().collect();
        news.extend(beside);
        let news: Vec<Block> = news.into_iter().collect();
        let solved: Vec<Solved> =
            news.par_iter().map(|block| self.solved(block, filtered)).collect();
        let size = self.layout.page_size;
        for (block, solved) in news.iter().zip(solved) {
            self.put(block, &solved.irradiance, &mut shown.irradiance);
            if let Some((solved, shown)) = solved.slopes.zip(shown.slopes.as_mut()) {
                self.put(block, &solved, shown);
            }
        }
        let seams = self.seams.about(|lumel| news.binary_search(&Block::of(lumel, size)).is_ok());
        let of = |lumel: &u32| self.known(beyond::own(self.receiver_of[*lumel as usize])?);
        let is_known = |lumel: &u32| of(lumel).is_some_and(|lumel| lumel.is_known());
        let known: Vec<bool> = seams.lumels().iter().map(is_known).collect();
        seams.apply(&mut shown.irradiance, &known);
        if let Some(slopes) = &mut shown.slopes {
            seams.apply_signed(slopes, &known);
        }
    }

    /// Puts the lumels of a block, row by row of [`BLOCK`], among those of all pages.
    fn put(&self, block: &Block, lumels: &[Vec3], into: &mut [Vec3]) {
        let size = self.layout.page_size;
        for (row, lumels) in (block.corner().y..size).zip(lumels.chunks(BLOCK as usize)) {
            let columns = (size - block.corner().x).min(BLOCK) as usize;
            let first = self.layout.index(block.page, UVec2::new(block.corner().x, row));
            into[first..first + columns].copy_from_slice(&lumels[..columns]);
        }
    }

    /// The light of a block, with those about it that count for it.
    fn solved(&self, block: &Block, filtered: bool) -> Solved {
        let size = self.layout.page_size as i32;
        let side = BLOCK + 2 * REACH;
        let low = block.corner().as_ivec2() - REACH as i32;
        let entries: Vec<u32> = (0..side * side)
            .map(|k| {
                let at = low + UVec2::new(k % side, k / side).as_ivec2();
                let is_on_page = at.min_element() >= 0 && at.max_element() < size;
                let index = is_on_page.then(|| self.layout.index(block.page, at.as_uvec2()));
                index.map_or(NO_RECEIVER, |index| self.receiver_of[index])
            })
            .collect();
        let noisy = |entry: &u32| self.known(beyond::receiver(*entry)?);
        let mut window: Vec<Option<Noisy>> = entries.iter().map(noisy).collect();
        if filtered {
            filter(&mut window, side, self.texel, REACH);
        }
        let known: Vec<Option<Noisy>> = entries
            .iter()
            .zip(window)
            .map(|(entry, lumel)| beyond::own(*entry).and(lumel).filter(Noisy::is_known))
            .collect();
        let filled = |of: &dyn Fn(&Noisy) -> Vec3| -> Vec<Vec3> {
            let mut light: Vec<Vec3> =
                known.iter().map(|lumel| lumel.as_ref().map_or(Vec3::ZERO, of)).collect();
            fill::fill(&mut light, side, |number| known[number].is_some());
            let rows = light.chunks(side as usize).skip(REACH as usize).take(BLOCK as usize);
            rows.flat_map(|row| &row[REACH as usize..(REACH + BLOCK) as usize]).copied().collect()
        };
        let of_slope = |lumel: &Noisy| slope(lumel.slope, luminance(lumel.irradiance));
        Solved {
            irradiance: filled(&|lumel| lumel.irradiance),
            slopes: self.slopes.as_ref().map(|_| filled(&of_slope)),
        }
    }

    /// What is known at a receiver; nothing where it lies within something.
    fn known(&self, receiver: u32) -> Option<Noisy> {
        let receiver = receiver as usize;
        let point = self.points[receiver];
        let (irradiance, variance) = self.sums[receiver].known()?;
        let slope = self.slopes.as_ref().map(|slopes| slopes.at(receiver) * luminance(irradiance));
        let (position, normal, slope) = (point.position, point.normal(), slope.unwrap_or_default());
        let samples = self.sums[receiver].samples();
        Some(Noisy { position, normal, irradiance, slope, variance, samples })
    }
}
