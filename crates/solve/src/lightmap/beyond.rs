//! Where the surface goes on beyond a chart's border.
//!
//! Lumels about a chart that no surface covers stand for the lumels of another chart that lie there in
//! the world, if there are some: so noise is filtered across charts, primitives and instances.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use glam::{IVec2, IVec3, UVec2, Vec2, Vec3};
use lumencast_charts::{LaidOut, barycentric, lumels_on_pages};
use lumencast_light::{Layout, Rectangle, Surface};
use lumencast_scene::Snapshot;
use rayon::prelude::*;

use super::NO_RECEIVER;
use super::blocks::Block;
use super::places::{PlacedSurface, surfaces};
use super::point::Point;
use super::texels::Texels;

/// Set where a lumel stands for another one's receiver.
const BEYOND: u32 = 1 << 31;
/// Lumels about a chart that the surface goes on to.
const RINGS: u32 = 4;
/// A lumel stands for one that lies at most so far from where it would lie itself, lumels.
const NEAR: f32 = 1.0;
/// Least cosine between the normals of both.
const FACING: f32 = 0.9;

/// A lumel about a chart, and where it would lie in the world.
struct Place {
    lumel: usize,
    position: Vec3,
    normal: Vec3,
}

/// Lets lumels about charts stand for those that lie there in the world. `receiver_of` has the receivers
/// of covered lumels, whose points are `points`. Lumels stand for those of their own size.
pub(crate) fn go_on(
    receiver_of: &mut [u32],
    points: &[Point],
    scene: &Snapshot,
    laid_out: &LaidOut,
    texels: &Texels,
) {
    let layout = &laid_out.layout;
    let mut is_taken: Vec<bool> = receiver_of.iter().map(|of| *of != NO_RECEIVER).collect();
    for texel in texels.among(0..points.len() as u32) {
        let mut places = Vec::new();
        for (surface, placed) in surfaces(scene, layout) {
            if laid_out.texel_of(surface.id) == texel {
                about(surface, &placed, layout, &mut is_taken, &mut places);
            }
        }
        let of_size = (0..).zip(points).filter(|(receiver, _)| texels.at(*receiver) == texel);
        let near = Near::new(of_size, points, NEAR * texel);
        let found: Vec<Option<u32>> = places.par_iter().map(|place| near.nearest(place)).collect();
        for (place, receiver) in places.iter().zip(found) {
            if let Some(receiver) = receiver {
                receiver_of[place.lumel] = BEYOND | receiver;
            }
        }
    }
}

/// The receiver that tells of a lumel's surroundings, by its entry.
pub(crate) fn receiver(entry: u32) -> Option<u32> {
    (entry != NO_RECEIVER).then_some(entry & !BEYOND)
}

/// The receiver of a lumel that a surface covers, by its entry.
pub(crate) fn own(entry: u32) -> Option<u32> {
    (entry & BEYOND == 0).then_some(entry)
}

/// Of each block with surfaces, the others whose filter reads its light: those about it on its page, and
/// those where lumels stand for some of its own. `lumels` are those of receivers.
pub(crate) fn readers(
    receiver_of: &[u32],
    lumels: &[u32],
    page_size: u32,
) -> BTreeMap<Block, Vec<Block>> {
    let block = |lumel: u32| Block::of(lumel, page_size);
    let covered: BTreeSet<Block> = lumels.iter().map(|lumel| block(*lumel)).collect();
    let beside = |of: &Block| {
        let beside = of.beside(page_size).filter(|beside| covered.contains(beside));
        (*of, beside.collect::<BTreeSet<Block>>())
    };
    let mut readers: BTreeMap<Block, BTreeSet<Block>> = covered.iter().map(beside).collect();
    for (lumel, entry) in (0..).zip(receiver_of) {
        if own(*entry).is_none()
            && let Some(receiver) = receiver(*entry)
        {
            let of = block(lumels[receiver as usize]);
            readers.entry(of).or_default().insert(block(lumel));
        }
    }
    readers.into_iter().map(|(of, by)| (of, by.into_iter().collect())).collect()
}

/// The lumels about a surface's charts, ring by ring; each belongs to the nearest triangle.
fn about(
    surface: &Surface,
    placed: &PlacedSurface<'_>,
    layout: &Layout,
    is_taken: &mut [bool],
    places: &mut Vec<Place>,
) {
    let size = layout.page_size;
    let mut ring: Vec<(u32, UVec2, u32)> = lumels_on_pages(layout, surface)
        .map(|(_, lumel)| {
            let Rectangle { page, corner } = surface.rectangles[lumel.rectangle as usize];
            (page, corner + lumel.at, lumel.triangle)
        })
        .collect();
    for _ in 0..RINGS {
        let mut next = Vec::new();
        for (page, at, triangle) in ring {
            for off in [IVec2::X, IVec2::NEG_X, IVec2::Y, IVec2::NEG_Y] {
                let beside = at.as_ivec2() + off;
                if beside.min_element() < 0 || beside.max_element() >= size as i32 {
                    continue;
                }
                let beside = beside.as_uvec2();
                let lumel = layout.index(page, beside);
                if std::mem::replace(&mut is_taken[lumel], true) {
                    continue;
                }
                next.push((page, beside, triangle));
                let weights = weights(surface, triangle, beside.as_vec2() + 0.5);
                let Some(weights) = weights.filter(|weights| weights.is_finite()) else { continue };
                let (position, normal) = placed.at(triangle, weights);
                places.push(Place { lumel, position, normal });
            }
        }
        ring = next;
    }
}

/// Barycentric weights of a point of a page in a triangle's plane.
fn weights(surface: &Surface, triangle: u32, at: Vec2) -> Option<Vec3> {
    let corners = surface.charts.corners(triangle)?;
    let of_page = surface.rectangles[corners[0].rectangle as usize].corner.as_vec2();
    Some(barycentric(corners.map(|corner| of_page + corner.at), at))
}

/// Points by where they lie.
struct Near<'a> {
    points: &'a [Point],
    reach: f32,
    /// Receivers of each cube, twice as large as the reach.
    cubes: HashMap<IVec3, Vec<u32>>,
}

impl<'a> Near<'a> {
    /// Those of `among`, by their receivers.
    fn new(among: impl Iterator<Item = (u32, &'a Point)>, points: &'a [Point], reach: f32) -> Self {
        let mut cubes: HashMap<IVec3, Vec<u32>> = HashMap::new();
        for (receiver, point) in among {
            let cube = (point.position / (2.0 * reach)).floor().as_ivec3();
            cubes.entry(cube).or_default().push(receiver);
        }
        Self { points, reach, cubes }
    }

    /// The nearest receiver within reach that faces the same way.
    fn nearest(&self, place: &Place) -> Option<u32> {
        // The eight cubes about the corner that is nearest.
        let first = (place.position / (2.0 * self.reach) - 0.5).floor().as_ivec3();
        let cubes = (0..8).map(|k| first + IVec3::new(k & 1, k >> 1 & 1, k >> 2));
        let all = cubes.filter_map(|cube| self.cubes.get(&cube)).flatten();
        let near = all.filter_map(|receiver| {
            let point = &self.points[*receiver as usize];
            let apart = point.position.distance(place.position);
            let is_near = apart <= self.reach && point.normal().dot(place.normal) >= FACING;
            is_near.then_some((*receiver, apart))
        });
        near.min_by(|(_, a), (_, b)| a.total_cmp(b)).map(|(receiver, _)| receiver)
    }
}
