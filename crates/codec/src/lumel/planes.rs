//! A page of lumels as a picture: codes of red, green and blue become Y, Co and Cg.
//!
//! Y = (r + 2g + b) / 4, Co = (r − b) / 2 + 128, Cg = (2g − r − b) / 4 + 128; back: g = Y + (Cg − 128),
//! r = Y − (Cg − 128) + (Co − 128), b = Y − (Cg − 128) − (Co − 128).

use glam::Vec3;
use lumencast_video::Picture;

use super::mapping::{CodeTable, LightTable};
use super::news::SQUARE;

/// Where the three planes of a page lie in a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Packing {
    /// Y as luma, Co and Cg as chroma of half the resolution.
    Subsampled,
    /// Y, Co and Cg as luma, below each other; the chroma is grey.
    Stacked,
}

/// Sides of pictures are multiples of H.264's macroblock.
const MACROBLOCK: u32 = SQUARE as u32;
/// A code stays as it was while the light is no farther from it than so much, in 1/256. Light that
/// hardly changes costs no bits, and its noise is not seen.
const DEAD_ZONE: i32 = 192;

/// A page as codes, which change where its light does.
#[derive(Clone, Debug)]
pub(crate) struct Planes {
    packing: Packing,
    page_size: usize,
    /// Rows and columns beyond the page repeat its last.
    picture: Picture,
}

impl Packing {
    /// Width and height of the picture of a page.
    pub(crate) fn size(self, page_size: u32) -> (u32, u32) {
        let side = page_size.next_multiple_of(MACROBLOCK);
        match self {
            Self::Subsampled => (side, side),
            Self::Stacked => (side, 3 * side),
        }
    }
}

impl Planes {
    /// A dark page.
    pub(crate) fn new(packing: Packing, page_size: u32) -> Self {
        let (width, height) = packing.size(page_size);
        let picture = Picture::plain(width, height, 0, [128; 2]);
        Self { packing, page_size: page_size as usize, picture }
    }

    pub(crate) fn picture(&self) -> &Picture {
        &self.picture
    }

    /// Follows the light of some squares of a page, given row after row; whether any code has changed.
    /// `anew` takes each code as near as can be.
    pub(crate) fn follow(
        &mut self,
        page: &[Vec3],
        squares: impl Iterator<Item = [usize; 2]>,
        table: &CodeTable,
        anew: bool,
    ) -> bool {
        let dead_zone = if anew { 0 } else { DEAD_ZONE };
        let (page_size, width) = (self.page_size, self.picture.width as usize);
        let last = page_size - 1;
        let mut changed = false;
        let mut settle = |place: &mut u8, code: i32| {
            if (code - 256 * i32::from(*place)).abs() > dead_zone {
                let nearest = ((code + 128) >> 8).clamp(0, 255) as u8;
                changed |= *place != nearest;
                *place = nearest;
            }
        };
        let codes = |x: usize, y: usize| ycocg(page[y.min(last) * page_size + x.min(last)], table);
        for [columns, rows] in squares.map(|at| at.map(|at| at * SQUARE..(at + 1) * SQUARE)) {
            match self.packing {
                Packing::Subsampled => {
                    let [co, cg] = &mut self.picture.chroma;
                    for (y, x) in rows
                        .step_by(2)
                        .flat_map(|y| columns.clone().step_by(2).map(move |x| (y, x)))
                    {
                        let quad = [(x, y), (x + 1, y), (x, y + 1), (x + 1, y + 1)];
                        let quad = quad.map(|(x, y)| (y * width + x, codes(x, y)));
                        for (at, [luma, ..]) in quad {
                            settle(&mut self.picture.luma[at], luma);
                        }
                        let mean =
                            |k: usize| quad.iter().map(|(_, code)| code[k]).sum::<i32>() >> 2;
                        let at = y / 2 * (width / 2) + x / 2;
                        settle(&mut co[at], mean(1));
                        settle(&mut cg[at], mean(2));
                    }
                }
                Packing::Stacked => {
                    let plane = width * width;
                    for (y, x) in rows.flat_map(|y| columns.clone().map(move |x| (y, x))) {
                        for (k, code) in codes(x, y).into_iter().enumerate() {
                            settle(&mut self.picture.luma[k * plane + y * width + x], code);
                        }
                    }
                }
            }
        }
        changed
    }
}

/// Y, Co and Cg in 1/256.
fn ycocg(irradiance: Vec3, table: &CodeTable) -> [i32; 3] {
    let [r, g, b] = irradiance.to_array().map(|channel| i32::from(table.code(channel)));
    let grey = 128 << 8;
    [(r + 2 * g + b) >> 2, ((r - b) >> 1) + grey, ((2 * g - r - b) >> 2) + grey]
}

/// The irradiance of a page, row after row, of its picture. Chroma of half the resolution is
/// interpolated between the middles of its samples.
pub(crate) fn irradiance(
    picture: &Picture,
    packing: Packing,
    page_size: u32,
    table: &LightTable,
) -> Vec<Vec3> {
    let (page_size, width) = (page_size as usize, picture.width as usize);
    let mut light = Vec::with_capacity(page_size * page_size);
    // In 1/16.
    let rgb = |y: i32, co: i32, cg: i32| {
        let (co, cg) = (co - 128 * 16, cg - 128 * 16);
        let [r, g, b] = [y - cg + co, y + cg, y - cg - co];
        Vec3::new(table.irradiance(r), table.irradiance(g), table.irradiance(b))
    };
    match packing {
        Packing::Subsampled => {
            let half = width / 2;
            for y in 0..page_size {
                let rows = nearest_two(y, picture.height as usize / 2);
                for x in 0..page_size {
                    let columns = nearest_two(x, half);
                    let [co, cg] = [0, 1].map(|k: usize| {
                        let sample =
                            |(x, y): (usize, usize)| i32::from(picture.chroma[k][y * half + x]);
                        let [near, far] = rows
                            .map(|row| 3 * sample((columns[0], row)) + sample((columns[1], row)));
                        3 * near + far
                    });
                    let luma = i32::from(picture.luma[y * width + x]) * 16;
                    light.push(rgb(luma, co, cg));
                }
            }
        }
        Packing::Stacked => {
            let plane = width * width;
            for y in 0..page_size {
                for x in 0..page_size {
                    let [y, co, cg] =
                        [0, 1, 2].map(|k| i32::from(picture.luma[k * plane + y * width + x]) * 16);
                    light.push(rgb(y, co, cg));
                }
            }
        }
    }
    light
}

/// The chroma sample that a lumel lies in, and the one that it is nearest to beside that.
fn nearest_two(lumel: usize, samples: usize) -> [usize; 2] {
    let sample = lumel / 2;
    let beside = match lumel % 2 {
        0 => sample.saturating_sub(1),
        _ => (sample + 1).min(samples - 1),
    };
    [sample, beside]
}
