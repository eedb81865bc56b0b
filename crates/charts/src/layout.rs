//! Charts laid out on pages.

use std::collections::HashMap;
use std::sync::Arc;

use glam::UVec2;
use guillotiere::{AllocatorOptions, AtlasAllocator, size2};
use lumencast_light::{Charts, Layout, Rectangle, Surface};
use lumencast_scene::LightmapSpec;
use rayon::prelude::*;

use crate::cut::{Shape, lay_out};
use crate::error::ChartError;
use crate::sheet::Sheet;

/// Lumels a side of a page where a density is asked for.
pub const PAGE: u32 = 1024;
/// Pages of that size, at most.
pub const MOST_PAGES: u32 = 8;
/// Lumels a side of the page that scenes fill that ask for no density, at least.
const USUAL: u32 = 256;
/// Side of the smallest lumels that larger scenes get which ask for no density, metres. Light of twice as
/// many lumels takes twice as long to compute.
const FINEST: f64 = 0.07;
/// Sides of smaller pages, on one of which little scenes fit.
const SMALLER: [u32; 3] = [128, 256, 512];
/// Side of a page that nothing lies on yet.
const EMPTY: u32 = 512;
/// Rectangles begin at multiples of this, so that no block of a codec's transform belongs to two.
pub(crate) const ALIGNMENT: i32 = 4;
/// Share of a page that charts fill, about: the first guess.
const FILLED: f64 = 0.6;
/// By how much a density is changed until it fits, or until it no longer does.
const STEP: f64 = 1.15;
/// Halvings of what is left of that step.
const HALVINGS: u32 = 3;
/// Densities below this share of the first guess are not tried.
const LEAST_SHARE: f64 = 1e-3;

/// A layout, and how it came out.
#[derive(Clone, Debug, PartialEq)]
pub struct LaidOut {
    /// Where surfaces lie.
    pub layout: Layout,
    /// Side of a lumel, metres.
    pub texel: f32,
    /// Whether lumels are larger than they were asked for, since there are only so many pages.
    pub coarser: bool,
}

impl LaidOut {
    /// A page that no surface lies on, for those that come later: of the size that is asked for, or
    /// with room for lumels of that size.
    pub fn empty(spec: LightmapSpec) -> Self {
        let (size, texel) = match spec {
            LightmapSpec::Size(size) => (size, LightmapSpec::TEXEL),
            LightmapSpec::Texel(texel) => (EMPTY, texel),
        };
        Self { layout: Layout::new(size, 1, Vec::new()), texel, coarser: false }
    }
}

/// Lays out the sheets of a scene that asks for no density: with a lumel every decimetre, or with smaller
/// ones of down to 7 cm where the pages which that takes have room for them. A scene that would not
/// fill a page of 256² fills it.
///
/// # Errors
/// As [`laid_out`].
pub fn usual(sheets: &[Sheet]) -> Result<LaidOut, ChartError> {
    let filled = (area(sheets) / FILLED).sqrt() / f64::from(USUAL);
    if filled < f64::from(LightmapSpec::TEXEL) {
        return laid_out(sheets, LightmapSpec::Size(USUAL));
    }
    let usual = laid_out(sheets, LightmapSpec::default())?;
    if usual.coarser {
        return Ok(usual);
    }
    let Layout { page_size, pages, .. } = usual.layout;
    let attempt = |density| at_density(sheets, density, page_size, pages);
    let (layout, density) = match attempt(1.0 / FINEST)? {
        Some(layout) => (layout, 1.0 / FINEST),
        None => densest((usual.layout, 1.0 / f64::from(usual.texel)), 1.0 / FINEST, &attempt)?,
    };
    Ok(LaidOut { layout, texel: (1.0 / density) as f32, coarser: false })
}

/// Square metres.
fn area(sheets: &[Sheet]) -> f64 {
    sheets.iter().map(Sheet::area).sum()
}

/// Lays sheets out on pages: on one of a size, as densely as they fit, or with lumels of a size, on one
/// smaller page or up to [`MOST_PAGES`] pages of [`PAGE`]², or with the smallest lumels that fit these.
///
/// # Errors
/// [`ChartError::NoRoom`] where no density fits, [`ChartError::NoArea`] without sheets, and whatever the
/// unwrapper finds wrong.
pub fn laid_out(sheets: &[Sheet], spec: LightmapSpec) -> Result<LaidOut, ChartError> {
    let area = area(sheets);
    if !(area > 0.0 && area.is_finite()) {
        return Err(ChartError::NoArea);
    }
    let (pages, size, asked) = match spec {
        LightmapSpec::Size(size) => (1, size, None),
        LightmapSpec::Texel(texel) => (MOST_PAGES, PAGE, Some(1.0 / f64::from(texel))),
    };
    let lumels = f64::from(size) * f64::from(size) * f64::from(pages);
    let guess = (FILLED * lumels / area).sqrt();
    let attempt = |density| at_density(sheets, density, size, pages);
    let done = |layout, density: f64| {
        let coarser = asked.is_some_and(|asked| density < asked);
        Ok(LaidOut { layout, texel: (1.0 / density) as f32, coarser })
    };
    if let Some(asked) = asked.filter(|asked| *asked < 2.0 * guess) {
        let needed = asked * asked * area;
        let smaller = SMALLER.into_iter().filter(|size| f64::from(size * size) > needed);
        for (size, pages) in smaller.map(|size| (size, 1)).chain([(size, pages)]) {
            if let Some(layout) = at_density(sheets, asked, size, pages)? {
                return done(layout, asked);
            }
        }
    }
    let (mut fits, mut least_too_dense) = (None, f64::INFINITY);
    let mut density = asked.map_or(guess, |asked| asked.min(guess));
    while fits.is_none() || least_too_dense == f64::INFINITY {
        if density < LEAST_SHARE * guess {
            return Err(ChartError::NoRoom);
        }
        match attempt(density)? {
            Some(layout) => {
                fits = Some((layout, density));
                density *= STEP;
            }
            None => {
                least_too_dense = density;
                density /= STEP;
            }
        }
    }
    let (layout, density) = densest(fits.ok_or(ChartError::NoRoom)?, least_too_dense, &attempt)?;
    done(layout, density)
}

/// The densest layout that is found between one that fits and a density at which none does.
fn densest(
    (mut layout, mut density): (Layout, f64),
    mut too_dense: f64,
    attempt: &dyn Fn(f64) -> Result<Option<Layout>, ChartError>,
) -> Result<(Layout, f64), ChartError> {
    for _ in 0..HALVINGS {
        let between = (density * too_dense).sqrt();
        match attempt(between)? {
            Some(denser) => (layout, density) = (denser, between),
            None => too_dense = between,
        }
    }
    Ok((layout, density))
}

/// The layout at a density, lumels a metre; nothing where the pages have no room for it.
fn at_density(
    sheets: &[Sheet],
    density: f64,
    size: u32,
    pages: u32,
) -> Result<Option<Layout>, ChartError> {
    let mut firsts: Vec<&Sheet> = Vec::new();
    let mut known = HashMap::new();
    let charts_of: Vec<usize> = sheets
        .iter()
        .map(|sheet| {
            *known.entry(key(sheet)).or_insert_with(|| {
                firsts.push(sheet);
                firsts.len() - 1
            })
        })
        .collect();
    let charts: Vec<Result<Arc<Charts>, ChartError>> =
        firsts.par_iter().map(|sheet| charts(sheet, density as f32, size).map(Arc::new)).collect();
    let mut laid: Vec<(&Sheet, Arc<Charts>)> = Vec::new();
    for (sheet, number) in sheets.iter().zip(charts_of) {
        match &charts[number] {
            Ok(charts) => laid.push((sheet, charts.clone())),
            // A chart is larger than a page.
            Err(ChartError::NoRoom) => return Ok(None),
            Err(error) => return Err(error.clone()),
        }
    }
    Ok(place(&laid, size, pages))
}

/// Equal for sheets that share charts.
fn key(sheet: &Sheet) -> (usize, Option<usize>) {
    let kept = sheet.kept.as_ref().map(|kept| Arc::as_ptr(kept).cast::<u8>().addr());
    (Arc::as_ptr(&sheet.cut).addr(), kept)
}

pub(crate) fn charts(sheet: &Sheet, density: f32, most: u32) -> Result<Charts, ChartError> {
    let shape = Shape { positions: sheet.positions.to_vec(), triangles: &[], uv: None };
    lay_out(&sheet.cut, &shape, &|chart| sheet.keeps(chart), density, most)
}

/// Gives every rectangle a place, the tallest first.
fn place(laid: &[(&Sheet, Arc<Charts>)], size: u32, pages: u32) -> Option<Layout> {
    let options = AllocatorOptions { alignment: size2(ALIGNMENT, ALIGNMENT), ..Default::default() };
    let mut allocators: Vec<AtlasAllocator> = Vec::new();
    let mut open: Vec<(usize, usize, UVec2)> = Vec::new();
    let mut places: Vec<Vec<Rectangle>> = Vec::new();
    for (surface, (_, charts)) in laid.iter().enumerate() {
        places.push(vec![Rectangle::default(); charts.sizes.len()]);
        open.extend(charts.sizes.iter().enumerate().map(|(r, size)| (surface, r, *size)));
    }
    open.sort_by_key(|(_, _, size)| (std::cmp::Reverse(size.y), std::cmp::Reverse(size.x)));
    for (surface, rectangle, wanted) in open {
        let wanted = size2(wanted.x as i32, wanted.y as i32);
        let mut found = allocators.iter_mut().zip(0..).find_map(|(page, number)| {
            page.allocate(wanted).map(|allocation| (number, allocation.rectangle.min))
        });
        if found.is_none() && (allocators.len() as u32) < pages {
            let mut page = AtlasAllocator::with_options(size2(size as i32, size as i32), &options);
            let number = allocators.len() as u32;
            found = page.allocate(wanted).map(|allocation| (number, allocation.rectangle.min));
            allocators.push(page);
        }
        let (page, corner) = found?;
        let corner = UVec2::new(corner.x as u32, corner.y as u32);
        places[surface][rectangle] = Rectangle { page, corner };
    }
    let surfaces = laid.iter().zip(places).map(|((sheet, charts), rectangles)| Surface {
        id: sheet.id,
        charts: charts.clone(),
        rectangles,
    });
    Some(Layout::new(size, allocators.len() as u32, surfaces.collect()))
}
