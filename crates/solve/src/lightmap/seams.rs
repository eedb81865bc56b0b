//! Seams: where the charts of a smooth surface meet, both sides get the same light.
//!
//! Both sides of such an edge are read from lumels of their own. Lumels about seams are changed as
//! little as possible so that what is read on both sides is equal (Iwanicki 2013, "Lighting Technology
//! of The Last of Us", by least squares): of all x with a·x = b·x, at points of edges that a and b read,
//! and x ≥ 0, about that which minimises Σ m (x − d)², over lumels that were d. Lumels without light of
//! their own yield first. Projections onto one condition after another find it (Kaczmarz 1937): each is
//! local, and light stays light.

use std::collections::HashMap;
use std::collections::hash_map::Entry;

use glam::{Vec2, Vec3};
use lumencast_light::{Layout, Lightmap, Surface};
use lumencast_scene::Snapshot;

use super::places::{PlacedSurface, surfaces};

/// m of a lumel without light of its own.
const YIELDING: f32 = 1.0 / 16.0;
/// Rounds over all points, forwards and backwards.
const ROUNDS: u32 = 24;
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

/// The points at which seams are closed.
#[derive(Clone, Debug, Default)]
pub(crate) struct Seams {
    /// The lumels that take part, by their index among those of all pages.
    lumels: Vec<u32>,
    /// Of each point, the lumels that both sides read, by their index in `lumels`, and how much: those
    /// of one side above 0, those of the other below.
    points: Vec<[(u32, f32); 8]>,
}

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
        Self::at(scene, layout, POINTS)
    }

    /// The same, at so many points for each lumel of their length.
    fn at(scene: &Snapshot, layout: &Layout, points: f32) -> Self {
        let mut seams = Self::default();
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
                                seams.add(layout, &mut known, both, points);
                                entry.insert(side);
                            }
                        }
                    }
                }
            }
        }
        seams
    }

    /// Number of points at which seams are closed.
    #[cfg(test)]
    fn len(&self) -> usize {
        self.points.len()
    }

    /// Bytes of memory.
    pub(crate) fn bytes(&self) -> usize {
        size_of_val(&*self.lumels) + size_of_val(&*self.points)
    }

    /// The lumels that take part, by their index among those of all pages.
    pub(crate) fn lumels(&self) -> &[u32] {
        &self.lumels
    }

    /// Those that new lumels take part in.
    pub(crate) fn about(&self, is_new: impl Fn(u32) -> bool) -> Self {
        let new: Vec<bool> = self.lumels.iter().map(|lumel| is_new(*lumel)).collect();
        let is_about = |point: &&[(u32, f32); 8]| point.iter().any(|(l, _)| new[*l as usize]);
        let mut about = Self::default();
        let mut known = vec![None; self.lumels.len()];
        for point in self.points.iter().filter(is_about) {
            about.points.push(point.map(|(lumel, weight)| {
                let number = *known[lumel as usize].get_or_insert_with(|| {
                    about.lumels.push(self.lumels[lumel as usize]);
                    about.lumels.len() as u32 - 1
                });
                (number, weight)
            }));
        }
        about
    }

    /// Adds an edge, if it is a seam. `known` has the places of lumels in the list of those that take
    /// part.
    fn add(
        &mut self,
        layout: &Layout,
        known: &mut HashMap<u32, u32>,
        [one, other]: [Side; 2],
        points: f32,
    ) {
        let alike = |k: usize| one.normals[k].distance_squared(other.normals[k]) < SMOOTH;
        let apart = |k: usize| one.ends[k].distance(other.ends[k]);
        let is_inside = one.page == other.page && apart(0).max(apart(1)) < SAME;
        if is_inside || !(alike(0) && alike(1)) {
            return;
        }
        let length = |side: Side| side.ends[0].distance(side.ends[1]);
        let count = (points * length(one).max(length(other))).ceil().max(1.0) as u32;
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

    /// Closes the seams of the light of all pages. `known`: of each lumel that takes part whether its
    /// light is its own. Lumels that take no part stay as they are.
    pub(crate) fn apply(&self, light: &mut [Vec3], known: &[bool]) {
        self.close(light, known, 0.0);
    }

    /// The same for what is told of light, such as slopes, which may be below 0.
    pub(crate) fn apply_signed(&self, told: &mut [Vec3], known: &[bool]) {
        self.close(told, known, f32::NEG_INFINITY);
    }

    /// Closes seams, where nothing falls below `least`.
    fn close(&self, light: &mut [Vec3], known: &[bool], least: f32) {
        if self.points.is_empty() {
            return;
        }
        let yields = |is_known: &bool| if *is_known { 1.0 } else { 1.0 / YIELDING };
        let yields: Vec<f32> = known.iter().map(yields).collect();
        let mut x: Vec<Vec3> = self.lumels.iter().map(|lumel| light[*lumel as usize]).collect();
        let strength = |point: &[(u32, f32); 8]| -> f32 {
            point.iter().map(|(lumel, weight)| weight * weight * yields[*lumel as usize]).sum()
        };
        let strengths: Vec<f32> = self.points.iter().map(strength).collect();
        for _ in 0..ROUNDS {
            let points = || self.points.iter().zip(&strengths);
            let mut close = |(point, strength): (_, &f32)| {
                project(&mut x, &yields, point, *strength, least);
            };
            points().for_each(&mut close);
            points().rev().for_each(&mut close);
        }
        for (lumel, value) in self.lumels.iter().zip(x) {
            light[*lumel as usize] = value;
        }
    }
}

/// Brings both sides of a point together.
fn project(x: &mut [Vec3], yields: &[f32], point: &[(u32, f32); 8], strength: f32, least: f32) {
    let apart: Vec3 = point.iter().map(|(lumel, weight)| *weight * x[*lumel as usize]).sum();
    let step = RELAXED / strength.max(f32::MIN_POSITIVE) * apart;
    for (lumel, weight) in point {
        let lumel = *lumel as usize;
        x[lumel] = (x[lumel] - weight * yields[lumel] * step).max(Vec3::splat(least));
    }
}

/// Points spread over all seams of a layout, at which these are judged.
pub struct SeamPoints(Seams);

impl SeamPoints {
    /// Those of a layout's surfaces in a scene.
    pub fn new(scene: &Snapshot, layout: &Layout) -> Self {
        Self(Seams::at(scene, layout, JUDGED))
    }

    /// The irradiance, lux, that both sides read at each point of a lightmap of that layout.
    pub fn sides(&self, lightmap: &Lightmap) -> Vec<[Vec3; 2]> {
        let Seams { lumels, points } = &self.0;
        let read = |taps: &[(u32, f32)]| -> Vec3 {
            let light = |lumel: u32| lightmap.irradiance[lumels[lumel as usize] as usize];
            taps.iter().map(|(lumel, weight)| weight.abs() * light(*lumel)).sum()
        };
        let sides = |taps: &[(u32, f32); 8]| [read(&taps[..4]), read(&taps[4..])];
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
            sizes: vec![UVec2::splat(32)],
            vertices: square(0, Vec2::splat(3.2), 4.3)
                .chain(square(4, Vec2::new(15.6, 12.1), 7.7))
                .collect(),
            triangles: vec![[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]],
        };
        let surface = Surface {
            id: SurfaceId::default(),
            charts: Arc::new(charts),
            rectangles: vec![Rectangle::default()],
        };
        (Snapshot::clone(&stage.snapshot()), Layout::new(32, 1, vec![surface]))
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
        assert!((10..=40).contains(&seams.len()), "{}", seams.len());
        let light = |k: usize| Vec3::splat(if k % 32 < 12 { 1.0 } else { 1.2 });
        let noise = |k: usize| 0.1 * ((k * 7919) % 13) as f32 / 13.0;
        let before: Vec<Vec3> = (0..32 * 32).map(|k| light(k) + noise(k)).collect();
        let mut after = before.clone();
        let known: Vec<bool> = seams.lumels().iter().map(|lumel| lumel % 32 != 8).collect();
        seams.apply(&mut after, &known);
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
        assert_eq!(Seams::new(&scene, &layout).len(), 0);
    }

    /// Where some lumels are new, seams are closed there alone.
    #[test]
    fn seams_are_closed_about_new_lumels() {
        let (scene, layout) = halves(0.0);
        let seams = Seams::new(&scene, &layout);
        assert_eq!(seams.about(|_| false).len(), 0);
        assert_eq!(seams.about(|_| true).len(), seams.len());
        let some = seams.about(|lumel| lumel / 32 > 16);
        assert!(0 < some.len() && some.len() < seams.len(), "{}", some.len());
        let before: Vec<Vec3> =
            (0..32 * 32).map(|k| Vec3::splat(if k % 32 < 12 { 1.0 } else { 1.2 })).collect();
        let mut after = before.clone();
        some.apply(&mut after, &vec![true; some.lumels().len()]);
        let [was, is] = [&before, &after].map(|light| read(&layout, light));
        let closed = is.iter().filter(|[a, b]| (a - b).abs() < 0.01).count();
        assert!(worst(&was) > 0.1 && (5..45).contains(&closed), "{closed} of 51");
    }

    #[test]
    fn light_without_seams_stays() {
        let (scene, layout) = halves(0.0);
        let mut even = vec![Vec3::splat(2.0); 32 * 32];
        let seams = Seams::new(&scene, &layout);
        seams.apply(&mut even, &vec![true; seams.lumels().len()]);
        assert!(even.iter().all(|e| e.abs_diff_eq(Vec3::splat(2.0), 1e-5)));
    }
}
