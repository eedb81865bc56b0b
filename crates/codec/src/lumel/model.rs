//! The model of a tile: which numbers are coded, in which order, with which predictions and contexts
//! (docs/wire.md, "What is coded of lumels"). Encoder and decoder both walk it.
//!
//! A frame cannot exceed the limit of 1 MiB. A residual has at most 34 bits, of which those with a
//! context cost at most 1.013 each in the long run, whatever they are. So 256² lumels take at most
//! 0.85 MB, and the contexts some kilobytes to learn.

use std::ops::Range;

use glam::{USizeVec2, UVec2};

use super::halves::{Lumel, lumel};
use super::residual::{Near, ResidualContexts, bit_length};
use crate::DecodeError;
use crate::range_coder::{BitCoder, Context};

/// Lumels of a block along a side.
const BLOCK: usize = 8;

/// Contexts of a frame.
struct Contexts {
    skip: [Context; 3],
    by_neighbours: Context,
    /// Of Y, and of Co and Cg.
    residual: [ResidualContexts; 2],
}

/// A block of a tile.
struct Block {
    x: Range<usize>,
    y: Range<usize>,
}

impl Block {
    /// The columns, the rows and the number of each of its lumels in a tile of this width.
    fn lumels(&self, width: usize) -> impl Iterator<Item = (usize, usize, usize)> + use<> {
        let (x, y) = (self.x.clone(), self.y.clone());
        y.flat_map(move |y| x.clone().map(move |x| (x, y, y * width + x)))
    }
}

/// Codes one tile, in the direction of `coder`. `wanted` is what an encoder wants; a decoder has none.
pub(crate) fn code_tile<C: BitCoder>(
    coder: &mut C,
    size: UVec2,
    base: Option<&[Lumel]>,
    wanted: Option<&[Lumel]>,
) -> Result<Vec<Lumel>, DecodeError> {
    let size = size.as_usizevec2();
    let count = size.element_product();
    let mut contexts = Contexts {
        skip: [Context::NEW; 3],
        by_neighbours: Context::NEW,
        residual: [ResidualContexts::NEW; 2],
    };
    let is_delta = base.is_some();
    let black = if is_delta { Vec::new() } else { vec![[0; 3]; count] };
    let base = base.unwrap_or(&black);
    let mut tile = vec![[0; 3]; count];
    let mut residuals = vec![[0; 3]; count];
    let across = size.x.div_ceil(BLOCK);
    let mut skipped = vec![false; across * size.y.div_ceil(BLOCK)];
    for number in 0..skipped.len() {
        if coder.overrun() {
            return Err(DecodeError::Truncated);
        }
        let block = block(size, USizeVec2::new(number % across, number / across));
        let mut by_neighbours = true;
        if is_delta {
            let left = number % across > 0 && skipped[number - 1];
            let above = number >= across && skipped[number - across];
            let likely = usize::from(left) + usize::from(above);
            let same =
                |wanted: &[Lumel]| block.lumels(size.x).all(|(.., at)| wanted[at] == base[at]);
            if coder.bit(&mut contexts.skip[likely], wanted.is_some_and(same)) {
                skipped[number] = true;
                block.lumels(size.x).for_each(|(.., at)| tile[at] = base[at]);
                continue;
            }
            let pays = wanted.is_some_and(|wanted| neighbours_pay(wanted, base, &block, size.x));
            by_neighbours = coder.bit(&mut contexts.by_neighbours, pays);
        }
        for (x, y, at) in block.lumels(size.x) {
            let mut predicted = base[at].map(i32::from);
            if by_neighbours {
                add(&mut predicted, change_nearby(&tile, base, (x, y, at), size.x));
            }
            let west = if x > 0 { residuals[at - 1] } else { [0; 3] };
            let north = if y > 0 { residuals[at - size.x] } else { [0; 3] };
            let mut own = [0; 3];
            for k in 0..3 {
                let near = Near { west: west[k], north: north[k], luma: own[0] };
                let residual = wanted.map_or(0, |wanted| i32::from(wanted[at][k]) - predicted[k]);
                own[k] = contexts.residual[usize::from(k > 0)].code(coder, &near, residual);
            }
            add(&mut predicted, own);
            tile[at] = lumel(predicted).ok_or(DecodeError::Malformed("a value is no half"))?;
            residuals[at] = own;
        }
    }
    if coder.overrun() {
        return Err(DecodeError::Truncated);
    }
    Ok(tile)
}

/// The block at a place in the order of blocks; smaller at the tile's edges.
fn block(size: USizeVec2, place: USizeVec2) -> Block {
    let (min, max) = (BLOCK * place, (BLOCK * (place + 1)).min(size));
    Block { x: min.x..max.x, y: min.y..max.y }
}

fn add(channels: &mut [i32; 3], more: [i32; 3]) {
    channels.iter_mut().zip(more).for_each(|(channel, more)| *channel += more);
}

/// What a lumel's change from the base is likely to be, by those at west, north and north-west: the
/// median edge detector of JPEG-LS (Weinberger, Seroussi and Sapiro 2000).
fn change_nearby(
    tile: &[Lumel],
    base: &[Lumel],
    (x, y, at): (usize, usize, usize),
    width: usize,
) -> [i32; 3] {
    let change = |at: usize| -> [i32; 3] {
        std::array::from_fn(|k| i32::from(tile[at][k]) - i32::from(base[at][k]))
    };
    match (x > 0, y > 0) {
        (false, false) => [0; 3],
        (true, false) => change(at - 1),
        (false, true) => change(at - width),
        (true, true) => {
            let (west, north) = (change(at - 1), change(at - width));
            let corner = change(at - width - 1);
            std::array::from_fn(|k| {
                let (low, high) = (west[k].min(north[k]), west[k].max(north[k]));
                (west[k] + north[k] - corner[k]).clamp(low, high)
            })
        }
    }
}

/// Whether a block's changes are told in fewer bits by their differences from those nearby. Bits are
/// estimated by those of the magnitudes, and one wherever the sign is another than the one before.
fn neighbours_pay(wanted: &[Lumel], base: &[Lumel], block: &Block, width: usize) -> bool {
    let (mut apart, mut by_neighbours) = (0, 0);
    let (mut last_apart, mut last_by_neighbours) = ([0; 3], [0; 3]);
    let bits = |residual: i32, last: &mut i32| {
        let turned = residual.signum() != std::mem::replace(last, residual.signum());
        bit_length(residual) + usize::from(turned)
    };
    for (x, y, at) in block.lumels(width) {
        let nearby = change_nearby(wanted, base, (x, y, at), width);
        for k in 0..3 {
            let change = i32::from(wanted[at][k]) - i32::from(base[at][k]);
            apart += bits(change, &mut last_apart[k]);
            by_neighbours += bits(change - nearby[k], &mut last_by_neighbours[k]);
        }
    }
    by_neighbours < apart
}
