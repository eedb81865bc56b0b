//! Morph targets and skins: glTF 2.0, sections 3.7.2.2 and 3.7.3.

use std::sync::{Arc, OnceLock};

use glam::{Affine3A, Mat3A, Vec3, Vec3A, Vec4};
use rayon::prelude::*;

use crate::gltf::face_normal;
use crate::mesh::{Mesh, Primitive, Vertices};

/// Number of vertices that a core handles at a time.
const BATCH: usize = 2048;

/// Transforms of a skin's joints at one moment.
#[derive(Clone, Debug, PartialEq)]
pub struct Pose {
    /// For each joint, the transform from the mesh at rest to the space of the skinned vertices.
    pub joints: Vec<Affine3A>,
    /// The transform of vertices without joints, and of joints that do not exist.
    pub rigid: Affine3A,
}

impl Pose {
    /// The transform of a joint; `rigid` where there is none.
    pub fn of(&self, joint: Option<usize>) -> &Affine3A {
        joint.and_then(|joint| self.joints.get(joint)).unwrap_or(&self.rigid)
    }
}

/// The deformation of a mesh. Vertices are computed when they are first asked for, and kept. A
/// client that deforms them on a graphics device reads weights and pose alone.
#[derive(Debug)]
pub struct Deformation {
    mesh: Arc<Mesh>,
    weights: Vec<f32>,
    pose: Option<Pose>,
    vertices: OnceLock<Vec<Vertices>>,
}

impl Deformation {
    /// Deforms a mesh by morph targets, then by a skin. A weight of 1 applies a target in full;
    /// targets without a weight stay at 0.
    pub fn new(mesh: Arc<Mesh>, weights: Vec<f32>, pose: Option<Pose>) -> Self {
        Self { mesh, weights, pose, vertices: OnceLock::new() }
    }

    /// The mesh at rest.
    pub fn mesh(&self) -> &Arc<Mesh> {
        &self.mesh
    }

    /// Weights of the morph targets, in their order.
    pub fn weights(&self) -> &[f32] {
        &self.weights
    }

    /// The pose of the joints; `None` for a mesh that is only morphed.
    pub fn pose(&self) -> Option<&Pose> {
        self.pose.as_ref()
    }

    /// The deformed vertices, one entry for each primitive.
    #[inline]
    pub fn vertices(&self) -> &[Vertices] {
        self.vertices.get().unwrap_or_else(|| {
            // This is not computed within the lock. A thread that waits for others' batches may
            // take up work that asks for these vertices too.
            let vertices = deform(&self.mesh, &self.weights, self.pose.as_ref());
            self.vertices.get_or_init(|| vertices)
        })
    }

    /// Whether the deformation is of this mesh, with these weights and this pose.
    pub(crate) fn has_cause(&self, mesh: &Arc<Mesh>, weights: &[f32], pose: Option<&Pose>) -> bool {
        Arc::ptr_eq(&self.mesh, mesh) && self.weights == weights && self.pose.as_ref() == pose
    }
}

/// Vertices of a mesh after morphing by `weights` and, where there is a pose, skinning; one entry
/// for each primitive.
fn deform(mesh: &Mesh, weights: &[f32], pose: Option<&Pose>) -> Vec<Vertices> {
    let deform = |primitive: &Primitive| {
        let mut vertices = morph(primitive, weights);
        if let Some(pose) = pose {
            skin(primitive, &mut vertices, pose);
        }
        let moved = pose.is_some() || !primitive.morph_targets.is_empty();
        if moved && primitive.flat {
            let triangles = vertices.positions.as_chunks::<3>().0;
            vertices.normals = triangles.iter().flat_map(|t| [face_normal(*t); 3]).collect();
        }
        vertices
    };
    mesh.primitives.iter().map(deform).collect()
}

fn morph(primitive: &Primitive, weights: &[f32]) -> Vertices {
    let mut vertices = primitive.vertices.clone();
    let targets = primitive.morph_targets.iter().zip(weights).filter(|(_, w)| **w != 0.0);
    for (target, &weight) in targets.clone() {
        add(&mut vertices.positions, &target.positions, weight);
        add(&mut vertices.normals, &target.normals, weight);
        for (tangent, delta) in vertices.tangents.iter_mut().zip(&target.tangents) {
            *tangent += (weight * *delta).extend(0.0);
        }
    }
    if targets.count() > 0 {
        for (normal, rest) in vertices.normals.iter_mut().zip(&primitive.vertices.normals) {
            *normal = normal.try_normalize().unwrap_or(*rest);
        }
        for (tangent, rest) in vertices.tangents.iter_mut().zip(&primitive.vertices.tangents) {
            *tangent = unit(tangent.truncate(), *rest);
        }
    }
    vertices
}

fn add(values: &mut [Vec3], deltas: &[Vec3], weight: f32) {
    values.iter_mut().zip(deltas).for_each(|(value, delta)| *value += weight * *delta);
}

fn unit(tangent: Vec3, rest: Vec4) -> Vec4 {
    tangent.try_normalize().map_or(rest, |t| t.extend(rest.w))
}

fn skin(primitive: &Primitive, vertices: &mut Vertices, pose: &Pose) {
    let is_loose = primitive.joints.is_empty();
    let blended = |vertex: usize| {
        if is_loose {
            return pose.rigid;
        }
        let mut matrix = Affine3A::from_mat3_translation(glam::Mat3::ZERO, Vec3::ZERO);
        for (joint, weight) in primitive.influences(vertex) {
            let joint = pose.of(Some(joint.into()));
            matrix.matrix3 += joint.matrix3 * weight;
            matrix.translation += joint.translation * weight;
        }
        matrix
    };
    let Vertices { positions, normals, tangents } = vertices;
    positions.par_iter_mut().with_min_len(BATCH).zip(normals).enumerate().for_each(
        |(i, (position, normal))| {
            let matrix = blended(i);
            *position = matrix.transform_point3(*position);
            *normal = normal_matrix(&matrix.matrix3)
                .mul_vec3a(Vec3A::from(*normal))
                .try_normalize()
                .map_or(*normal, Vec3::from);
        },
    );
    tangents.par_iter_mut().with_min_len(BATCH).enumerate().for_each(|(i, tangent)| {
        let matrix = blended(i).matrix3;
        let sign = if matrix.determinant() < 0.0 { -1.0 } else { 1.0 };
        *tangent = unit(matrix * tangent.truncate(), *tangent);
        tangent.w *= sign;
    });
}

/// The inverse transpose up to a positive factor; singular matrices have one too. It is the
/// cofactor matrix with the determinant's sign, so that normals stay on their side.
fn normal_matrix(m: &Mat3A) -> Mat3A {
    let (x, y, z) = (m.x_axis, m.y_axis, m.z_axis);
    let cofactors = Mat3A::from_cols(y.cross(z), z.cross(x), x.cross(y));
    if m.determinant() < 0.0 { cofactors * -1.0 } else { cofactors }
}
