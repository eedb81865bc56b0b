//! A primitive on the device: two vertex buffers and an index buffer.
//!
//! What deformation changes (position, normal, tangent; 40 bytes a vertex) lies apart from the rest
//! (texture coordinates, colour, lumels; 56 bytes). A deforming instance has its own of the first, written on
//! the device from those at rest, and shares the second.

use bytemuck::{Pod, Zeroable};
use glam::{Vec2, Vec3, Vec4};
use lumencast_gpu::Gpu;
use lumencast_scene::{Aabb, Primitive, Vertices};
use lumencast_shaders::layout::NO_LUMELS;

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

/// Locations 3 to 7.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub(crate) struct Attributes {
    uv0: [f32; 2],
    uv1: [f32; 2],
    color: [f32; 4],
    lumels: [[f32; 2]; 2],
    rectangles: [u32; 2],
}

/// A vertex of a primitive, and where its lumels lie.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Corner {
    /// The primitive's vertex.
    pub(crate) source: u32,
    /// Of the front and the back.
    pub(crate) lumels: [LumelPlace; 2],
}

/// Where lumels lie: lumels from the corner of a rectangle, which is one of its instance's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LumelPlace {
    pub(crate) at: Vec2,
    pub(crate) rectangle: u32,
}

impl LumelPlace {
    /// Without lumels.
    pub(crate) const NOWHERE: Self = Self { at: Vec2::ZERO, rectangle: NO_LUMELS };
}

/// Read and written by the pass that deforms, and copied by those who compare what it wrote.
const SHAPE_USAGE: wgpu::BufferUsages = wgpu::BufferUsages::VERTEX
    .union(wgpu::BufferUsages::STORAGE)
    .union(wgpu::BufferUsages::COPY_SRC);

const SHAPE: [wgpu::VertexAttribute; 3] =
    wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32x3, 2 => Float32x4];
const ATTRIBUTES: [wgpu::VertexAttribute; 5] = wgpu::vertex_attr_array![
    3 => Float32x2, 4 => Float32x2, 5 => Float32x4, 6 => Float32x4, 7 => Uint32x2
];

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
        let shape = shape(gpu, vertices, 0..vertices.positions.len());
        Self { shape, bounds: bounds(&vertices.positions), ..self.clone() }
    }

    /// The same triangles with room for other vertices.
    pub(crate) fn to_deform(&self, gpu: &Gpu) -> Self {
        Self { shape: gpu.buffer("vertices", SHAPE_USAGE, &[], self.shape.size()), ..self.clone() }
    }
}

/// Uploads a primitive without lumels.
pub(crate) fn upload(gpu: &Gpu, primitive: &Primitive) -> Part {
    let vertices = 0..primitive.vertices.positions.len() as u32;
    let lumels = [LumelPlace::NOWHERE; 2];
    let corners: Vec<Corner> = vertices.map(|source| Corner { source, lumels }).collect();
    upload_corners(gpu, primitive, &corners, &primitive.triangles)
}

/// Uploads a primitive with these vertices, of which its triangles now are.
pub(crate) fn upload_corners(
    gpu: &Gpu,
    primitive: &Primitive,
    corners: &[Corner],
    triangles: &[[u32; 3]],
) -> Part {
    let Primitive { vertices, colors, .. } = primitive;
    let uv = |set: usize, i: usize| primitive.uv[set].get(i).copied().unwrap_or(Vec2::ZERO);
    let attributes = |Corner { source, lumels: [front, back] }: &Corner| {
        let i = *source as usize;
        Attributes {
            uv0: uv(0, i).to_array(),
            uv1: uv(1, i).to_array(),
            color: colors.get(i).copied().unwrap_or(Vec4::ONE).to_array(),
            lumels: [front.at.to_array(), back.at.to_array()],
            rectangles: [front.rectangle, back.rectangle],
        }
    };
    let attributes: Vec<Attributes> = corners.iter().map(attributes).collect();
    let attributes = bytemuck::cast_slice(&attributes);
    let sources = corners.iter().map(|corner| corner.source as usize);
    let index = wgpu::BufferUsages::INDEX;
    Part {
        shape: shape(gpu, vertices, sources),
        attributes: gpu.buffer("attributes", wgpu::BufferUsages::VERTEX, attributes, 64),
        indices: gpu.buffer("indices", index, bytemuck::cast_slice(triangles), 4),
        index_count: 3 * triangles.len() as u32,
        bounds: bounds(&vertices.positions),
    }
}

/// The shapes of these vertices.
fn shape(gpu: &Gpu, vertices: &Vertices, of: impl Iterator<Item = usize>) -> wgpu::Buffer {
    let shapes: Vec<Shape> = of
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
