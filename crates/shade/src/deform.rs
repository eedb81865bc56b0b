//! Skins and morph targets on the device: a compute pass writes the vertices of deforming instances,
//! once a moment of the scene.

use glam::{Vec3, Vec4};
use lumencast_gpu::{Gpu, bindings};
use lumencast_scene::{Aabb, Deformation, MorphTarget, Pose, Primitive};
use lumencast_shaders::{deform, layout};

use crate::part::{Part, SHAPE_SIZE};

/// Vertices of a workgroup.
const GROUP: u32 = 64;
/// Workgroups along an axis, as many as every device has.
const ROW: u32 = 65_535;
/// A vertex's displacement has so many floats: of position, normal and tangent.
const DISPLACEMENT: usize = 9;

/// What deforms of a primitive, on the device.
#[derive(Debug)]
pub(crate) struct Deformable {
    influences: wgpu::Buffer,
    displacements: wgpu::Buffer,
    vertices: u32,
    /// A vertex hangs on so many fours of joints.
    influences_each: u32,
    flat: bool,
    reach: Reach,
}

impl Deformable {
    /// Nothing where it takes a larger buffer than the device has.
    pub(crate) fn new(gpu: &Gpu, primitive: &Primitive) -> Option<Self> {
        let vertices = primitive.vertices.positions.len();
        let floats = vertices * primitive.morph_targets.len() * DISPLACEMENT;
        let limits = gpu.device().limits();
        let shapes = (vertices * SHAPE_SIZE) as u64;
        let sets = primitive.influence_sets().max(1);
        let influences = (vertices * sets * size_of::<layout::Influence>()) as u64;
        let most = shapes.max(influences).max((floats * size_of::<f32>()) as u64);
        if most > limits.max_storage_buffer_binding_size.min(limits.max_buffer_size) {
            return None;
        }
        let mut displacements = Vec::with_capacity(floats);
        for target in &primitive.morph_targets {
            displacements.extend((0..vertices).flat_map(|i| displacement(primitive, target, i)));
        }
        Some(Self {
            influences: storage(gpu, "influences", &self::influences(primitive)),
            displacements: storage(gpu, "displacements", &displacements),
            vertices: vertices as u32,
            influences_each: primitive.influence_sets().max(1) as u32,
            flat: primitive.flat,
            reach: Reach::new(primitive),
        })
    }
}

/// What deforms an instance, on the device.
#[derive(Debug)]
pub(crate) struct Cause {
    morphs: Vec<layout::Morph>,
    morphs_buffer: wgpu::Buffer,
    pose: wgpu::Buffer,
}

impl Cause {
    pub(crate) fn new(gpu: &Gpu, deformation: &Deformation) -> Self {
        let weights = (0..).zip(deformation.weights().iter().copied());
        let morphs: Vec<layout::Morph> = weights
            .filter(|(_, weight)| *weight != 0.0)
            .map(|(number, weight)| layout::Morph { number, weight })
            .collect();
        let pose: Vec<layout::Rows> = match deformation.pose() {
            Some(Pose { joints, rigid }) => {
                joints.iter().chain([rigid]).map(layout::rows).collect()
            }
            None => Vec::new(),
        };
        let morphs_buffer = storage(gpu, "morphs", &morphs);
        Self { morphs, morphs_buffer, pose: storage(gpu, "pose", &pose) }
    }
}

/// How a primitive of an instance is deformed.
#[derive(Clone, Copy)]
pub(crate) struct Deforming<'a> {
    /// The primitive at rest.
    pub(crate) rest: &'a Part,
    pub(crate) deformable: &'a Deformable,
    pub(crate) deformation: &'a Deformation,
    /// The deformation on the device.
    pub(crate) cause: &'a Cause,
}

/// The pipeline that deforms.
#[derive(Debug)]
pub(crate) struct Deformer {
    layout: wgpu::BindGroupLayout,
    pipeline: wgpu::ComputePipeline,
}

impl Deformer {
    pub(crate) fn new(gpu: &Gpu) -> Self {
        use bindings::{STORAGE, UNIFORM, WRITTEN};
        let types = [UNIFORM, STORAGE, STORAGE, STORAGE, STORAGE, STORAGE, WRITTEN];
        let layout = gpu.group_layout("deform", wgpu::ShaderStages::COMPUTE, &types);
        let pipeline = gpu.compute("deform", deform(), "deform_vertices", &[&layout]);
        Self { layout, pipeline }
    }

    /// Writes the vertices and bounds of `deformed`, which shares all else with the primitive at rest.
    pub(crate) fn deform(
        &self,
        gpu: &Gpu,
        pass: &mut wgpu::ComputePass<'_>,
        by: Deforming<'_>,
        deformed: &mut Part,
    ) {
        let Deforming { rest, deformable, deformation, cause } = by;
        let targets = deformable.reach.displacements.len() as u32;
        let pose = deformation.pose();
        let uniform = layout::Deform {
            vertices: deformable.vertices,
            // They are in ascending order, and a primitive may have fewer targets than weights.
            morphs: cause.morphs.partition_point(|morph| morph.number < targets) as u32,
            joints: pose.map_or(0, |pose| pose.joints.len() as u32),
            influences: deformable.influences_each,
            flags: flag(pose.is_some(), layout::deform::SKINNED)
                | flag(deformable.flat, layout::deform::FLAT),
        };
        let uniform =
            gpu.buffer("deform", wgpu::BufferUsages::UNIFORM, bytemuck::bytes_of(&uniform), 16);
        let buffers = [
            &uniform,
            &rest.shape,
            &deformable.influences,
            &deformable.displacements,
            &cause.morphs_buffer,
            &cause.pose,
            &deformed.shape,
        ];
        let resources = buffers.map(wgpu::Buffer::as_entire_binding);
        let group = gpu.group("deform", &self.layout, &resources);
        let groups = deformable.vertices.div_ceil(GROUP);
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.dispatch_workgroups(groups.min(ROW), groups.div_ceil(ROW), 1);
        deformed.bounds = deformable.reach.bounds(deformation);
    }
}

/// How far a primitive's vertices can go.
#[derive(Debug)]
struct Reach {
    /// For each joint, the box of the vertices at rest that hang on it.
    joints: Vec<Aabb>,
    /// The box of those without joints.
    loose: Aabb,
    /// For each morph target, the box of displacements.
    displacements: Vec<Aabb>,
}

impl Reach {
    fn new(primitive: &Primitive) -> Self {
        let positions = &primitive.vertices.positions;
        let greatest = primitive.joints.iter().flatten().max();
        let mut joints = vec![Aabb::EMPTY; greatest.map_or(0, |joint| usize::from(*joint) + 1)];
        let mut loose = Aabb::EMPTY;
        for (vertex, position) in positions.iter().enumerate() {
            if primitive.joints.is_empty() {
                loose.grow(*position);
            }
            for (joint, _) in primitive.influences(vertex) {
                joints[usize::from(joint)].grow(*position);
            }
        }
        let box_of = |target: &MorphTarget| {
            let mut displacements = Aabb::EMPTY;
            target.positions.iter().for_each(|d| displacements.grow(*d));
            displacements
        };
        let displacements = primitive.morph_targets.iter().map(box_of).collect();
        Self { joints, loose, displacements }
    }

    /// A box that no deformed vertex leaves: one that hangs on several joints lies between the places
    /// that each alone would give it.
    fn bounds(&self, deformation: &Deformation) -> Aabb {
        let mut moved = Aabb { min: Vec3::ZERO, max: Vec3::ZERO };
        for (displacements, &weight) in self.displacements.iter().zip(deformation.weights()) {
            if weight != 0.0 && !displacements.is_empty() {
                let [a, b] = [displacements.min, displacements.max].map(|d| weight * d);
                moved.min += a.min(b);
                moved.max += a.max(b);
            }
        }
        let mut bounds = Aabb::EMPTY;
        let joints = self.joints.iter().enumerate().map(|(joint, rest)| (Some(joint), rest));
        for (joint, rest) in joints.chain([(None, &self.loose)]).filter(|(_, r)| !r.is_empty()) {
            let morphed = Aabb { min: rest.min + moved.min, max: rest.max + moved.max };
            let place = |corner| match deformation.pose() {
                Some(pose) => pose.of(joint).transform_point3(corner),
                None => corner,
            };
            let placed = morphed.transformed(place);
            bounds.grow(placed.min);
            bounds.grow(placed.max);
        }
        bounds
    }
}

fn influences(primitive: &Primitive) -> Vec<layout::Influence> {
    let influence = |joints: [u16; 4], weights: Vec4| {
        let pair = |a: u16, b: u16| u32::from(a) | u32::from(b) << 16;
        let joints = [pair(joints[0], joints[1]), pair(joints[2], joints[3])];
        layout::Influence { weights, joints, ..layout::Influence::default() }
    };
    if primitive.joints.is_empty() {
        // There is no joint of this number.
        return vec![influence([u16::MAX; 4], Vec4::X); primitive.vertices.positions.len()];
    }
    let fours = primitive.joints.iter().zip(&primitive.weights);
    fours.map(|(joints, weights)| influence(*joints, weights.max(Vec4::ZERO))).collect()
}

fn displacement(primitive: &Primitive, target: &MorphTarget, vertex: usize) -> [f32; DISPLACEMENT] {
    // Where there are no tangents none are displaced.
    let tangents = match primitive.vertices.tangents.is_empty() {
        true => &[],
        false => target.tangents.as_slice(),
    };
    let of = |list: &[Vec3]| list.get(vertex).copied().unwrap_or_default().to_array();
    let [[a, b, c], [d, e, f], [g, h, i]] =
        [of(&target.positions), of(&target.normals), of(tangents)];
    [a, b, c, d, e, f, g, h, i]
}

fn storage<T: bytemuck::Pod>(gpu: &Gpu, label: &str, contents: &[T]) -> wgpu::Buffer {
    let least = size_of::<layout::Rows>() as u64;
    gpu.buffer(label, wgpu::BufferUsages::STORAGE, bytemuck::cast_slice(contents), least)
}

fn flag(is_set: bool, bit: u32) -> u32 {
    if is_set { bit } else { 0 }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::{Affine3A, Quat};
    use lumencast_scene::{Mesh, Vertices};

    use super::*;
    use crate::geometry::Geometry;
    use lumencast_gpu::Readback;

    /// −1 to 1, the same every time.
    fn random(seed: u32) -> f32 {
        let mut x = seed.wrapping_mul(0x9e37_79b9) ^ 0x85eb_ca6b;
        x = (x ^ (x >> 16)).wrapping_mul(0x21f0_aaad);
        x = (x ^ (x >> 15)).wrapping_mul(0x735a_2d97);
        ((x ^ (x >> 15)) >> 8) as f32 * 0.5f32.powi(23) - 1.0
    }

    fn vector(seed: u32) -> Vec3 {
        Vec3::new(random(3 * seed), random(3 * seed + 1), random(3 * seed + 2))
    }

    const TRIANGLES: u32 = 50;
    const VERTICES: u32 = 3 * TRIANGLES;
    const JOINTS: u16 = 5;

    /// Triangles with normals and tangents, unlike each other, and two morph targets.
    fn soup(seed: u32) -> Primitive {
        let list = |of: &dyn Fn(u32) -> Vec3| (seed..seed + VERTICES).map(of).collect::<Vec<_>>();
        let target = |seed: u32| MorphTarget {
            positions: list(&|i| 0.3 * vector(i + seed)),
            normals: list(&|i| 0.3 * vector(i + seed + 1000)),
            tangents: list(&|i| 0.3 * vector(i + seed + 2000)),
        };
        Primitive {
            triangles: (0..TRIANGLES).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect(),
            vertices: Vertices {
                positions: list(&|i| 2.0 * vector(i)),
                normals: list(&|i| vector(i + 3000).normalize()),
                tangents: list(&|i| vector(i + 4000).normalize())
                    .into_iter()
                    .map(|t| t.extend(t.x.signum()))
                    .collect(),
            },
            morph_targets: vec![target(5000), target(8000)],
            ..Primitive::default()
        }
    }

    fn skinned(seed: u32) -> Primitive {
        let vertices = seed..seed + VERTICES;
        let weights = vertices.clone().map(|i| {
            let (a, b) = (vector(i + 20_000).abs(), random(i + 20_000).abs());
            // Every third vertex hangs on one joint alone.
            let weights = if i % 3 == 0 { Vec4::Y } else { a.extend(b) };
            weights / weights.element_sum()
        });
        // Numbers go one joint too far.
        let joint = |i: u32| (i % (u32::from(JOINTS) + 1)) as u16;
        Primitive {
            weights: weights.collect(),
            joints: vertices
                .map(|i| [joint(i), joint(i / 2), joint(i / 5), joint(i + 3)])
                .collect(),
            ..soup(seed)
        }
    }

    /// Each vertex hangs on two fours of joints.
    fn of_eight_joints(seed: u32) -> Primitive {
        let [first, second] = [skinned(seed), skinned(seed + 40_000)];
        fn in_turn<T: Copy>(a: &[T], b: &[T]) -> Vec<T> {
            a.iter().zip(b).flat_map(|(a, b)| [*a, *b]).collect()
        }
        let weights = in_turn(&first.weights, &second.weights);
        Primitive {
            joints: in_turn(&first.joints, &second.joints),
            weights: weights.into_iter().map(|four| 0.5 * four).collect(),
            ..first
        }
    }

    fn mesh() -> Arc<Mesh> {
        let flat = Primitive { flat: true, ..soup(300) };
        let bare = Primitive { morph_targets: Vec::new(), ..soup(600) };
        let plain = Primitive {
            vertices: Vertices { tangents: Vec::new(), ..skinned(900).vertices },
            ..skinned(900)
        };
        let primitives = vec![soup(0), skinned(1200), flat, bare, plain, of_eight_joints(1500)];
        Arc::new(Mesh { primitives, ..Mesh::default() })
    }

    fn pose(seed: u32, scale: Vec3) -> Pose {
        let joint = |i: u32| {
            let turn = Quat::from_scaled_axis(3.0 * vector(i + seed));
            Affine3A::from_scale_rotation_translation(scale, turn, vector(i + seed + 500))
        };
        let joints = (0..u32::from(JOINTS)).map(joint).collect();
        Pose { joints, rigid: joint(100) }
    }

    fn deformations() -> Vec<Deformation> {
        let mirrored = Vec3::new(1.0, -1.5, 0.7);
        [
            (vec![], None),
            (vec![0.0, 0.0], Some(pose(0, Vec3::ONE))),
            (vec![0.7], None),
            // Weights past the last target have no meaning.
            (vec![-0.4, 1.3, 5.0], Some(pose(50, Vec3::splat(1.7)))),
            (vec![0.0, 0.9], Some(pose(90, mirrored))),
        ]
        .into_iter()
        .map(|(weights, pose)| Deformation::new(mesh(), weights, pose))
        .collect()
    }

    /// Position, normal and tangent of every vertex, as the device has deformed them.
    fn on_the_device(gpu: &Gpu, deformation: &Deformation, primitive: usize) -> (Vec<f32>, Aabb) {
        let deformer = Deformer::new(gpu);
        let cause = Cause::new(gpu, deformation);
        let mut geometry = Geometry::default();
        let (rest, deformable) =
            geometry.deforming(gpu, deformation.mesh()).nth(primitive).expect("a primitive");
        let mut part = rest.to_deform(gpu);
        let mut encoder = gpu.device().create_command_encoder(&Default::default());
        let mut pass = encoder.begin_compute_pass(&Default::default());
        let deformable = deformable.expect("room for it");
        let by = Deforming { rest, deformable, deformation, cause: &cause };
        deformer.deform(gpu, &mut pass, by, &mut part);
        drop(pass);
        let read = Readback::buffer(gpu, "vertices", part.shape.size());
        encoder.copy_buffer_to_buffer(&part.shape, 0, &read, 0, part.shape.size());
        gpu.queue().submit([encoder.finish()]);
        let read = Readback::begin(read).wait(gpu, "deforming").expect("vertices");
        (bytemuck::cast_slice(&read).to_vec(), part.bounds)
    }

    #[test]
    fn the_device_deforms_as_the_scene_does() {
        let gpu = Gpu::new().expect("an adapter");
        for (number, deformation) in deformations().iter().enumerate() {
            for (primitive, expected) in deformation.vertices().iter().enumerate() {
                let (found, bounds) = on_the_device(&gpu, deformation, primitive);
                for (i, found) in found.as_chunks::<10>().0.iter().enumerate() {
                    let tangent = expected.tangents.get(i).copied().unwrap_or_default();
                    let position = expected.positions[i];
                    let expected = [position.to_array(), expected.normals[i].to_array()].concat();
                    let expected = expected.into_iter().chain(tangent.to_array());
                    for (found, expected) in found.iter().zip(expected) {
                        let what = format!("{number}, {primitive}, vertex {i}");
                        assert!((found - expected).abs() < 3e-5, "{what}: {found} for {expected}");
                    }
                    let slack = Vec3::splat(1e-4);
                    let inside =
                        position.cmpge(bounds.min - slack) & position.cmple(bounds.max + slack);
                    assert!(inside.all(), "{number}, {primitive}: {position} is not in {bounds:?}");
                }
            }
        }
    }
}
