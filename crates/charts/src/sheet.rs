//! The surfaces of a scene that lumels can lie on, cut into charts.

use std::collections::HashMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use glam::{Mat3, Vec2, Vec3};
use lumencast_light::SurfaceId;
use lumencast_scene::{Instance, Material, Mesh, Primitive, Snapshot};
use rayon::prelude::*;

use crate::cut::{Cut, Shape, cut, densest};
use crate::error::ChartError;
use crate::overlaps::overlaps;
use crate::store::{Key, Store};

/// Coordinates so far outside of [0, 1] are inside.
const BORDER: f32 = 1e-4;
/// Scales that differ by less than this share are the same, so that instances share charts.
const SCALE_STEP: f32 = 1.0 / 1024.0;
/// An instance is scaled alike in all directions if its axes differ by less than this share.
const UNIFORM: f32 = 1e-3;

/// One side of a primitive of an instance, cut into charts.
#[derive(Clone, Debug)]
pub struct Sheet {
    /// Which surface it is.
    pub id: SurfaceId,
    /// Index into the snapshot's instances.
    pub instance: usize,
    /// Its vertices, metres, in the orientation of the object or of the world.
    pub(crate) positions: Arc<[Vec3]>,
    /// The mesh that it is of.
    mesh: Arc<Mesh>,
    pub(crate) cut: Arc<Cut>,
    /// Which charts are to have lumels, by number; all unless it says so.
    pub(crate) kept: Option<Arc<[bool]>>,
}

/// The sheets of a scene, and what is to be said of the surfaces that have none.
#[derive(Clone, Debug, Default)]
pub struct Sheets {
    /// Fronts of surfaces, in the order of the snapshot's instances.
    pub sheets: Vec<Sheet>,
    /// What does not serve, by name, and why.
    pub notes: Vec<String>,
}

/// How far the cutting is, in triangles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Progress {
    /// Triangles that are cut.
    pub done: usize,
    /// All that have to be cut: those that the store has are not among them.
    pub total: usize,
}

impl Sheet {
    /// Number of its charts.
    pub fn charts(&self) -> usize {
        self.cut.charts as usize
    }

    /// Number of its triangles.
    pub fn triangle_count(&self) -> usize {
        self.cut.triangles.len()
    }

    /// The charts of its triangles, in their order; nothing for triangles without area.
    pub fn chart_of(&self, triangle: usize) -> Option<u32> {
        let [first, ..] = *self.cut.triangles.get(triangle)?;
        self.cut.vertices.get(first as usize).map(|vertex| vertex.chart)
    }

    /// The other side of it, with lumels on these charts alone.
    #[must_use]
    pub fn back(&self, charts: impl Into<Arc<[bool]>>) -> Self {
        let id = SurfaceId { back: !self.id.back, ..self.id };
        Self { id, kept: Some(charts.into()), ..self.clone() }
    }

    /// The file's number of a vertex.
    pub(crate) fn source(&self, vertex: u32) -> u32 {
        self.mesh.primitives[self.id.primitive as usize].source(vertex)
    }

    pub(crate) fn keeps(&self, chart: u32) -> bool {
        self.kept.as_ref().is_none_or(|kept| kept.get(chart as usize).copied().unwrap_or(false))
    }

    /// The density, lumels a metre, beyond which a chart of it is larger than a page of so many lumels a
    /// side.
    pub(crate) fn densest(&self, page_size: u32) -> f64 {
        densest(&self.cut, &|chart| self.keeps(chart), page_size)
    }

    /// Square metres of what is kept.
    pub(crate) fn area(&self) -> f64 {
        let kept = |triangle: &&[u32; 3]| {
            let vertex = self.cut.vertices.get(triangle[0] as usize);
            vertex.is_some_and(|vertex| self.keeps(vertex.chart))
        };
        let area = |triangle: &[u32; 3]| {
            let vertex = |v: u32| self.cut.vertices[v as usize].source as usize;
            let [a, b, c] = triangle.map(|v| self.positions[vertex(v)].as_dvec3());
            0.5 * (b - a).cross(c - a).length()
        };
        self.cut.triangles.iter().filter(kept).map(area).sum()
    }
}

/// What is cut once, however many instances show it.
struct Unique<'a> {
    instance: &'a Instance,
    primitive: usize,
    positions: Arc<[Vec3]>,
}

/// Cuts the still surfaces of a scene into charts, those on which lumels tell anything. `watch` is told
/// how far that is, from any thread, and answers whether to go on.
///
/// # Errors
/// [`ChartError::Interrupted`] where `watch` wished it to end.
pub fn sheets(
    scene: &Snapshot,
    store: Option<&Store>,
    watch: &(dyn Fn(Progress) -> bool + Sync),
) -> Result<Sheets, ChartError> {
    let mut uniques: Vec<Unique<'_>> = Vec::new();
    let mut known = HashMap::new();
    let mut surfaces = Vec::new();
    for (number, instance) in scene.instances.iter().enumerate().filter(|(_, i)| i.still) {
        for (index, primitive) in instance.mesh.primitives.iter().enumerate() {
            if !takes_lumels(primitive, &scene.materials) {
                continue;
            }
            let stretch = stretch(instance);
            let key = (Arc::as_ptr(&instance.mesh).addr(), index, bits(stretch));
            let unique = *known.entry(key).or_insert_with(|| {
                let positions = primitive.vertices.positions.iter().map(|p| stretch * *p);
                let positions = positions.collect();
                uniques.push(Unique { instance, primitive: index, positions });
                uniques.len() - 1
            });
            let (node, copy, primitive) = (instance.node.0, instance.copy, index as u32);
            let id = SurfaceId { node, copy, primitive, back: false };
            surfaces.push((number, id, unique));
        }
    }
    let (cuts, notes) = cut_all(&uniques, store, watch)?;
    let sheet = |(instance, id, unique): (usize, SurfaceId, usize)| {
        let (positions, cut) = (uniques[unique].positions.clone(), cuts[unique].clone()?);
        let mesh = scene.instances[instance].mesh.clone();
        Some(Sheet { id, instance, positions, mesh, cut, kept: None })
    };
    Ok(Sheets { sheets: surfaces.into_iter().filter_map(sheet).collect(), notes })
}

/// Whether lumels on a primitive would be seen: some have no triangles, light passes through glass, and
/// what is unlit or black shows none.
pub fn takes_lumels(primitive: &Primitive, materials: &[Material]) -> bool {
    let material = &materials[primitive.material.0 as usize];
    let is_black = material.base_color.truncate() == Vec3::ZERO;
    !primitive.triangles.is_empty() && !material.unlit && material.transmission == 0.0 && !is_black
}

/// World from object without the instance's place and, where it is scaled alike in all directions,
/// without its orientation.
fn stretch(instance: &Instance) -> Mat3 {
    let matrix = Mat3::from(instance.world_from_object.matrix3);
    let gram = matrix.transpose() * matrix;
    let squared = (gram.x_axis.x + gram.y_axis.y + gram.z_axis.z) / 3.0;
    let rest = gram - Mat3::from_diagonal(Vec3::splat(squared));
    let largest = rest.to_cols_array().into_iter().fold(0.0, |most: f32, x| most.max(x.abs()));
    if largest > UNIFORM * squared {
        return matrix;
    }
    let step = squared.sqrt().log2().floor().exp2() * SCALE_STEP;
    Mat3::from_diagonal(Vec3::splat((squared.sqrt() / step).round() * step))
}

fn bits(matrix: Mat3) -> [u32; 9] {
    matrix.to_cols_array().map(f32::to_bits)
}

type Cuts = Vec<Option<Arc<Cut>>>;

fn cut_all(
    uniques: &[Unique<'_>],
    store: Option<&Store>,
    watch: &(dyn Fn(Progress) -> bool + Sync),
) -> Result<(Cuts, Vec<String>), ChartError> {
    let mut notes = Vec::new();
    let mut cuts: Cuts = vec![None; uniques.len()];
    let mut open = Vec::new();
    for (number, unique) in uniques.iter().enumerate() {
        let primitive = &unique.instance.mesh.primitives[unique.primitive];
        let own = own_coordinates(primitive);
        if let Err(fault) = own {
            notes.push(format!(
                "{}: its second texture coordinates {fault}; it is unwrapped anew",
                unique.name()
            ));
        }
        let uv = own.ok().flatten();
        let triangles = &primitive.triangles[..];
        let has_area = triangles.iter().map(|triangle| primitive.has_area(triangle)).collect();
        let shape = Shape { positions: unique.positions.to_vec(), triangles, has_area, uv };
        let key = Key::of(&shape);
        match store.and_then(|store| store.load(key, &shape)) {
            Some(cut) => cuts[number] = Some(Arc::new(cut)),
            None => open.push((number, key, shape)),
        }
    }
    // The largest first, so that no core waits for the last one.
    open.sort_by_key(|(number, _, shape)| (std::cmp::Reverse(shape.triangles.len()), *number));
    let total = open.iter().map(|(_, _, shape)| shape.triangles.len()).sum();
    let done = AtomicUsize::new(0);
    let results: Vec<(usize, Result<Cut, ChartError>)> = open
        .par_iter()
        .map(|(number, key, shape)| {
            let seen = AtomicUsize::new(0);
            let result = cut(shape, &|triangles| {
                let more = triangles.saturating_sub(seen.fetch_max(triangles, Ordering::Relaxed));
                let done = done.fetch_add(more, Ordering::Relaxed) + more;
                watch(Progress { done: done.min(total), total })
            });
            let rest = shape.triangles.len().saturating_sub(seen.into_inner());
            done.fetch_add(rest, Ordering::Relaxed);
            if let (Ok(cut), Some(store)) = (&result, store)
                && let Err(error) = store.save(*key, cut)
            {
                let folder = store.folder().display();
                tracing::warn!("charts cannot be kept in {folder}: {error}");
            }
            (*number, result)
        })
        .collect();
    for (number, result) in results {
        match result {
            Ok(cut) => cuts[number] = Some(Arc::new(cut)),
            Err(ChartError::Interrupted) => return Err(ChartError::Interrupted),
            Err(error) => {
                notes.push(format!("{}: {error}; probes light it", uniques[number].name()));
            }
        }
    }
    Ok((cuts, notes))
}

impl Unique<'_> {
    fn name(&self) -> String {
        let Self { instance, primitive, .. } = self;
        let (id, name) = (instance.mesh_id, &instance.mesh.name);
        if name.is_empty() {
            format!("mesh {id}, primitive {primitive}")
        } else {
            format!("mesh {id} {name:?}, primitive {primitive}")
        }
    }
}

/// A primitive's second texture coordinates, if it has any that cut it into charts: within [0, 1], and
/// no two triangles over each other.
fn own_coordinates(primitive: &Primitive) -> Result<Option<&[Vec2]>, &'static str> {
    let uv = &primitive.uv[1];
    if uv.is_empty() {
        return Ok(None);
    }
    let within =
        |at: &Vec2| (*at + BORDER).cmpge(Vec2::ZERO).all() && (*at - BORDER).cmple(Vec2::ONE).all();
    if !uv.iter().all(within) {
        return Err("leave the square from 0 to 1");
    }
    let drawn = primitive.triangles.iter().filter(|triangle| primitive.has_area(triangle));
    if overlaps(drawn.map(|triangle| triangle.map(|v| uv[v as usize]))).twice > 0 {
        return Err("overlap");
    }
    Ok(Some(uv))
}
