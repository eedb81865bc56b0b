//! First hits of camera rays, found without a walk through a tree.
//!
//! Camera rays all start at one point, so two coordinates tell what a ray may meet
//! ([`super::cells`]). Weghorst, Hooper and Greenberg 1984, "Improved Computational Methods for Ray
//! Tracing", call this an item buffer. A cell is about a pixel; most list the one or two blocks
//! that are seen there.
//!
//! Coordinates are the camera's, divided by the depth; a height is 1 over the depth. In them planes
//! stay planes and the nearest surfaces are the highest. So what holds for parallel rays holds for
//! these.

use glam::Vec3;

use super::cells::{AHEAD, Cells, Flat, Listed, Margins, Shape, corners};
use super::kernel::Kernel;
use super::triangle_bvh::Block;
use super::walk::{Setup, TriangleHits, nearest};
use super::{Accel, Hit, Ray, fetch_ahead};

/// Triangles nearer to the eye than this share of the scene's size are listed for all cells.
const NEAR: f64 = 1e-4;
/// Upper limit of the number of cells. Where there are more pixels, some share a cell.
const CELLS: f64 = (1 << 21) as f64;
/// Tolerance of distances: a block that begins beyond the nearest hit by less than this factor is
/// still tested.
const FARTHER: f32 = 1.0 + 1e-5;

/// The rays of a picture, from one point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pyramid {
    /// Origin of all rays, metres.
    pub(crate) eye: Vec3,
    /// Unit vectors to the right, up and ahead; they need not be orthogonal.
    pub(crate) axes: [Vec3; 3],
    /// Greatest extent of the rays to the right and up, for one unit ahead.
    pub(crate) half: [f32; 2],
    /// Size of a pixel, one unit ahead: rays that differ by less may share a cell.
    pub(crate) pixel: f32,
}

/// The surfaces seen from a point.
#[derive(Debug)]
pub(crate) struct ItemBuffer {
    eye: Vec3,
    axes: [Vec3; 3],
    cells: Cells,
}

impl ItemBuffer {
    /// Builds the buffer for the rays of a pyramid. `is_opaque` tells whether the triangles of a
    /// primitive (instance, primitive) stop every ray. `None` where the structure is not a single
    /// hierarchy in the world, or is empty.
    pub(crate) fn new(
        accel: &Accel,
        pyramid: &Pyramid,
        is_opaque: impl Fn(u32, u32) -> bool + Sync,
    ) -> Option<Self> {
        let half = pyramid.half.map(f64::from);
        let pixel = f64::from(pyramid.pixel);
        // This bounds a few roundings of a unit direction, divided by its component ahead.
        let share = 32.0 * f64::from(f32::EPSILON);
        let aside = share * (1.0 + half[0] + half[1]).powi(2);
        let margins = Margins { aside, beside: 0.0, above: 0.0, share };
        let rectangle = Flat { low: half.map(|v| -v), high: half }.grown(4.0 * aside);
        let count = (4.0 * half[0] * half[1] / (pixel * pixel)).min(CELLS);
        let bounds = accel.bounds();
        let camera = Camera {
            eye: pyramid.eye.to_array().map(f64::from),
            axes: pyramid.axes.map(|axis| axis.to_array().map(f64::from)),
            near: NEAR * f64::from((bounds.max - bounds.min).length()),
            rectangle,
        };
        let shape = |block: &Block, lane: usize| camera.shape(corners(block, lane));
        let cells = Cells::over(accel, &rectangle, count, margins, shape, is_opaque)?;
        let Pyramid { eye, axes, .. } = *pyramid;
        Some(Self { eye, axes, cells })
    }

    #[cfg(test)]
    pub(super) fn cell_count(&self) -> usize {
        self.cells.count()
    }

    /// The instruction set that its rays are tested with.
    pub(super) fn kernel(&self) -> Kernel {
        self.cells.kernel
    }

    /// [`Self::closest`] with a given block test. Each step is taken for several rays before the
    /// next step, so that prefetches have time to arrive.
    #[inline(always)]
    pub(super) fn closest_with<T: Copy>(
        &self,
        mut rays: impl Iterator<Item = (Ray, T)>,
        accept: impl Fn(&T, &Hit) -> bool,
        mut found: impl FnMut(T, Option<Hit>),
        mut undecided: impl FnMut(Ray, T),
        triangles: impl Fn(&Block, &Setup, f32) -> TriangleHits,
    ) {
        let mut queries: Vec<Query<T>> = Vec::with_capacity(AHEAD);
        loop {
            queries.extend(rays.by_ref().take(AHEAD).map(|(ray, with)| self.query(ray, with)));
            if queries.is_empty() {
                return;
            }
            for query in &mut queries {
                self.look_up(query);
            }
            for query in queries.drain(..) {
                let is_listed = !query.listed.first().is_some_and(Listed::is_too_many);
                let hit = is_listed.then(|| self.first_met(&query, &accept, &triangles)).flatten();
                // A ray that misses the triangle that covers its cell is left to the hierarchy.
                if hit.is_some() || is_listed && !query.covered {
                    found(query.with, hit);
                } else {
                    undecided(query.ray, query.with);
                }
            }
        }
    }

    /// Prefetches the cell that a ray goes through.
    #[inline(always)]
    fn query<T>(&self, ray: Ray, with: T) -> Query<'_, T> {
        let [x, y, z] = self.axes.map(|axis| axis.dot(ray.direction));
        // Rays from another origin have no cell. Neither have rays that go backwards or end.
        let is_seen = ray.origin == self.eye && z > 0.0 && ray.t_max == f32::INFINITY;
        let at = if is_seen { [x / z, y / z] } else { [f32::NAN; 2] };
        Query { with, ray, depth: z, cell: self.cells.find(at), covered: false, listed: &[] }
    }

    /// Gives the query the list of its cell, and prefetches the list's first block.
    #[inline(always)]
    fn look_up<'a, T>(&'a self, query: &mut Query<'a, T>) {
        let over = self.cells.look_up(query.cell);
        query.listed = over.as_ref().map_or(&[Listed::TOO_MANY], |over| over.listed);
        query.covered = over.is_some_and(|over| over.covered_below > f32::NEG_INFINITY);
        if let Some(block) =
            query.listed.first().and_then(|l| self.cells.bvh.blocks.get(l.block as usize))
        {
            fetch_ahead(block);
        }
    }

    /// The nearest hit among the listed blocks.
    #[inline(always)]
    fn first_met<T>(
        &self,
        query: &Query<'_, T>,
        accept: &impl Fn(&T, &Hit) -> bool,
        triangles: &impl Fn(&Block, &Setup, f32) -> TriangleHits,
    ) -> Option<Hit> {
        let Query { ray, listed, .. } = query;
        let setup = Setup::new(ray.origin.into(), ray.direction.into());
        let mut t_max = f32::INFINITY;
        let mut best = None;
        for listed in *listed {
            // All remaining blocks are farther away.
            if best.is_some() && listed.height * query.depth * t_max * FARTHER < 1.0 {
                break;
            }
            let block = &self.cells.bvh.blocks[listed.block as usize];
            let hits = triangles(block, &setup, t_max);
            if hits.mask == 0 {
                continue;
            }
            if let Some(hit) =
                nearest(block, self.cells.instance, hits, |hit| accept(&query.with, hit))
            {
                t_max = hit.t;
                best = Some(hit);
            }
        }
        best
    }
}

/// A ray on its way through the steps of a lookup.
struct Query<'a, T> {
    with: T,
    ray: Ray,
    /// Increase of depth for each unit of t.
    depth: f32,
    cell: usize,
    /// Whether an opaque triangle covers the cell.
    covered: bool,
    /// Blocks seen through the cell, the nearest first.
    listed: &'a [Listed],
}

/// The projection of triangles.
struct Camera {
    eye: [f64; 3],
    axes: [[f64; 3]; 3],
    /// The part of a triangle nearer than this depth is not projected.
    near: f64,
    rectangle: Flat,
}

impl Camera {
    /// Coordinates of a point to the right, up and ahead, relative to the eye.
    fn seen(&self, point: [f64; 3]) -> [f64; 3] {
        let [x, y, z] = [0, 1, 2].map(|axis| point[axis] - self.eye[axis]);
        self.axes.map(|axis| axis[0] * x + axis[1] * y + axis[2] * z)
    }

    fn projected([x, y, z]: [f64; 3]) -> [f64; 3] {
        let height = 1.0 / z;
        [x * height, y * height, height]
    }

    /// The projection of a triangle; `None` behind the eye.
    fn shape(&self, corners: [[f64; 3]; 3]) -> Option<Shape> {
        let corners = corners.map(|corner| self.seen(corner));
        let nearest = corners.iter().fold(f64::INFINITY, |nearest, p| nearest.min(p[2]));
        if nearest >= self.near {
            return Some(Shape::new(corners.map(Self::projected)));
        }
        let behind = clipped(&clipped(&corners, 0.0, 1.0), self.near, -1.0);
        let rays = Flat {
            low: self.rectangle.low.map(|v| v * self.near),
            high: self.rectangle.high.map(|v| v * self.near),
        };
        if Flat::around(behind.iter().copied()).meets(&rays) {
            return Some(Shape::anywhere(&self.rectangle));
        }
        let ahead = clipped(&corners, self.near, 1.0);
        let points: Vec<_> = ahead.into_iter().map(Self::projected).collect();
        let (&[a, b, c], rest) = points.split_first_chunk()?;
        Some(Shape::rest([a, b, c, *rest.first().unwrap_or(&c)], plane(corners)))
    }
}

/// Slopes of 1 over the depth, across the plane through three points.
fn plane([a, b, c]: [[f64; 3]; 3]) -> [f64; 2] {
    let from_first = |p: [f64; 3]| [0, 1, 2].map(|k| p[k] - a[k]);
    let ([bx, by, bz], [cx, cy, cz]) = (from_first(b), from_first(c));
    let normal = [by * cz - bz * cy, bz * cx - bx * cz, bx * cy - by * cx];
    let distance: f64 = (0..3).map(|k| normal[k] * a[k]).sum();
    [normal[0] / distance, normal[1] / distance]
}

/// The part of a convex polygon whose depth is at least `depth`, or at most where `sign` is −1.
fn clipped(polygon: &[[f64; 3]], depth: f64, sign: f64) -> Vec<[f64; 3]> {
    let above = |point: &[f64; 3]| sign * (point[2] - depth);
    let mut kept = Vec::with_capacity(polygon.len() + 1);
    for (n, point) in polygon.iter().enumerate() {
        let next = &polygon[(n + 1) % polygon.len()];
        if above(point) >= 0.0 {
            kept.push(*point);
        }
        if (above(point) < 0.0) != (above(next) < 0.0) {
            let share = above(point) / (above(point) - above(next));
            let [x, y] = [0, 1].map(|k| point[k] + share * (next[k] - point[k]));
            kept.push([x, y, depth]);
        }
    }
    kept
}
