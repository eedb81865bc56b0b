//! Triangles as input of a tree: gathered from meshes into one list, and boxed, neighbours in
//! pairs.

use bytemuck::{Pod, Zeroable};
use glam::{Affine3A, Vec3, Vec3A, Vec4};
use lumencast_scene::{Instance, Mesh, Vertices};
use rayon::prelude::*;

use super::Aabb;
use super::build::Item;
use super::pages::{Pages, split};

/// Number of triangles that a thread takes together.
const CHUNK: usize = 4096;
/// Two triangles become one item if the area of their common box is at most this share of the sum
/// of their own boxes' areas.
const PAIRED: f32 = 0.9;

/// A triangle's corners. The bits of `w` hold its instance, its primitive and its index in the
/// primitive.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(transparent)]
pub(super) struct Triangle(pub(super) [Vec4; 3]);

impl Triangle {
    pub(super) fn new(corners: [Vec3A; 3], name: [u32; 3]) -> Self {
        let [a, b, c] = corners;
        let [instance, primitive, index] = name.map(f32::from_bits);
        Self([a.extend(instance), b.extend(primitive), c.extend(index)])
    }

    fn bounds(&self) -> Aabb {
        self.0.iter().fold(Aabb::EMPTY, |bounds, &corner| bounds.with(Vec3A::from_vec4(corner)))
    }
}

/// Consecutive triangles of a primitive, with their transform.
#[derive(Clone, Copy)]
struct Run<'a> {
    instance: u32,
    primitive: u32,
    /// Index of the first triangle.
    first: u32,
    triangles: &'a [[u32; 3]],
    positions: &'a [Vec3],
    to: Affine3A,
}

impl<'a> Run<'a> {
    /// The triangles of a mesh, transformed. `deformed` vertices replace those at rest.
    fn of(
        instance: u32,
        mesh: &'a Mesh,
        deformed: Option<&'a [Vertices]>,
        to: Affine3A,
    ) -> impl Iterator<Item = Self> {
        (0..).zip(&mesh.primitives).flat_map(move |(primitive, p)| {
            let vertices = deformed.map_or(&p.vertices, |d| &d[primitive as usize]);
            let positions = vertices.positions.as_slice();
            (0..).step_by(CHUNK).zip(p.triangles.chunks(CHUNK)).map(move |(first, triangles)| {
                Self { instance, primitive, first, triangles, positions, to }
            })
        })
    }

    fn put(&self, places: &mut [Triangle]) {
        for ((place, corners), index) in places.iter_mut().zip(self.triangles).zip(self.first..) {
            let corner = |i: u32| self.to.transform_point3a(self.positions[i as usize].into());
            *place = Triangle::new(corners.map(corner), [self.instance, self.primitive, index]);
        }
    }
}

/// Triangles, and the boxes around them as items of a tree.
pub(super) struct Triangles {
    pub(super) all: Pages<Triangle>,
    pub(super) items: Pages<Item>,
}

impl Triangles {
    /// Triangles of a mesh at rest, or with `deformed` vertices (one entry for each primitive).
    pub(super) fn of_mesh(mesh: &Mesh, deformed: Option<&[Vertices]>) -> Self {
        Self::new(&Run::of(0, mesh, deformed, Affine3A::IDENTITY).collect::<Vec<_>>())
    }

    /// Triangles of all instances, in world space.
    pub(super) fn of_instances(instances: &[Instance]) -> Self {
        let runs = (0..).zip(instances).flat_map(|(n, instance)| {
            let deformed = instance.deformation.as_ref().map(|d| d.vertices());
            Run::of(n, &instance.mesh, deformed, instance.world_from_object)
        });
        Self::new(&runs.collect::<Vec<_>>())
    }

    fn new(runs: &[Run]) -> Self {
        let lengths = || runs.iter().map(|run| run.triangles.len());
        let mut all = Pages::zeroed(lengths().sum());
        let mut first = 0;
        let begins: Vec<_> = lengths()
            .map(|length| {
                first += length;
                first - length
            })
            .collect();
        let places = split(&mut all, lengths()).into_par_iter().zip(runs).zip(begins);
        let items: Vec<_> = places
            .map(|((places, run), begin)| {
                run.put(places);
                paired(begin, places.iter().map(Triangle::bounds))
            })
            .collect();
        Self { all, items: Pages::concat(&items) }
    }
}

/// Makes items of triangles, given by their boxes, from index `first` on. Neighbours that are two
/// halves of a quad, as most are, become one item. That halves the number of items, and the tree is
/// nearly as good. Triangles that are not finite are left out.
fn paired(first: usize, boxes: impl Iterator<Item = Aabb>) -> Vec<Item> {
    let mut items = Vec::with_capacity(boxes.size_hint().0);
    let mut last: Option<(u32, Aabb)> = None;
    let alone = |(index, bounds)| Item::new(bounds, index, 1);
    for (index, bounds) in (first as u32..).zip(boxes) {
        if !(bounds.min.is_finite() && bounds.max.is_finite()) {
            continue;
        }
        if let Some((before, other)) = last.filter(|(before, _)| before + 1 == index) {
            let both = other.union(bounds);
            if both.half_area() <= PAIRED * (other.half_area() + bounds.half_area()) {
                items.push(Item::new(both, before, 2));
                last = None;
                continue;
            }
        }
        items.extend(last.replace((index, bounds)).map(alone));
    }
    items.extend(last.map(alone));
    items
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halves_of_a_quad_stay_together() {
        let at = |min: [f32; 3], max: [f32; 3]| Aabb { min: min.into(), max: max.into() };
        let quad = at([0.0; 3], [1.0, 1.0, 0.0]);
        let aside = at([5.0, 0.0, 0.0], [6.0, 1.0, 0.0]);
        let lost = at([f32::NAN; 3], [1.0; 3]);
        let found = |boxes: &[Aabb]| -> Vec<_> {
            paired(7, boxes.iter().copied()).iter().map(Item::indices).collect()
        };
        assert_eq!(found(&[quad, quad, aside]), [7..9, 9..10]);
        assert_eq!(found(&[aside, quad, quad, quad]), [7..8, 8..10, 10..11]);
        assert_eq!(found(&[quad, lost, quad]), [7..8, 9..10]);
        // Side by side, the area of their common box is the sum of both areas.
        let beside = at([1.0, 0.0, 0.0], [2.0, 1.0, 0.0]);
        assert_eq!(found(&[quad, beside]), [7..8, 8..9]);
        assert!(found(&[lost]).is_empty() && found(&[]).is_empty());
    }
}
