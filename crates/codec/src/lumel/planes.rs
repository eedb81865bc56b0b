//! A page of lumels as a picture: codes of red, green and blue become Y, Co and Cg.
//!
//! Y = (r + 2g + b) / 4, Co = (r − b) / 2 + 128, Cg = (2g − r − b) / 4 + 128; back: g = Y + (Cg − 128),
//! r = Y − (Cg − 128) + (Co − 128), b = Y − (Cg − 128) − (Co − 128).

use glam::Vec3;
use lumencast_video::Picture;

use super::mapping::{CodeTable, LightTable};

/// Where the three planes of a page lie in a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Packing {
    /// Y as luma, Co and Cg as chroma of half the resolution.
    Subsampled,
    /// Y, Co and Cg as luma, below each other; the chroma is grey.
    Stacked,
}

/// Sides of pictures are multiples of this, H.264's macroblock.
const BLOCK: u32 = 16;
/// A code stays as it was while the light is no farther from it than so much, in 1/256. Light that
/// hardly changes costs no bits, and its noise is not seen.
const DEAD_ZONE: i32 = 192;
/// A block changes much where the squares of its codes' changes sum up to this: half a code at every
/// lumel, or eight codes at one.
const MUCH: i32 = 64;

/// A page as codes, which change where its light does.
#[derive(Clone, Debug)]
pub(crate) struct Planes {
    packing: Packing,
    page_size: usize,
    /// Rows and columns beyond the page repeat its last.
    picture: Picture,
}

/// Which codes follow their light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Take {
    /// All, as near as can be.
    Anew,
    /// All from which light is farther than the dead zone.
    All,
    /// Those of them that lie in blocks which change much.
    Much,
}

/// What became of codes that were to follow their light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Followed {
    /// Some have changed.
    pub(crate) changed: bool,
    /// Some would have changed, but that their block changes little.
    pub(crate) waits: bool,
}

/// Codes of a block that are to change: their places in a plane, and what they become.
#[derive(Default)]
struct Changes {
    luma: Vec<(usize, u8)>,
    chroma: [Vec<(usize, u8)>; 2],
    squares: i32,
}

impl Packing {
    /// Width and height of the picture of a page.
    pub(crate) fn size(self, page_size: u32) -> (u32, u32) {
        let side = page_size.next_multiple_of(BLOCK);
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

    /// Follows a page's light, row after row.
    pub(crate) fn follow(&mut self, page: &[Vec3], table: &CodeTable, take: Take) -> Followed {
        let side = self.picture.width;
        let block = BLOCK as usize;
        let mut followed = Followed::default();
        let mut changes = Changes::default();
        for y in (0..side as usize).step_by(block) {
            for x in (0..side as usize).step_by(block) {
                self.compare((x, y), page, table, take, &mut changes);
                let is_taken = take != Take::Much || changes.squares >= MUCH;
                let is_any = changes.squares > 0;
                followed.changed |= is_any && is_taken;
                followed.waits |= is_any && !is_taken;
                changes.drain(is_taken.then_some(&mut self.picture));
            }
        }
        followed
    }

    /// Finds the codes of a block that are to change.
    fn compare(
        &self,
        (left, top): (usize, usize),
        page: &[Vec3],
        table: &CodeTable,
        take: Take,
        changes: &mut Changes,
    ) {
        let dead_zone = if take == Take::Anew { 0 } else { DEAD_ZONE };
        let (width, last) = (self.picture.width as usize, self.page_size - 1);
        let codes =
            |x: usize, y: usize| ycocg(page[y.min(last) * self.page_size + x.min(last)], table);
        let mut squares = 0;
        let mut compare = |plane: &[u8], changed: &mut Vec<(usize, u8)>, at: usize, code: i32| {
            let before = i32::from(plane[at]);
            let nearest = ((code + 128) >> 8).clamp(0, 255);
            if (code - 256 * before).abs() > dead_zone && nearest != before {
                squares += (nearest - before).pow(2);
                changed.push((at, nearest as u8));
            }
        };
        let Picture { luma, chroma, .. } = &self.picture;
        let [xs, ys] = [left..left + BLOCK as usize, top..top + BLOCK as usize];
        match self.packing {
            Packing::Subsampled => {
                for y in ys.step_by(2) {
                    for x in xs.clone().step_by(2) {
                        let quad = [(x, y), (x + 1, y), (x, y + 1), (x + 1, y + 1)];
                        let quad = quad.map(|(x, y)| (y * width + x, codes(x, y)));
                        for (at, [code, ..]) in quad {
                            compare(luma, &mut changes.luma, at, code);
                        }
                        let mean =
                            |k: usize| quad.iter().map(|(_, code)| code[k]).sum::<i32>() >> 2;
                        let at = y / 2 * (width / 2) + x / 2;
                        for (k, plane) in chroma.iter().enumerate() {
                            compare(plane, &mut changes.chroma[k], at, mean(1 + k));
                        }
                    }
                }
            }
            Packing::Stacked => {
                let plane = width * width;
                for y in ys {
                    for x in xs.clone() {
                        for (k, code) in codes(x, y).into_iter().enumerate() {
                            compare(luma, &mut changes.luma, k * plane + y * width + x, code);
                        }
                    }
                }
            }
        }
        changes.squares = squares;
    }
}

impl Changes {
    /// Makes the changes in a picture, if there is one, and forgets them.
    fn drain(&mut self, picture: Option<&mut Picture>) {
        if let Some(Picture { luma, chroma, .. }) = picture {
            let [co, cg] = chroma;
            let planes = [(luma, &self.luma), (co, &self.chroma[0]), (cg, &self.chroma[1])];
            for (plane, changes) in planes {
                changes.iter().for_each(|(at, code)| plane[*at] = *code);
            }
        }
        self.luma.clear();
        self.chroma.iter_mut().for_each(Vec::clear);
        self.squares = 0;
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
