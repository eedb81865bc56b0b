//! Geometry: triangle lists with their vertex attributes.

use glam::{DVec3, Vec2, Vec3, Vec4};

use crate::{Aabb, MaterialId};

/// A glTF mesh: one or more triangle lists, each with one material.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// Name in the file, for messages.
    pub name: String,
    /// Triangle lists.
    pub primitives: Vec<Primitive>,
    /// Morph weights at rest, one a target.
    pub morph_weights: Vec<f32>,
    /// The point of the file's mesh that vertices are relative to, metres: zero unless that lies far
    /// from its own origin.
    pub origin: Vec3,
}

impl Mesh {
    /// The box around its vertices at rest, as the file has them.
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
#[derive(Clone, Debug, Default)]
pub struct Primitive {
    /// Indices into the vertices; counter-clockwise seen from the front.
    pub triangles: Vec<[u32; 3]>,
    /// Vertices at rest, in object space.
    pub vertices: Vertices,
    /// The two sets of texture coordinates that its material reads, TEXCOORD_0 and 1 unless it asks for
    /// others; empty where the file has none, else one a vertex.
    pub uv: [Vec<Vec2>; 2],
    /// Vertex colours (linear, multiplied into the base colour); empty or one a vertex.
    pub colors: Vec<Vec4>,
    /// Joint indices into the skin of the node; empty where the mesh is not skinned. Each vertex has
    /// as many fours as any needs, one after the other: see [`Self::influence_sets`].
    pub joints: Vec<[u16; 4]>,
    /// Weights of the joints, four by four; those of a vertex sum to 1.
    pub weights: Vec<Vec4>,
    /// Morph targets (displacements).
    pub morph_targets: Vec<MorphTarget>,
    /// The file has no normals: each triangle has three vertices of its own and its normals are the
    /// triangle's, also when it is deformed.
    pub flat: bool,
    /// Material; the default material of glTF has a number of its own.
    pub material: MaterialId,
}

impl Primitive {
    /// Fours of joints a vertex hangs on; 0 where the mesh is not skinned.
    pub fn influence_sets(&self) -> usize {
        self.joints.len() / self.vertices.positions.len().max(1)
    }

    /// The joints that a vertex hangs on, and with which weight.
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
    /// Metres, object space.
    pub positions: Vec<Vec3>,
    /// Unit length, one a vertex; flat normals where the file has none.
    pub normals: Vec<Vec3>,
    /// xyz unit tangent, w = ±1 the sign of the bitangent; empty where neither the file nor a
    /// normal map asks for it.
    pub tangents: Vec<Vec4>,
}

/// Displacements of one morph target; each list is empty or has one entry a vertex.
#[derive(Clone, Debug, Default)]
pub struct MorphTarget {
    /// Metres.
    pub positions: Vec<Vec3>,
    /// Added to normals before normalisation.
    pub normals: Vec<Vec3>,
    /// Added to the xyz of tangents.
    pub tangents: Vec<Vec3>,
}
