//! Computes tangents for normal maps where the file has none.
//!
//! At each vertex, the directions of growing u over its triangles are averaged, weighted by angle
//! (as in MikkTSpace). The mean is made orthogonal to the normal. Triangles without area have no
//! say. A vertex between triangles with mirrored and unmirrored texture is split in two.
//!
//! Texture coordinates are those of the normal map's set, transformed (KHR_texture_transform). A
//! primitive has one material, so it has one normal map and its own tangents.

use glam::{Vec2, Vec3, Vec4};

use super::vertices::select_vertices;
use crate::material::TextureRef;
use crate::mesh::Primitive;

/// Computes the tangents of a primitive for a normal map.
pub(super) fn generate(primitive: &mut Primitive, map: &TextureRef) {
    if primitive.uv[map.tex_coord].is_empty() {
        return;
    }
    split_mirrored(primitive, map);
    let (vertices, uv) = (&primitive.vertices, &turned_uv(primitive, map));
    let mut sums = vec![Vec3::ZERO; vertices.positions.len()];
    let mut mirrored = vec![false; vertices.positions.len()];
    for &triangle in primitive.triangles.iter().filter(|triangle| primitive.has_area(triangle)) {
        let corners = triangle.map(|i| vertices.positions[i as usize]);
        let frame = Frame::new(corners, triangle.map(|i| uv[i as usize]));
        for (k, index) in triangle.into_iter().enumerate() {
            let normal = vertices.normals[index as usize];
            let along = frame.u_axis - normal * normal.dot(frame.u_axis);
            let angle = angle_at(corners, k);
            sums[index as usize] += angle * along.normalize_or_zero();
            mirrored[index as usize] = frame.mirrored;
        }
    }
    primitive.vertices.tangents = sums
        .into_iter()
        .zip(&primitive.vertices.normals)
        .zip(mirrored)
        .map(|((sum, normal), mirrored)| tangent(sum, *normal, mirrored))
        .collect();
}

/// Texture coordinates of a map, without their translation.
fn turned_uv(primitive: &Primitive, map: &TextureRef) -> Vec<Vec2> {
    let uv = primitive.uv[map.tex_coord].iter();
    uv.map(|uv| map.texture_from_mesh.transform_vector2(*uv)).collect()
}

fn tangent(sum: Vec3, normal: Vec3, mirrored: bool) -> Vec4 {
    let direction = sum.try_normalize().unwrap_or_else(|| normal.any_orthonormal_vector());
    direction.extend(if mirrored { -1.0 } else { 1.0 })
}

/// The placement of a texture on a triangle.
struct Frame {
    /// Direction of growing u; zero where the texture coordinates have no area.
    u_axis: Vec3,
    mirrored: bool,
}

impl Frame {
    fn new([a, b, c]: [Vec3; 3], [ta, tb, tc]: [Vec2; 3]) -> Self {
        let (e1, e2, t1, t2) = (b - a, c - a, tb - ta, tc - ta);
        let area = t1.perp_dot(t2);
        let u_axis = (e1 * t2.y - e2 * t1.y) * area.signum();
        Self { u_axis: u_axis.normalize_or_zero(), mirrored: is_mirrored([ta, tb, tc]) }
    }
}

/// Whether the texture is mirrored on a triangle. A normal map's y points up the image, while v
/// grows down it. The bitangent is cross(normal, tangent)·w. So an unmirrored texture has clockwise
/// coordinates on its counter-clockwise triangles, and w = 1.
fn is_mirrored([a, b, c]: [Vec2; 3]) -> bool {
    (b - a).perp_dot(c - a) > 0.0
}

fn angle_at(corners: [Vec3; 3], k: usize) -> f32 {
    let [p, q, r] = [corners[k], corners[(k + 1) % 3], corners[(k + 2) % 3]];
    let cosine = (q - p).normalize_or_zero().dot((r - p).normalize_or_zero());
    cosine.clamp(-1.0, 1.0).acos()
}

/// Splits vertices that triangles with mirrored and unmirrored texture share.
fn split_mirrored(primitive: &mut Primitive, map: &TextureRef) {
    let uv = turned_uv(primitive, map);
    let mirrored: Vec<bool> =
        primitive.triangles.iter().map(|t| is_mirrored(t.map(|i| uv[i as usize]))).collect();
    let count = primitive.vertices.positions.len();
    let mut straight = vec![false; count];
    for (triangle, _) in primitive.triangles.iter().zip(&mirrored).filter(|(_, m)| !**m) {
        triangle.iter().for_each(|i| straight[*i as usize] = true);
    }
    let mut order: Vec<u32> = (0..count as u32).collect();
    let mut twin = vec![None; count];
    for (triangle, _) in primitive.triangles.iter_mut().zip(&mirrored).filter(|(_, m)| **m) {
        for index in triangle {
            let original = *index as usize;
            if straight[original] {
                *index = *twin[original].get_or_insert_with(|| {
                    order.push(original as u32);
                    order.len() as u32 - 1
                });
            }
        }
    }
    if order.len() > count {
        select_vertices(primitive, &order);
    }
}
