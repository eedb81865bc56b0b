//! Geometry: triangle lists with their vertex attributes.

use glam::{DVec3, Vec2, Vec3, Vec4};

use crate::{Aabb, MaterialId};

/// A glTF mesh: one or more triangle lists, each with one material.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// Name in the file, for messages.
    pub name: String,
    /// Triangle lists, as many as the file's mesh has: what is not drawn has no triangles.
    pub primitives: Vec<Primitive>,
    /// Default morph weights, one for each target.
    pub morph_weights: Vec<f32>,
    /// Point of the file's object space that vertices are relative to, metres. It is zero unless
    /// the mesh lies far from its own origin.
    pub origin: Vec3,
}

impl Mesh {
    /// Bounds of its vertices at rest, in the file's object space.
    pub(crate) fn bounds(&self) -> [DVec3; 2] {
        let mut bounds = Aabb::EMPTY;
        let positions = self.primitives.iter().flat_map(|p| &p.vertices.positions);
        positions.for_each(|position| bounds.grow(*position));
        [bounds.min, bounds.max].map(|corner| corner.as_dvec3() + self.origin.as_dvec3())
    }

    /// Number of triangles in all primitives.
    pub fn triangle_count(&self) -> usize {
        self.primitives.iter().map(|p| p.triangles.len()).sum()
    }
}

/// A triangle list with one material. Strips and fans are unrolled by the loader, which also
/// guarantees that every index lies inside the vertices and every position and normal is finite.
/// Its triangles are the file's, in their order, also those without area: clients that loaded the
/// file by themselves know them by their numbers.
#[derive(Clone, Debug, Default)]
pub struct Primitive {
    /// Indices into the vertices; counter-clockwise as seen from the front.
    pub triangles: Vec<[u32; 3]>,
    /// Vertices at rest, in object space.
    pub vertices: Vertices,
    /// The two sets of texture coordinates that its material reads: TEXCOORD_0 and 1 unless it asks
    /// for others. Each is empty or has one entry for each vertex.
    pub uv: [Vec<Vec2>; 2],
    /// Vertex colours (linear, factors of the base colour); empty or one for each vertex.
    pub colors: Vec<Vec4>,
    /// Joint indices into the skin of the node; empty where the mesh is not skinned. Each vertex
    /// has [`Self::influence_sets`] entries of four joints, one after the other.
    pub joints: Vec<[u16; 4]>,
    /// Weights of the joints, in the same layout; those of a vertex sum to 1.
    pub weights: Vec<Vec4>,
    /// Morph targets (displacements).
    pub morph_targets: Vec<MorphTarget>,
    /// Whether the file has no normals. Then each triangle has three vertices of its own with the
    /// triangle's normal, also when it is deformed.
    pub flat: bool,
    /// The file's number of each vertex, where some of the file's are split in several; else empty.
    pub sources: Vec<u32>,
    /// Its material; glTF's default material has a number of its own.
    pub material: MaterialId,
}

impl Primitive {
    /// The file's number of a vertex.
    pub fn source(&self, vertex: u32) -> u32 {
        self.sources.get(vertex as usize).copied().unwrap_or(vertex)
    }

    /// Whether a triangle has an area at rest.
    pub fn has_area(&self, triangle: &[u32; 3]) -> bool {
        let [a, b, c] = triangle.map(|v| self.vertices.positions[v as usize].as_dvec3());
        (b - a).cross(c - a) != DVec3::ZERO
    }

    /// Number of entries of four joints for each vertex; 0 where the mesh is not skinned.
    pub fn influence_sets(&self) -> usize {
        self.joints.len() / self.vertices.positions.len().max(1)
    }

    /// The joints that move a vertex, with their weights.
    pub fn influences(&self, vertex: usize) -> impl Iterator<Item = (u16, f32)> {
        let sets = self.influence_sets();
        let of_vertex = vertex * sets..(vertex + 1) * sets;
        let fours = self.joints[of_vertex.clone()].iter().zip(&self.weights[of_vertex]);
        let pairs =
            fours.flat_map(|(names, weights)| names.iter().copied().zip(weights.to_array()));
        pairs.filter(|(_, weight)| *weight > 0.0)
    }
}

/// The vertex attributes that deformation changes.
#[derive(Clone, Debug, Default)]
pub struct Vertices {
    /// Positions in object space, metres.
    pub positions: Vec<Vec3>,
    /// Unit normals, one for each vertex; flat normals where the file has none.
    pub normals: Vec<Vec3>,
    /// Unit tangents (xyz) and signs of the bitangent (w = ±1). Empty where neither the file has
    /// them nor a normal map needs them.
    pub tangents: Vec<Vec4>,
}

/// Displacements of one morph target; each list is empty or has one entry for each vertex.
#[derive(Clone, Debug, Default)]
pub struct MorphTarget {
    /// Displacements in metres.
    pub positions: Vec<Vec3>,
    /// Added to normals before they are normalised.
    pub normals: Vec<Vec3>,
    /// Added to the xyz of tangents.
    pub tangents: Vec<Vec3>,
}
