//! A primitive on the device: two vertex buffers and an index buffer.
//!
//! What deformation changes (position, normal, tangent; 40 bytes a vertex) lies apart from the rest
//! (texture coordinates, colour; 32 bytes). A deforming instance has its own of the first, written on
//! the device from those at rest, and shares the second.

use bytemuck::{Pod, Zeroable};
use glam::{Vec2, Vec3, Vec4};
use lumencast_gpu::Gpu;
use lumencast_scene::{Aabb, Primitive, Vertices};

/// Locations 0 to 2 of the shaders.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub(crate) struct Shape {
    position: [f32; 3],
    normal: [f32; 3],
    tangent: [f32; 4],
}

/// Bytes of a vertex.
pub(crate) const SHAPE_SIZE: usize = size_of::<Shape>();

/// Locations 3 to 5.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub(crate) struct Attributes {
    uv0: [f32; 2],
    uv1: [f32; 2],
    color: [f32; 4],
}

/// Read and written by the pass that deforms, and copied by those who compare what it wrote.
const SHAPE_USAGE: wgpu::BufferUsages = wgpu::BufferUsages::VERTEX
    .union(wgpu::BufferUsages::STORAGE)
    .union(wgpu::BufferUsages::COPY_SRC);

const SHAPE: [wgpu::VertexAttribute; 3] =
    wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32x3, 2 => Float32x4];
const ATTRIBUTES: [wgpu::VertexAttribute; 3] =
    wgpu::vertex_attr_array![3 => Float32x2, 4 => Float32x2, 5 => Float32x4];

/// The layouts of a primitive's two vertex buffers.
pub(crate) fn vertex_layouts() -> [Option<wgpu::VertexBufferLayout<'static>>; 2] {
    let layout = |stride: usize, attributes| {
        Some(wgpu::VertexBufferLayout {
            array_stride: stride as u64,
            step_mode: wgpu::VertexStepMode::Vertex,
            attributes,
        })
    };
    [layout(size_of::<Shape>(), &SHAPE), layout(size_of::<Attributes>(), &ATTRIBUTES)]
}

/// A primitive on the device.
#[derive(Clone, Debug)]
pub(crate) struct Part {
    pub(crate) shape: wgpu::Buffer,
    pub(crate) attributes: wgpu::Buffer,
    pub(crate) indices: wgpu::Buffer,
    pub(crate) index_count: u32,
    /// The bounds in object space.
    pub(crate) bounds: Aabb,
}

impl Part {
    /// The same triangles with other vertices.
    pub(crate) fn deformed(&self, gpu: &Gpu, vertices: &Vertices) -> Self {
        let shape = shape(gpu, vertices);
        Self { shape, bounds: bounds(&vertices.positions), ..self.clone() }
    }

    /// The same triangles with room for other vertices.
    pub(crate) fn to_deform(&self, gpu: &Gpu) -> Self {
        Self { shape: gpu.buffer("vertices", SHAPE_USAGE, &[], self.shape.size()), ..self.clone() }
    }
}

/// Uploads a primitive.
pub(crate) fn upload(gpu: &Gpu, primitive: &Primitive) -> Part {
    let vertices = &primitive.vertices;
    let uv = |set: usize, i: usize| primitive.uv[set].get(i).copied().unwrap_or(Vec2::ZERO);
    let attributes: Vec<Attributes> = (0..vertices.positions.len())
        .map(|i| Attributes {
            uv0: uv(0, i).to_array(),
            uv1: uv(1, i).to_array(),
            color: primitive.colors.get(i).copied().unwrap_or(Vec4::ONE).to_array(),
        })
        .collect();
    let index = wgpu::BufferUsages::INDEX;
    let indices = bytemuck::cast_slice(&primitive.triangles);
    Part {
        shape: shape(gpu, vertices),
        attributes: gpu.buffer(
            "attributes",
            wgpu::BufferUsages::VERTEX,
            bytemuck::cast_slice(&attributes),
            64,
        ),
        indices: gpu.buffer("indices", index, indices, 4),
        index_count: 3 * primitive.triangles.len() as u32,
        bounds: bounds(&vertices.positions),
    }
}

fn shape(gpu: &Gpu, vertices: &Vertices) -> wgpu::Buffer {
    let shapes: Vec<Shape> = (0..vertices.positions.len())
        .map(|i| Shape {
            position: vertices.positions[i].to_array(),
            normal: vertices.normals.get(i).copied().unwrap_or(Vec3::ZERO).to_array(),
            tangent: vertices.tangents.get(i).copied().unwrap_or(Vec4::ZERO).to_array(),
        })
        .collect();
    gpu.buffer("vertices", SHAPE_USAGE, bytemuck::cast_slice(&shapes), 64)
}

fn bounds(positions: &[Vec3]) -> Aabb {
    let mut bounds = Aabb::EMPTY;
    positions.iter().for_each(|p| bounds.grow(*p));
    bounds
}
