//! Seams: where the charts of a smooth surface meet, both sides get the same light.
//!
//! Both sides of such an edge are read from lumels of their own. Lumels about seams are changed as
//! little as possible so that what is read on both sides is equal (Iwanicki 2013, "Lighting Technology
//! of The Last of Us", by least squares): of all x with a·x = b·x, at points of edges that a and b read,
//! and x ≥ 0, about that which minimises Σ m (x − d)², over lumels that were d. Lumels without light of
//! their own yield first. Projections onto one condition after another find it (Kaczmarz 1937): each is
//! local, and light stays light. Rounds of them go on by the momentum of the last one (Nesterov 1983; Beck
//! and Teboulle 2009, "A fast iterative shrinkage-thresholding algorithm"): seams of thousands of small
//! charts would take twenty times as many.

use std::collections::HashMap;
use std::collections::hash_map::Entry;

use glam::{Vec2, Vec3};
use lumencast_charts::UnionFind;
use lumencast_light::{Layout, Lightmap, Surface};
use lumencast_scene::Snapshot;
use rayon::prelude::*;

use super::blocks::Block;
use super::places::{PlacedSurface, surfaces};

/// m of a lumel without light of its own.
const YIELDING: f32 = 1.0 / 16.0;
/// Rounds over all points, forwards and backwards, at most, where light is live, and where it is not.
pub(super) const LIVE_ROUNDS: u32 = 24;
pub(super) const ROUNDS: u32 = 160;
/// There are no more rounds once the sides of no point differ by more than this share of the light there.
const CLOSED: f32 = 1e-3;
/// Share of a difference that a projection takes away: a little less than all where points ask for more
/// than their lumels can give.
const RELAXED: f32 = 0.8;
/// Points of an edge for each lumel of its length, at which it is closed, and at which that is judged.
const POINTS: f32 = 2.0;
const JUDGED: f32 = 5.0;
/// Surfaces are smooth across an edge whose normals there are at most so different.
const SMOOTH: f32 = 1e-3;
/// Edges whose sides lie nearer to each other on the page are inside a chart, lumels.
const SAME: f32 = 1.0 / 128.0;

/// How much each of a point's lumels counts there: those that one side reads above 0, those of the other
/// below. Lumels are told by their place in a list.
type Taps = [(u32, f32); 8];

/// Points of seams.
#[derive(Clone, Debug, Default)]
struct Points {
    /// The lumels that take part, by their index among those of all pages.
    lumels: Vec<u32>,
    points: Vec<Taps>,
}

/// The points at which seams are closed.
#[derive(Clone, Debug, Default)]
pub(crate) struct Seams {
    all: Points,
    /// Numbers of the points that read lumels of a block, block by block.
    of_block: Vec<Vec<u32>>,
}

/// Some seams, in parts that share no lumel.
pub(crate) struct Stitches(Vec<Points>);

/// A side of an edge: its ends on a page, in the order of their positions.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Side {
    page: u32,
    ends: [Vec2; 2],
    normals: [Vec3; 2],
}

impl Seams {
    /// The seams of a layout's surfaces in a scene.
    pub(crate) fn new(scene: &Snapshot, layout: &Layout) -> Self {
        let all = Points::of(scene, layout, POINTS);
        let size = layout.page_size;
        let block_of = |lumel: &u32| Block::of(*lumel, size).number(size);
        let blocks: Vec<usize> = all.lumels.iter().map(block_of).collect();
        let mut of_block = vec![Vec::new(); blocks.iter().max().map_or(0, |last| last + 1)];
        for (point, number) in all.points.iter().zip(0..) {
            for (lumel, _) in point {
                let of_block: &mut Vec<u32> = &mut of_block[blocks[*lumel as usize]];
                if of_block.last() != Some(&number) {
                    of_block.push(number);
                }
            }
        }
        Self { all, of_block }
    }

    /// Bytes of memory.
    pub(crate) fn bytes(&self) -> usize {
        let of_block: usize = self.of_block.iter().map(|points| size_of_val(&**points)).sum();
        size_of_val(&*self.all.lumels) + size_of_val(&*self.all.points) + of_block
    }

    /// The seams that lumels of blocks take part in; blocks are told by their numbers.
    pub(crate) fn about(&self, blocks: impl Iterator<Item = usize>) -> Stitches {
        let of_blocks = blocks.filter_map(|block| self.of_block.get(block)).flatten();
        let mut numbers: Vec<u32> = of_blocks.copied().collect();
        numbers.sort_unstable();
        numbers.dedup();
        let points = || numbers.iter().map(|number| &self.all.points[*number as usize]);
        let mut sets = UnionFind::default();
        let mut set_of = vec![None; self.all.lumels.len()];
        for point in points() {
            let of_lumels =
                point.map(|(l, _)| *set_of[l as usize].get_or_insert_with(|| sets.add()));
            for two in of_lumels.windows(2) {
                sets.unite(two[0], two[1]);
            }
        }
        let mut parts: Vec<Points> = Vec::new();
        let (mut part_of, mut place_of) = (HashMap::new(), vec![None; self.all.lumels.len()]);
        for point in points() {
            // All lumels of a point are of one set.
            let set = set_of[point[0].0 as usize].map(|set| sets.root(set));
            let number = *part_of.entry(set).or_insert(parts.len());
            if number == parts.len() {
                parts.push(Points::default());
            }
            let part = &mut parts[number];
            let own = point.map(|(lumel, weight)| {
                let place = *place_of[lumel as usize].get_or_insert_with(|| {
                    part.lumels.push(self.all.lumels[lumel as usize]);
                    part.lumels.len() as u32 - 1
                });
                (place, weight)
            });
            part.points.push(own);
        }
        Stitches(parts)
    }
}

impl Stitches {
    /// Closes the seams of the light of all pages, in so many rounds at most. `is_known` tells of a lumel
    /// whether its light is its own. Lumels that take no part stay as they are.
    pub(crate) fn close(
        &self,
        rounds: u32,
        light: &mut [Vec3],
        is_known: impl Fn(u32) -> bool + Sync,
    ) {
        self.close_above(0.0, rounds, light, is_known);
    }

    /// The same for what is told of light, such as slopes, which may be below 0.
    pub(crate) fn close_signed(
        &self,
        rounds: u32,
        told: &mut [Vec3],
        is_known: impl Fn(u32) -> bool + Sync,
    ) {
        self.close_above(f32::NEG_INFINITY, rounds, told, is_known);
    }

    /// Closes seams, where nothing falls below `least`.
    fn close_above(
        &self,
        least: f32,
        rounds: u32,
        light: &mut [Vec3],
        is_known: impl Fn(u32) -> bool + Sync,
    ) {
        let shown: &[Vec3] = light;
        let closed = |part: &Points| part.closed(shown, &is_known, least, rounds);
        let closed: Vec<Vec<Vec3>> = self.0.par_iter().map(closed).collect();
        for (part, closed) in self.0.iter().zip(closed) {
            for (lumel, closed) in part.lumels.iter().zip(closed) {
                light[*lumel as usize] = closed;
            }
        }
    }
}

impl Points {
    /// Points of the seams of a layout's surfaces in a scene, so many for each lumel of their length.
    fn of(scene: &Snapshot, layout: &Layout, density: f32) -> Self {
        let mut all = Self::default();
        let mut known = HashMap::new();
        let mut open: HashMap<[[u32; 3]; 2], Side> = HashMap::new();
        let mut instance = None;
        for back in [false, true] {
            let of_side = surfaces(scene, layout).filter(|(surface, _)| surface.id.back == back);
            for (surface, placed) in of_side {
                let of = (surface.id.node, surface.id.copy, back);
                if instance.replace(of) != Some(of) {
                    open.clear();
                }
                for triangle in 0..surface.charts.triangles.len() as u32 {
                    for (key, side) in sides(surface, &placed, triangle) {
                        match open.entry(key) {
                            Entry::Vacant(entry) => drop(entry.insert(side)),
                            Entry::Occupied(mut entry) => {
                                let both = [*entry.get(), side];
                                all.add(layout, &mut known, both, density);
                                entry.insert(side);
                            }
                        }
                    }
                }
            }
        }
        all
    }

    /// Adds an edge, if it is a seam. `known` has the places of lumels in the list of those that take
    /// part.
    fn add(
        &mut self,
        layout: &Layout,
        known: &mut HashMap<u32, u32>,
        [one, other]: [Side; 2],
        density: f32,
    ) {
        let alike = |k: usize| one.normals[k].distance_squared(other.normals[k]) < SMOOTH;
        let apart = |k: usize| one.ends[k].distance(other.ends[k]);
        let is_inside = one.page == other.page && apart(0).max(apart(1)) < SAME;
        if is_inside || !(alike(0) && alike(1)) {
            return;
        }
        let length = |side: Side| side.ends[0].distance(side.ends[1]);
        let count = (density * length(one).max(length(other))).ceil().max(1.0) as u32;
        let mut local = |(lumel, weight): (usize, f32)| {
            let lumel = lumel as u32;
            let number = *known.entry(lumel).or_insert_with(|| {
                self.lumels.push(lumel);
                self.lumels.len() as u32 - 1
            });
            (number, weight)
        };
        for k in 0..=count {
            let share = k as f32 / count as f32;
            let taps = |side: Side| layout.taps(side.page, side.ends[0].lerp(side.ends[1], share));
            let ([a, b, c, d], [e, f, g, h]) = (taps(one), taps(other));
            let minus = |(lumel, weight): (usize, f32)| (lumel, -weight);
            let taps = [a, b, c, d, minus(e), minus(f), minus(g), minus(h)];
            self.points.push(taps.map(&mut local));
        }
    }

    /// What lumels have once both sides of each point read the same, and nothing is below `least`.
    fn closed(
        &self,
        light: &[Vec3],
        is_known: impl Fn(u32) -> bool,
        least: f32,
        rounds: u32,
    ) -> Vec<Vec3> {
        let yields = |lumel: &u32| if is_known(*lumel) { 1.0 } else { 1.0 / YIELDING };
        let yields: Vec<f32> = self.lumels.iter().map(yields).collect();
        let mut x: Vec<Vec3> = self.lumels.iter().map(|lumel| light[*lumel as usize]).collect();
        let strength = |point: &Taps| -> f32 {
            point.iter().map(|(lumel, weight)| weight * weight * yields[*lumel as usize]).sum()
        };
        let strengths: Vec<f32> = self.points.iter().map(strength).collect();
        let points = || self.points.iter().zip(&strengths);
        let mut last = x.clone();
        for round in 0..rounds {
            let momentum = round.saturating_sub(1) as f32 / (round + 2) as f32;
            for (x, last) in x.iter_mut().zip(&mut last) {
                let by = *x - std::mem::replace(last, *x);
                *x = (*x + momentum * by).max(Vec3::splat(least));
            }
            let mut is_closed = true;
            for (point, strength) in points() {
                is_closed &= project(&mut x, &yields, point, *strength, least);
            }
            if is_closed {
                break;
            }
            for (point, strength) in points().rev() {
                project(&mut x, &yields, point, *strength, least);
            }
        }
        x
    }
}

/// Brings both sides of a point together; whether they were next to equal.
fn project(x: &mut [Vec3], yields: &[f32], point: &Taps, strength: f32, least: f32) -> bool {
    let read = |taps: &[(u32, f32)]| -> Vec3 {
        taps.iter().map(|(lumel, weight)| *weight * x[*lumel as usize]).sum()
    };
    let (one, minus_other) = (read(&point[..4]), read(&point[4..]));
    let (apart, level) = (one + minus_other, one.abs().max(minus_other.abs()));
    let step = RELAXED / strength.max(f32::MIN_POSITIVE) * apart;
    for (lumel, weight) in point {
        let lumel = *lumel as usize;
        x[lumel] = (x[lumel] - weight * yields[lumel] * step).max(Vec3::splat(least));
    }
    apart.abs().max_element() <= CLOSED * level.max_element()
}

/// Points spread over all seams of a layout, at which these are judged.
pub struct SeamPoints(Points);

impl SeamPoints {
    /// Those of a layout's surfaces in a scene.
    pub fn new(scene: &Snapshot, layout: &Layout) -> Self {
        Self(Points::of(scene, layout, JUDGED))
    }

    /// The irradiance, lux, that both sides read at each point of a lightmap of that layout.
    pub fn sides(&self, lightmap: &Lightmap) -> Vec<[Vec3; 2]> {
        let Points { lumels, points } = &self.0;
        let read = |taps: &[(u32, f32)]| -> Vec3 {
            let light = |lumel: u32| lightmap.irradiance[lumels[lumel as usize] as usize];
            taps.iter().map(|(lumel, weight)| weight.abs() * light(*lumel)).sum()
        };
        let sides = |taps: &Taps| [read(&taps[..4]), read(&taps[4..])];
        points.iter().map(sides).collect()
    }
}

/// The sides of a triangle's edges, with what names the edge: the positions of its ends, to the bit.
fn sides<'a>(
    surface: &'a Surface,
    placed: &'a PlacedSurface<'_>,
    triangle: u32,
) -> impl Iterator<Item = ([[u32; 3]; 2], Side)> + 'a {
    let corners = surface.charts.corners(triangle).into_iter();
    corners.flat_map(move |corners| {
        let at = |k: usize| {
            let mut weights = Vec3::ZERO;
            weights[k] = 1.0;
            placed.at(triangle, weights)
        };
        let ends = [0, 1, 2].map(|k| {
            let (position, normal) = at(k);
            let bits = (position + 0.0).to_array().map(f32::to_bits);
            (bits, normal, surface.rectangles[corners[k].rectangle as usize], corners[k].at)
        });
        [(0, 1), (1, 2), (2, 0)].into_iter().filter_map(move |(i, j)| {
            let (mut a, mut b) = (ends[i], ends[j]);
            if b.0 < a.0 {
                std::mem::swap(&mut a, &mut b);
            }
            let on_page = |end: &([u32; 3], Vec3, _, Vec2)| {
                let (_, _, lumencast_light::Rectangle { corner, .. }, at) = end;
                corner.as_vec2() + *at
            };
            let side =
                Side { page: a.2.page, ends: [on_page(&a), on_page(&b)], normals: [a.1, b.1] };
            (a.0 != b.0).then_some(([a.0, b.0], side))
        })
    })
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::{Affine3A, UVec2};
    use lumencast_light::{ChartVertex, Charts, Rectangle, SurfaceId};
    use lumencast_scene::Primitive;
    use lumencast_testkit::scenes::{Stage, lambert};

    use super::*;

    /// Two squares of a plane, side by side at x = 1, one primitive of four triangles; each is a chart
    /// of 4 × 4 lumels and of another scale on the page.
    fn halves(bend: f32) -> (Snapshot, Layout) {
        halves_at(Vec2::new(15.6, 12.1), 32, bend)
    }

    /// The same with the second one at another place of a page of another size.
    fn halves_at(second: Vec2, page_size: u32, bend: f32) -> (Snapshot, Layout) {
        let mut stage = Stage::default();
        let grey = stage.material(lambert(Vec3::splat(0.5), Vec3::ZERO));
        let mut scenery = Stage::default();
        scenery.quad(Vec3::ZERO, Vec3::X, Vec3::Y, grey);
        let quad: Primitive = scenery.snapshot().instances[0].mesh.primitives[0].clone();
        let mut both = quad.clone();
        both.vertices.positions = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]
            .into_iter()
            .chain([(1.0, 0.0), (2.0, 0.0), (2.0, 1.0), (1.0, 1.0)])
            .map(|(x, y)| Vec3::new(x, y, bend * (x - 1.0_f32).max(0.0)))
            .collect();
        let bent = Vec3::new(-bend, 0.0, 1.0).normalize();
        both.vertices.normals = [Vec3::Z; 4].into_iter().chain([bent; 4]).collect();
        both.vertices.tangents.clear();
        both.triangles = vec![[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]];
        stage.primitive(both, Affine3A::IDENTITY);
        let at = |source, x: f32, y: f32| ChartVertex { source, rectangle: 0, at: Vec2::new(x, y) };
        let square = |first: u32, low: Vec2, side: f32| {
            let ends = [(0.0, 0.0), (side, 0.0), (side, side), (0.0, side)];
            ends.into_iter().zip(first..).map(move |((x, y), k)| at(k, low.x + x, low.y + y))
        };
        let charts = Charts {
            sizes: vec![UVec2::splat(page_size)],
            vertices: square(0, Vec2::splat(3.2), 4.3).chain(square(4, second, 7.7)).collect(),
            triangles: vec![[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]],
        };
        let surface = Surface {
            id: SurfaceId::default(),
            charts: Arc::new(charts),
            rectangles: vec![Rectangle::default()],
        };
        (Snapshot::clone(&stage.snapshot()), Layout::new(page_size, 1, vec![surface]))
    }

    /// What both sides of the seam read, from end to end.
    fn read(layout: &Layout, light: &[Vec3]) -> Vec<[f32; 2]> {
        let at = |triangle, weights| {
            let (page, at) = layout.surfaces()[0].at(triangle, weights).unwrap();
            layout.taps(page, at).into_iter().map(|(l, w)| w * light[l].x).sum::<f32>()
        };
        let steps = (0..=50).map(|k| k as f32 / 50.0);
        steps
            .map(|t| [at(0, Vec3::new(0.0, 1.0 - t, t)), at(3, Vec3::new(1.0 - t, 0.0, t))])
            .collect()
    }

    fn worst(pairs: &[[f32; 2]]) -> f32 {
        pairs.iter().map(|[a, b]| (a - b).abs() / a.max(*b)).fold(0.0, f32::max)
    }

    #[test]
    fn both_sides_read_the_same_and_the_rest_stays() {
        let (scene, layout) = halves(0.0);
        let seams = Seams::new(&scene, &layout);
        let count = seams.all.points.len();
        assert!((10..=40).contains(&count), "{count}");
        let light = |k: usize| Vec3::splat(if k % 32 < 12 { 1.0 } else { 1.2 });
        let noise = |k: usize| 0.1 * ((k * 7919) % 13) as f32 / 13.0;
        let before: Vec<Vec3> = (0..32 * 32).map(|k| light(k) + noise(k)).collect();
        let mut after = before.clone();
        seams.about(0..1).close(LIVE_ROUNDS, &mut after, |lumel| lumel % 32 != 8);
        let (was, is) = (worst(&read(&layout, &before)), worst(&read(&layout, &after)));
        assert!(was > 0.1 && is < 0.01, "{was} → {is}");
        let changed = before.iter().zip(&after).filter(|(a, b)| a != b).count();
        assert!(changed < 60, "{changed}");
        let moved = before.iter().zip(&after).map(|(a, b)| a.distance(*b)).fold(0.0, f32::max);
        assert!(moved < 0.5, "no lumel is driven far: {moved}");
    }

    /// Where a surface is bent, light may differ.
    #[test]
    fn edges_that_are_sharp_are_left_alone() {
        let (scene, layout) = halves(1.0);
        assert!(Seams::new(&scene, &layout).all.points.is_empty());
    }

    /// Where some blocks are new, seams are closed there alone.
    #[test]
    fn seams_are_closed_about_new_blocks() {
        // The second square lies in two blocks, one above the other.
        let (scene, layout) = halves_at(Vec2::new(15.6, 60.1), 128, 0.0);
        let seams = Seams::new(&scene, &layout);
        let count = |seams: &Stitches| seams.0.iter().map(|part| part.points.len()).sum::<usize>();
        assert_eq!(count(&seams.about(0..0)), 0);
        assert_eq!(count(&seams.about(0..4)), seams.all.points.len());
        let some = seams.about(2..4);
        assert!(0 < count(&some) && count(&some) < seams.all.points.len(), "{}", count(&some));
        let light = |k: usize| Vec3::splat(if k % 128 < 12 { 1.0 } else { 1.2 });
        let before: Vec<Vec3> = (0..128 * 128).map(light).collect();
        let mut after = before.clone();
        some.close(LIVE_ROUNDS, &mut after, |_| true);
        let [was, is] = [&before, &after].map(|light| read(&layout, light));
        let closed = is.iter().filter(|[a, b]| (a - b).abs() < 0.01).count();
        assert!(worst(&was) > 0.1 && (5..45).contains(&closed), "{closed} of 51");
    }

    #[test]
    fn seams_that_share_no_lumel_are_closed_apart() {
        let point = |first: u32| {
            std::array::from_fn(|k| (first + k as u32, if k < 4 { 0.25 } else { -0.25 }))
        };
        let points = vec![point(0), point(20), point(4), point(16)];
        let all = Points { lumels: (100..128).collect(), points };
        let seams = Seams { all, of_block: vec![vec![0, 1, 2, 3]] };
        let Stitches(parts) = seams.about(0..1);
        let lumels: Vec<Vec<u32>> = parts.iter().map(|part| part.lumels.clone()).collect();
        assert_eq!(parts.iter().map(|part| part.points.len()).collect::<Vec<_>>(), [2, 2]);
        assert_eq!(lumels, [(100..112).collect::<Vec<_>>(), (120..128).chain(116..120).collect()]);
    }

    /// Light of one end of many charts in a row goes to the other.
    #[test]
    fn rows_of_small_charts_are_closed() {
        const CHARTS: u32 = 48;
        // Each chart has two lumels; its seam reads the mean of both.
        let taps = |chart: u32, weight: f32| [0, 1].map(|k| (2 * chart + k, 0.5 * weight));
        let point = |chart: u32| {
            let ([a, b], [c, d]) = (taps(chart, 1.0), taps(chart + 1, -1.0));
            let none = (2 * chart, 0.0);
            [a, b, none, none, c, d, none, none]
        };
        let lumels = (0..2 * CHARTS).collect();
        let part = Points { lumels, points: (0..CHARTS - 1).map(point).collect() };
        let mut light: Vec<Vec3> =
            (0..2 * CHARTS).map(|lumel| Vec3::splat(1.0 + (lumel / 2) as f32)).collect();
        let mean = 0.5 * (1.0 + CHARTS as f32);
        Stitches(vec![part]).close(100, &mut light, |_| true);
        assert!(light.iter().all(|light| (light.x / mean - 1.0).abs() < 0.01), "{light:?}");
    }

    #[test]
    fn light_without_seams_stays() {
        let (scene, layout) = halves(0.0);
        let mut even = vec![Vec3::splat(2.0); 32 * 32];
        Seams::new(&scene, &layout).about(0..1).close(LIVE_ROUNDS, &mut even, |_| true);
        assert!(even.iter().all(|e| e.abs_diff_eq(Vec3::splat(2.0), 1e-5)));
    }
}
