//! Charts laid out on pages.

use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;

use glam::{DVec2, UVec2};
use guillotiere::{AllocatorOptions, AtlasAllocator, size2};
use lumencast_light::{Charts, Layout, Rectangle, Surface, SurfaceId};
use lumencast_scene::LightmapSpec;
use rayon::prelude::*;

use crate::cut::{PADDING, lay_out};
use crate::error::ChartError;
use crate::sheet::Sheet;

/// Lumels a side of a page where a density is asked for.
pub const PAGE: u32 = 1024;
/// Pages of that size, at most.
pub const MOST_PAGES: u32 = 8;
/// Lumels a side of the page that scenes fill that ask for no density: the smallest of which charts cover
/// a share, or else the largest.
const USUAL: [u32; 3] = [256, 512, PAGE];
const COVERED: f64 = 0.25;
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
/// The same where only rectangles are packed.
const FINE_HALVINGS: u32 = 6;
/// Charts are packed at so many densities at most: first at this many times the one that their rectangles
/// promise room for, since more lumels are packed the more tightly, then each time lower by this.
const ATTEMPTS: u32 = 4;
const FIRST: f64 = 1.05;
const BACK: f64 = 1.025;
/// Densities below this share of the first guess are not tried.
const LEAST_SHARE: f64 = 1e-3;

/// A layout, and how it came out.
#[derive(Clone, Debug, PartialEq)]
pub struct LaidOut {
    /// Where surfaces lie.
    pub layout: Layout,
    /// Side of a lumel, metres, but on surfaces of which a chart would be larger than a page.
    pub texel: f32,
    /// The same on these surfaces: lumels are so large that the page has room for the chart.
    pub larger: BTreeMap<SurfaceId, f32>,
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
        let layout = Layout::new(size, 1, Vec::new());
        Self { layout, texel, larger: BTreeMap::new(), coarser: false }
    }

    /// Side of the lumels of a surface, metres.
    pub fn texel_of(&self, surface: SurfaceId) -> f32 {
        self.larger.get(&surface).copied().unwrap_or(self.texel)
    }
}

/// Pages to lay charts out on.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Room {
    /// Lumels a side of a page.
    pub(crate) size: u32,
    /// How many there are at most.
    pub(crate) pages: u32,
    /// Whether a surface of which a chart would be larger than a page has larger lumels.
    pub(crate) shrinks: bool,
}

impl Room {
    /// The density of a sheet, lumels a metre, where others have the one that is given.
    pub(crate) fn density_of(self, sheet: &Sheet, density: f64) -> f64 {
        if self.shrinks { density.min(sheet.densest(self.size)) } else { density }
    }

    /// Lumels of all pages.
    fn lumels(self) -> f64 {
        f64::from(self.size).powi(2) * f64::from(self.pages)
    }
}

/// Lays sheets out on pages: on one of a size, as densely as they fit, or with lumels of a size, on one
/// smaller page or up to [`MOST_PAGES`] pages of [`PAGE`]², or with the smallest lumels that fit these. There
/// a surface with a chart that would be larger than a page has larger lumels than the others.
///
/// Where nothing is asked for, lumels are a decimetre large, or as small as 7 cm where the pages which that
/// takes have room for them. What would not fill a page of 256² fills it, or a larger one where most of that
/// would lie between charts.
///
/// # Errors
/// [`ChartError::NoRoom`] where no density fits, [`ChartError::NoArea`] without sheets, and whatever the
/// unwrapper finds wrong.
pub fn laid_out(
    sheets: &[Sheet],
    spec: impl Into<Option<LightmapSpec>>,
) -> Result<LaidOut, ChartError> {
    let area: f64 = sheets.iter().map(Sheet::area).sum();
    if !(area > 0.0 && area.is_finite()) {
        return Err(ChartError::NoArea);
    }
    match spec.into() {
        Some(spec) => by_spec(sheets, area, spec),
        None => usual(sheets, area),
    }
}

/// Lays out the sheets of a scene that asks for no density: with a lumel every decimetre, or with smaller
/// ones of down to 7 cm where the pages which that takes have room for them. A scene that would not
/// fill a page of 256² fills it, or a larger one.
fn usual(sheets: &[Sheet], area: f64) -> Result<LaidOut, ChartError> {
    let charts: usize = sheets.iter().map(Sheet::charts).sum();
    let filled = (area / FILLED).sqrt() / f64::from(USUAL[0]);
    if filled < f64::from(LightmapSpec::TEXEL) {
        return by_spec(sheets, area, LightmapSpec::Size(page_for(charts)));
    }
    let usual = by_spec(sheets, area, LightmapSpec::default())?;
    if usual.coarser {
        return Ok(usual);
    }
    let Layout { page_size: size, pages, .. } = usual.layout;
    let room = Room { size, pages, shrinks: !usual.larger.is_empty() };
    let promised = roomiest(&usual, (area / charts as f64).sqrt());
    let mut density = (promised * FIRST).min(1.0 / FINEST);
    for _ in 0..ATTEMPTS {
        if density * f64::from(usual.texel) <= 1.0 {
            break;
        }
        if let Some(laid_out) = at_density(sheets, density, room)? {
            return Ok(laid_out);
        }
        density /= BACK;
    }
    Ok(usual)
}

/// The page that so many charts fill, if they are squares alike. Padding lies about each, and about as
/// much is covered in part alone.
fn page_for(charts: usize) -> u32 {
    let covered = |page: u32| {
        let side = f64::from(page) * (FILLED / charts as f64).sqrt() - f64::from(2 * PADDING);
        charts as f64 * (side.max(0.0) / f64::from(page)).powi(2)
    };
    let [.., largest] = USUAL;
    USUAL.into_iter().find(|page| covered(*page) >= COVERED).unwrap_or(largest)
}

/// The density, up to [`FINEST`], at which the pages of a layout have room for its rectangles, if these grow
/// as their charts do: their sides, but not what lies between charts. `side` is the mean of charts' sides,
/// metres.
fn roomiest(LaidOut { layout, texel, larger, .. }: &LaidOut, side: f64) -> f64 {
    let lumels = |density: f64| side * density + f64::from(PADDING);
    let least = 1.0 / f64::from(*texel);
    // Those with larger lumels do not grow.
    let sizes = layout.surfaces().iter().flat_map(|surface| {
        let grows = !larger.contains_key(&surface.id);
        surface.charts.sizes.iter().map(move |size| (size.as_dvec2(), grows))
    });
    let sizes: Vec<(DVec2, bool)> = sizes.collect();
    let fits = |density: f64| {
        let growth = lumels(density) / lumels(least);
        let grown = |(size, grows): &(DVec2, bool)| {
            (*size * if *grows { growth } else { 1.0 }).ceil().as_uvec2()
        };
        let parts = sizes.iter().flat_map(|size| tiled(grown(size), layout.page_size));
        pack(&parts.collect::<Vec<UVec2>>(), layout.page_size, layout.pages).is_some()
    };
    let (mut density, mut too_dense) = (least, 1.0 / FINEST);
    if fits(too_dense) {
        return too_dense;
    }
    for _ in 0..FINE_HALVINGS {
        let between = f64::sqrt(density * too_dense);
        if fits(between) { density = between } else { too_dense = between }
    }
    density
}

/// A rectangle in parts that are no larger than a page.
fn tiled(size: UVec2, page: u32) -> impl Iterator<Item = UVec2> {
    let along =
        move |length: u32| (0..length.div_ceil(page)).map(move |k| (length - k * page).min(page));
    along(size.y).flat_map(move |y| along(size.x).map(move |x| UVec2::new(x, y)))
}

/// See [`laid_out`]; sheets have so many square metres.
fn by_spec(sheets: &[Sheet], area: f64, spec: LightmapSpec) -> Result<LaidOut, ChartError> {
    let (room, asked) = match spec {
        LightmapSpec::Size(size) => (Room { size, pages: 1, shrinks: false }, None),
        LightmapSpec::Texel(texel) => {
            let room = Room { size: PAGE, pages: MOST_PAGES, shrinks: true };
            (room, Some(1.0 / f64::from(texel)))
        }
    };
    let mut guess = (FILLED * room.lumels() / area).sqrt();
    if let Some(asked) = asked {
        let own = sheets.iter().map(|sheet| (sheet.area(), sheet.densest(room.size)));
        let own: Vec<(f64, f64)> = own.collect();
        // Lumels that charts cover at a density.
        let needed = |density: f64| -> f64 {
            own.iter().map(|(area, densest)| area * density.min(*densest).powi(2)).sum()
        };
        if needed(asked) < 4.0 * FILLED * room.lumels() {
            let smaller = SMALLER.into_iter().filter(|size| f64::from(size * size) > needed(asked));
            let smaller = smaller.map(|size| Room { size, pages: 1, shrinks: false });
            for room in smaller.chain([room]) {
                if let Some(laid_out) = at_density(sheets, asked, room)? {
                    return Ok(laid_out);
                }
            }
        }
        while guess < asked && needed(guess * STEP) < FILLED * room.lumels() {
            guess *= STEP;
        }
        guess = guess.min(asked);
    }
    let attempt = |density| at_density(sheets, density, room);
    let (mut fits, mut least_too_dense) = (None, f64::INFINITY);
    let mut density = guess;
    while fits.is_none() || least_too_dense == f64::INFINITY {
        if density < LEAST_SHARE * guess {
            return Err(ChartError::NoRoom);
        }
        match attempt(density)? {
            Some(laid_out) => {
                fits = Some((laid_out, density));
                density *= STEP;
            }
            None => {
                least_too_dense = density;
                density /= STEP;
            }
        }
    }
    let (mut laid_out, mut density) = fits.ok_or(ChartError::NoRoom)?;
    for _ in 0..HALVINGS {
        let between = (density * least_too_dense).sqrt();
        match attempt(between)? {
            Some(denser) => (laid_out, density) = (denser, between),
            None => least_too_dense = between,
        }
    }
    Ok(LaidOut { coarser: asked.is_some_and(|asked| density < asked), ..laid_out })
}

/// The layout at a density, lumels a metre; nothing where there is no room for it.
fn at_density(sheets: &[Sheet], density: f64, room: Room) -> Result<Option<LaidOut>, ChartError> {
    let mut firsts: Vec<(&Sheet, f64)> = Vec::new();
    let mut known = HashMap::new();
    let charts_of: Vec<usize> = sheets
        .iter()
        .map(|sheet| {
            *known.entry(key(sheet)).or_insert_with(|| {
                firsts.push((sheet, room.density_of(sheet, density)));
                firsts.len() - 1
            })
        })
        .collect();
    let charts: Vec<Result<Arc<Charts>, ChartError>> = firsts
        .par_iter()
        .map(|(sheet, density)| charts(sheet, *density as f32, room.size).map(Arc::new))
        .collect();
    let mut laid: Vec<(&Sheet, Arc<Charts>)> = Vec::new();
    let mut larger = BTreeMap::new();
    for (sheet, number) in sheets.iter().zip(charts_of) {
        match &charts[number] {
            Ok(charts) => laid.push((sheet, charts.clone())),
            // A chart is larger than a page.
            Err(ChartError::NoRoom) => return Ok(None),
            Err(error) => return Err(error.clone()),
        }
        let (_, own) = firsts[number];
        if own < density {
            larger.insert(sheet.id, (1.0 / own) as f32);
        }
    }
    let texel = (1.0 / density) as f32;
    let layout = place(&laid, room.size, room.pages);
    Ok(layout.map(|layout| LaidOut { layout, texel, larger, coarser: false }))
}

/// Equal for sheets that share charts.
fn key(sheet: &Sheet) -> (usize, Option<usize>) {
    let kept = sheet.kept.as_ref().map(|kept| Arc::as_ptr(kept).cast::<u8>().addr());
    (Arc::as_ptr(&sheet.cut).addr(), kept)
}

pub(crate) fn charts(sheet: &Sheet, density: f32, most: u32) -> Result<Charts, ChartError> {
    let keep = |chart| sheet.keeps(chart);
    let mut charts = lay_out(&sheet.cut, &sheet.positions, &keep, density, most)?;
    charts.vertices.iter_mut().for_each(|vertex| vertex.source = sheet.source(vertex.source));
    Ok(charts)
}

/// Gives every rectangle a place.
fn place(laid: &[(&Sheet, Arc<Charts>)], size: u32, pages: u32) -> Option<Layout> {
    let sizes: Vec<UVec2> = laid.iter().flat_map(|(_, charts)| &charts.sizes).copied().collect();
    let (mut rectangles, pages) = pack(&sizes, size, pages)?;
    let surfaces = laid.iter().map(|(sheet, charts)| Surface {
        id: sheet.id,
        charts: charts.clone(),
        rectangles: rectangles.drain(..charts.sizes.len()).collect(),
    });
    Some(Layout::new(size, pages, surfaces.collect()))
}

/// Packs rectangles of these sizes onto pages, the tallest first. Tells where they lie, and how many pages
/// they take; nothing where there is no room.
fn pack(sizes: &[UVec2], size: u32, pages: u32) -> Option<(Vec<Rectangle>, u32)> {
    let options = AllocatorOptions { alignment: size2(ALIGNMENT, ALIGNMENT), ..Default::default() };
    let mut allocators: Vec<AtlasAllocator> = Vec::new();
    let mut open: Vec<(usize, &UVec2)> = sizes.iter().enumerate().collect();
    open.sort_by_key(|(_, size)| (std::cmp::Reverse(size.y), std::cmp::Reverse(size.x)));
    let mut places = vec![Rectangle::default(); sizes.len()];
    for (rectangle, wanted) in open {
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
        places[rectangle] =
            Rectangle { page, corner: UVec2::new(corner.x as u32, corner.y as u32) };
    }
    Some((places, allocators.len() as u32))
}
