//! Surfaces cut into charts and flattened, by `uvunwrap`.
//!
//! The library is young: what it returns is checked, and a panic in it is an error.

use std::panic::{AssertUnwindSafe, catch_unwind};

use bytemuck::{Pod, Zeroable};
use glam::{UVec2, Vec2, Vec3};
use lumencast_light::{ChartVertex, Charts};
use uvunwrap::{Atlas, Density, Error, MeshInput, Options, OutputMesh, Packing, Progress, Stage};

use crate::error::ChartError;
use crate::overlaps::overlaps;
use crate::parts::parts;

/// Charts of a primitive, at most: what has more is a cloud of splinters that fills pages with padding.
pub(crate) const MOST_CHARTS: u32 = 1 << 16;
/// Empty lumels about each chart. Filtering reads one beyond a chart's border, and chroma of half the
/// resolution another.
pub(crate) const PADDING: u32 = 2;
/// Charts begin half a lumel further in, so that borders along the axes go through lumels' middles.
const INSET: Vec2 = Vec2::splat(0.5);
/// A chart takes up to so many lumels more than it is long: it begins half a lumel further in, and in the
/// midst of one.
const ROUNDING: u32 = 3;
/// Coordinates are multiples of a part of a lumel, as they are sent.
const GRID: f32 = 256.0;
/// Lumels that charts are laid out on first. They are laid out anew at the density that is asked for:
/// here they only need to be told apart.
const FIRST_LUMELS: f64 = 65_536.0;

/// Charts of the unwrapper may overlap by this share of their area: it folds few and thin triangles, in a
/// 30,000th of the Breakfast room's.
const OVERLAPPING: f32 = 0.01;

/// A surface to cut.
#[derive(Clone, Debug)]
pub(crate) struct Shape<'a> {
    /// Metres: the object's, scaled as its instance is.
    pub(crate) positions: Vec<Vec3>,
    pub(crate) triangles: &'a [[u32; 3]],
    /// Which of them have an area; the others have no chart.
    pub(crate) has_area: Vec<bool>,
    /// Coordinates that cut it already, one a vertex.
    pub(crate) uv: Option<&'a [Vec2]>,
}

/// A surface cut into charts, each flat and free of overlaps.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Cut {
    /// Vertices; where charts part, a vertex of the surface has several.
    pub(crate) vertices: Vec<CutVertex>,
    /// As many as the surface has, in its order; [`Charts::NOWHERE`] where it has no chart.
    pub(crate) triangles: Vec<[u32; 3]>,
    /// Number of charts.
    pub(crate) charts: u32,
}

/// A vertex of a chart.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct CutVertex {
    /// The surface's vertex.
    pub(crate) source: u32,
    pub(crate) chart: u32,
    /// Metres. Charts lie apart from each other, in no order.
    pub(crate) at: Vec2,
}

/// Told how many triangles are done; answers whether to go on.
pub(crate) type Watch<'a> = &'a (dyn Fn(usize) -> bool + Sync);

impl Shape<'_> {
    /// Square metres.
    pub(crate) fn area(&self) -> f64 {
        let area = |triangle: &[u32; 3]| {
            let [a, b, c] = triangle.map(|vertex| self.positions[vertex as usize].as_dvec3());
            0.5 * (b - a).cross(c - a).length()
        };
        self.triangles.iter().map(area).sum()
    }

    /// The triangles that have an area, with their numbers.
    fn with_area(&self) -> (Vec<usize>, Vec<[u32; 3]>) {
        let triangles = self.triangles.iter().copied().enumerate();
        triangles.filter(|(number, _)| self.has_area[*number]).unzip()
    }

    /// Number of parts of these triangles that touch each other nowhere, where triangles share no position. A chart lies on
    /// one part alone.
    fn parts(&self, triangles: &[[u32; 3]]) -> u32 {
        let place = |vertex: u32| (self.positions[vertex as usize] + Vec3::ZERO).to_array();
        parts(triangles.iter().map(|triangle| triangle.map(|v| place(v).map(f32::to_bits))))
    }
}

/// Cuts a surface into charts.
pub(crate) fn cut(shape: &Shape<'_>, watch: Watch<'_>) -> Result<Cut, ChartError> {
    let area = shape.area();
    if !(area > 0.0 && area.is_finite()) {
        return Err(ChartError::NoArea);
    }
    // What has no area joins charts that do not lie beside each other.
    let (numbers, triangles) = shape.with_area();
    let parts = shape.parts(&triangles);
    if parts > MOST_CHARTS {
        return Err(ChartError::TooManyCharts { charts: parts, most: MOST_CHARTS });
    }
    let texels_per_unit = (FIRST_LUMELS / area).sqrt() as f32;
    let density = Density::Fixed { texels_per_unit, page_size: None };
    let options = Options { density, packing: Packing::Fast, padding: 1, ..Options::default() };
    let uv: Option<&[[f32; 2]]> = shape.uv.map(bytemuck::cast_slice);
    let input = MeshInput {
        existing_uvs: uv,
        ..MeshInput::new(bytemuck::cast_slice(&shape.positions), triangles.as_flattened())
    };
    let atlas = generate(input, &options, watch)?;
    if atlas.chart_count > MOST_CHARTS {
        return Err(ChartError::TooManyCharts { charts: atlas.chart_count, most: MOST_CHARTS });
    }
    let metres = UVec2::new(atlas.width, atlas.height).as_vec2() / atlas.texels_per_unit;
    let mesh = checked(&atlas, &triangles)?;
    let vertices = mesh.vertices.iter().map(|vertex| CutVertex {
        source: vertex.xref,
        chart: vertex.chart.unwrap_or(u32::MAX),
        at: Vec2::from(vertex.uv) * metres,
    });
    let vertices: Vec<CutVertex> = vertices.collect();
    let triangles = mesh.indices.as_chunks::<3>().0.iter().map(|triangle| {
        let has_chart = triangle.iter().all(|v| vertices[*v as usize].chart < atlas.chart_count);
        if has_chart { *triangle } else { Charts::NOWHERE }
    });
    let triangles = spread(numbers.into_iter().zip(triangles), shape.triangles.len());
    if uv.is_none() && overlapping(&vertices, &triangles, metres) > OVERLAPPING {
        return Err(ChartError::Unwrap("the unwrapper returned charts that overlap".into()));
    }
    // Triangles too thin for coordinates in single precision have no chart.
    if triangles.iter().all(|triangle| *triangle == Charts::NOWHERE) {
        return Err(ChartError::NoArea);
    }
    Ok(Cut { vertices, triangles, charts: atlas.chart_count })
}

/// The share of places on charts, which lie on so many metres, that belong to two triangles.
fn overlapping(vertices: &[CutVertex], triangles: &[[u32; 3]], metres: Vec2) -> f32 {
    let scale = metres.max_element().recip();
    let placed = triangles.iter().filter(|triangle| **triangle != Charts::NOWHERE);
    let corners = |triangle: &[u32; 3]| triangle.map(|v| scale * vertices[v as usize].at);
    let found = overlaps(placed.map(corners));
    found.twice as f32 / found.all.max(1) as f32
}

/// As many triangles, some of which are these, by their numbers.
fn spread(some: impl Iterator<Item = (usize, [u32; 3])>, count: usize) -> Vec<[u32; 3]> {
    let mut all = vec![Charts::NOWHERE; count];
    some.for_each(|(number, triangle)| all[number] = triangle);
    all
}

/// Lays the charts of a surface, whose vertices lie at these positions, out at a density: those that
/// `keep` names. They share one rectangle as long as no side of it is longer than `most` lumels.
pub(crate) fn lay_out(
    cut: &Cut,
    positions: &[Vec3],
    keep: &dyn Fn(u32) -> bool,
    lumels_a_metre: f32,
    most: u32,
) -> Result<Charts, ChartError> {
    let positions: Vec<Vec3> = cut.vertices.iter().map(|v| positions[v.source as usize]).collect();
    let uv: Vec<[f32; 2]> = cut.vertices.iter().map(|v| v.at.to_array()).collect();
    let kept = |triangle: &[u32; 3]| {
        *triangle != Charts::NOWHERE && keep(cut.vertices[triangle[0] as usize].chart)
    };
    let (kept, triangles): (Vec<usize>, Vec<[u32; 3]>) =
        cut.triangles.iter().copied().enumerate().filter(|(_, t)| kept(t)).unzip();
    if triangles.is_empty() {
        return Err(ChartError::NoArea);
    }
    let input = MeshInput {
        existing_uvs: Some(&uv),
        ..MeshInput::new(bytemuck::cast_slice(&positions), triangles.as_flattened())
    };
    let pack = |page_size| {
        let density = Density::Fixed { texels_per_unit: lumels_a_metre, page_size };
        let options =
            Options { density, packing: Packing::Fast, padding: PADDING, ..Options::default() };
        generate(input, &options, &|_| true)
    };
    // What is set in by half a lumel ends in the next one.
    let most = most - 1;
    let mut atlas = pack(None)?;
    if atlas.width.max(atlas.height) > most {
        atlas = pack(Some(most))?;
    }
    let mesh = checked(&atlas, &triangles)?;
    let page = Vec2::new(atlas.width as f32, atlas.height as f32);
    let vertices = mesh.vertices.iter().map(|vertex| ChartVertex {
        source: cut.vertices[vertex.xref as usize].source,
        rectangle: vertex.page.unwrap_or(0),
        at: (GRID * (Vec2::from(vertex.uv) * page + INSET)).round() / GRID,
    });
    let vertices: Vec<ChartVertex> = vertices.collect();
    // Pages are as large as they may be, whatever lies on them.
    let mut sizes = vec![UVec2::ZERO; atlas.page_count.max(1) as usize];
    for vertex in &vertices {
        let size = &mut sizes[vertex.rectangle as usize];
        *size = size.max(vertex.at.ceil().as_uvec2() + PADDING);
    }
    let placed = kept.into_iter().zip(mesh.indices.as_chunks::<3>().0.iter().copied());
    Ok(Charts { sizes, vertices, triangles: spread(placed, cut.triangles.len()) })
}

/// The density, lumels a metre, beyond which one of the charts that `keep` names is longer than `most`
/// lumels, with its padding.
pub(crate) fn densest(cut: &Cut, keep: &dyn Fn(u32) -> bool, most: u32) -> f64 {
    let mut bounds = vec![(Vec2::INFINITY, Vec2::NEG_INFINITY); cut.charts as usize];
    for CutVertex { chart, at, .. } in &cut.vertices {
        if let Some((low, high)) = bounds.get_mut(*chart as usize) {
            (*low, *high) = (low.min(*at), high.max(*at));
        }
    }
    let kept = bounds.iter().zip(0..).filter(|(_, chart)| keep(*chart));
    let sides = kept.map(|((low, high), _)| f64::from((*high - *low).max_element()));
    let longest = sides.fold(0.0, f64::max);
    f64::from(most.saturating_sub(ROUNDING + 2 * PADDING).max(1)) / longest
}

/// Calls the library.
fn generate(
    input: MeshInput<'_>,
    options: &Options,
    watch: Watch<'_>,
) -> Result<Atlas, ChartError> {
    let progress = |progress: Progress| {
        watch(if progress.stage == Stage::Parameterizing { progress.done } else { 0 })
    };
    let run = || uvunwrap::generate_with_progress(&[input], options, progress);
    match catch_unwind(AssertUnwindSafe(run)) {
        Ok(Ok(atlas)) => Ok(atlas),
        Ok(Err(Error::Cancelled)) => Err(ChartError::Interrupted),
        Ok(Err(Error::ChartTooLarge { .. } | Error::AtlasTooLarge { .. })) => {
            Err(ChartError::NoRoom)
        }
        Ok(Err(error)) => Err(ChartError::Unwrap(error.to_string())),
        Err(_) => Err(ChartError::Unwrap("the unwrapper panicked".into())),
    }
}

/// The only mesh of an atlas, if it has the triangles that were asked for, in their order.
fn checked<'a>(atlas: &'a Atlas, triangles: &[[u32; 3]]) -> Result<&'a OutputMesh, ChartError> {
    let wrong = |what: &str| ChartError::Unwrap(format!("the unwrapper returned {what}"));
    let [mesh] = &atlas.meshes[..] else { return Err(wrong("no mesh")) };
    if mesh.indices.len() != 3 * triangles.len() {
        return Err(wrong("another number of triangles"));
    }
    let source = |index: &u32| mesh.vertices.get(*index as usize).map(|vertex| vertex.xref);
    if !mesh.indices.iter().map(source).eq(triangles.as_flattened().iter().map(|v| Some(*v))) {
        return Err(wrong("other triangles"));
    }
    let is_sound = |vertex: &uvunwrap::OutputVertex| {
        vertex.uv.iter().all(|c| (0.0..=1.0).contains(c))
            && vertex.page.unwrap_or(0) < atlas.page_count.max(1)
            && vertex.chart.is_none_or(|chart| chart < atlas.chart_count)
    };
    if !mesh.vertices.iter().all(is_sound) {
        return Err(wrong("coordinates out of range"));
    }
    Ok(mesh)
}

#[cfg(test)]
mod tests {
    use super::*;

    const POSITIONS: [[f32; 3]; 4] =
        [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
    const TRIANGLES: [[u32; 3]; 2] = [[0, 1, 2], [0, 2, 3]];

    /// What the library makes of a square.
    fn square() -> Atlas {
        let input = MeshInput::new(&POSITIONS, TRIANGLES.as_flattened());
        let density = Density::Fixed { texels_per_unit: 8.0, page_size: None };
        generate(input, &Options { density, ..Options::default() }, &|_| true).unwrap()
    }

    #[test]
    fn wrong_atlases_are_refused() {
        let changed = |change: &dyn Fn(&mut Atlas)| {
            let mut atlas = square();
            change(&mut atlas);
            checked(&atlas, &TRIANGLES).map(drop)
        };
        assert_eq!(changed(&|_| ()), Ok(()));
        let wrong: [&dyn Fn(&mut Atlas); 9] = [
            &|a| a.meshes.clear(),
            &|a| a.meshes.push(OutputMesh::default()),
            &|a| a.meshes[0].indices.truncate(3),
            &|a| a.meshes[0].indices.swap(0, 1),
            &|a| a.meshes[0].indices[4] = 99,
            &|a| a.meshes[0].vertices[1].uv = [0.5, 1.5],
            &|a| a.meshes[0].vertices[1].uv = [f32::NAN; 2],
            &|a| a.meshes[0].vertices[2].page = Some(7),
            &|a| a.meshes[0].vertices[2].chart = Some(7),
        ];
        for (number, change) in wrong.iter().enumerate() {
            assert!(matches!(changed(change), Err(ChartError::Unwrap(_))), "{number}");
        }
    }

    #[test]
    fn overlaps_are_told_by_their_share() {
        let at = |x: f32, y: f32| CutVertex { source: 0, chart: 0, at: Vec2::new(x, y) };
        let vertices =
            [(0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (0.0, 4.0), (4.0, 2.0)].map(|(x, y)| at(x, y));
        let share = |triangles: &[[u32; 3]]| overlapping(&vertices, triangles, Vec2::splat(4.0));
        assert_eq!(share(&[[0, 1, 2], [0, 2, 3], Charts::NOWHERE]), 0.0);
        let half = share(&[[0, 1, 2], [0, 1, 4]]);
        assert!((half - 0.5).abs() < 0.02, "{half}");
    }

    #[test]
    fn panics_are_errors() {
        let watch = |_: usize| -> bool { panic!("as the library may") };
        let input = MeshInput::new(&POSITIONS, TRIANGLES.as_flattened());
        let found = generate(input, &Options::default(), &watch);
        assert!(matches!(found, Err(ChartError::Unwrap(_))), "{found:?}");
    }
}
