//! A snapshot on the device: instances, and what has to be drawn for them.

use std::collections::HashMap;
use std::ops::Range;
use std::sync::Arc;

use glam::{Affine3A, Vec3};
use lumencast_gpu::Gpu;
use lumencast_scene::{Aabb, Deformation, Instance, Material, NodeId, Snapshot};
use lumencast_shaders::layout;

use crate::camera::Frustum;
use crate::charted::{Charted, SurfaceLayouts};
use crate::deform::{Cause, Deformer, Deforming};
use crate::geometry::Geometry;
use crate::materials::{self, GpuMaterial, Surface};
use crate::part::Part;
use crate::settings::Materials;
use crate::textures::Textures;
use crate::timing::{Commands, Stage};

/// A primitive with all instances that it is drawn for.
#[derive(Debug)]
pub(crate) struct Draw {
    pub(crate) part: Part,
    pub(crate) material: usize,
    pub(crate) surface: Surface,
    /// The instances by their numbers, and the primitive's bounds there, in the world.
    placed: Vec<(u32, Aabb)>,
}

/// A draw call of a pass: which draw, and where its instances are listed.
#[derive(Clone, Debug)]
pub(crate) struct Call {
    pub(crate) draw: usize,
    pub(crate) instances: Range<u32>,
}

/// The primitives of a deforming instance.
#[derive(Debug)]
struct Deformed {
    parts: Vec<Part>,
    /// What they were last deformed by.
    by: Arc<Deformation>,
}

/// A snapshot on the device.
#[derive(Debug)]
pub(crate) struct GpuScene {
    geometry: Geometry,
    charted: Charted,
    textures: Textures,
    deformer: Deformer,
    deformed: HashMap<NodeId, Deformed>,
    /// The bindings of group 3.
    pub(crate) material_layout: wgpu::BindGroupLayout,
    materials: Vec<GpuMaterial>,
    /// What `materials` were made of.
    source: Option<(Arc<[Material]>, Materials)>,
    pub(crate) instances: wgpu::Buffer,
    /// Where the lumels of instances lie.
    pub(crate) rectangles: wgpu::Buffer,
    draws: Vec<Draw>,
    pub(crate) bounds: Aabb,
}

impl GpuScene {
    pub(crate) fn new(gpu: &Gpu, anisotropy: u16) -> Self {
        Self {
            geometry: Geometry::default(),
            charted: Charted::default(),
            textures: Textures::new(gpu, anisotropy),
            deformer: Deformer::new(gpu),
            deformed: HashMap::new(),
            material_layout: materials::group_layout(gpu),
            materials: Vec::new(),
            source: None,
            instances: list(gpu, "instances", &[] as &[layout::Instance]),
            rectangles: list(gpu, "rectangles", &[] as &[layout::Rectangle]),
            draws: Vec::new(),
            bounds: Aabb::EMPTY,
        }
    }

    /// Takes in another moment of the scene, and where its lumels lie; what has not changed stays where
    /// it is.
    pub(crate) fn update(
        &mut self,
        gpu: &Gpu,
        commands: &mut Commands,
        (snapshot, layouts): (&Snapshot, &SurfaceLayouts),
        model: Materials,
    ) {
        self.update_materials(gpu, &snapshot.materials, model);
        self.deform(gpu, commands, snapshot);
        self.list_draws(gpu, &snapshot.instances, layouts);
        self.bounds = Aabb::EMPTY;
        for (_, bounds) in self.draws.iter().flat_map(|draw| &draw.placed) {
            self.bounds.grow(bounds.min);
            self.bounds.grow(bounds.max);
        }
        self.geometry.forget_unused();
    }

    /// Lists what has to be drawn, primitive by primitive of the same vertices, with where it stands.
    fn list_draws(&mut self, gpu: &Gpu, instances: &[Instance], layouts: &SurfaceLayouts) {
        self.draws.clear();
        let mut known: HashMap<(usize, usize), usize> = HashMap::new();
        let mut placed: Vec<layout::Instance> = instances.iter().map(place).collect();
        let mut rectangles: Vec<layout::Rectangle> = Vec::new();
        let mut before = self.charted.begin();
        for (instance, number) in instances.iter().zip(0..) {
            placed[number as usize].lumels = rectangles.len() as u32;
            let own = self.deformed.get(&instance.node);
            let with_lumels =
                self.charted.parts(gpu, &mut before, instance, layouts, &mut rectangles);
            let (parts, shape) = match (own, with_lumels, &instance.deformation) {
                (Some(own), _, Some(by)) => (&own.parts[..], Arc::as_ptr(by).addr()),
                (_, Some(charted), _) => (charted.parts, charted.number),
                _ => {
                    let shape = Arc::as_ptr(&instance.mesh).addr();
                    (self.geometry.parts(gpu, &instance.mesh), shape)
                }
            };
            for (primitive, part) in parts.iter().enumerate() {
                if part.index_count == 0 {
                    continue;
                }
                let place = |corner| instance.world_from_object.transform_point3(corner);
                let bounds = part.bounds.transformed(place);
                let draw = *known.entry((shape, primitive)).or_insert_with(|| {
                    let material = instance.mesh.primitives[primitive].material.0 as usize;
                    // Past the last one lies glTF's default material.
                    let material = material.min(self.materials.len() - 1);
                    let surface = self.materials[material].surface;
                    let part = part.clone();
                    self.draws.push(Draw { part, material, surface, placed: Vec::new() });
                    self.draws.len() - 1
                });
                self.draws[draw].placed.push((number, bounds));
            }
        }
        self.instances = list(gpu, "instances", &placed);
        self.rectangles = list(gpu, "rectangles", &rectangles);
        // Sorted, few things change from one draw call to the next.
        self.draws.sort_by_key(|draw| (draw.surface, draw.material));
    }

    /// Brings the vertices of deforming instances to this moment.
    fn deform(&mut self, gpu: &Gpu, commands: &mut Commands, snapshot: &Snapshot) {
        let mut before = std::mem::take(&mut self.deformed);
        if snapshot.instances.iter().all(|instance| instance.deformation.is_none()) {
            return;
        }
        let (encoder, timestamp_writes) = commands.compute_pass(Stage::Deformation);
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some("deform"),
            timestamp_writes,
        });
        for instance in &snapshot.instances {
            let Some(deformation) = &instance.deformation else { continue };
            // Instances of a node share theirs.
            let known = self.deformed.get(&instance.node);
            if known.is_some_and(|known| Arc::ptr_eq(&known.by, deformation)) {
                continue;
            }
            let kept = before.remove(&instance.node);
            let deformed = match kept {
                Some(kept) if Arc::ptr_eq(&kept.by, deformation) => kept,
                _ => self.deformed_by(gpu, &mut pass, deformation, kept),
            };
            self.deformed.insert(instance.node, deformed);
        }
    }

    /// Deforms the primitives of an instance, in the buffers that it had before where they fit.
    fn deformed_by(
        &mut self,
        gpu: &Gpu,
        pass: &mut wgpu::ComputePass<'_>,
        deformation: &Arc<Deformation>,
        before: Option<Deformed>,
    ) -> Deformed {
        let mesh = deformation.mesh();
        let mut own = before
            .filter(|before| Arc::ptr_eq(before.by.mesh(), mesh))
            .map_or_else(Vec::new, |before| before.parts)
            .into_iter();
        let cause = Cause::new(gpu, deformation);
        let rest = self.geometry.deforming(gpu, mesh).enumerate();
        let parts = rest.map(|(primitive, (rest, deformable))| {
            let own = own.next();
            let Some(deformable) = deformable else {
                return rest.deformed(gpu, &deformation.vertices()[primitive]);
            };
            let mut part = own.unwrap_or_else(|| rest.to_deform(gpu));
            let by = Deforming { rest, deformable, deformation, cause: &cause };
            self.deformer.deform(gpu, pass, by, &mut part);
            part
        });
        Deformed { parts: parts.collect(), by: deformation.clone() }
    }

    fn update_materials(&mut self, gpu: &Gpu, materials: &Arc<[Material]>, model: Materials) {
        if let Some((known, of)) = &self.source
            && Arc::ptr_eq(known, materials)
            && *of == model
        {
            return;
        }
        let fallback = Material::default();
        let all = materials.iter().chain(std::iter::once(&fallback));
        let layout = &self.material_layout;
        self.materials =
            all.map(|m| GpuMaterial::new(gpu, layout, &mut self.textures, m, model)).collect();
        self.source = Some((materials.clone(), model));
        self.textures.forget_unused();
    }

    pub(crate) fn draw(&self, call: &Call) -> (&Draw, &GpuMaterial) {
        let draw = &self.draws[call.draw];
        (draw, &self.materials[draw.material])
    }

    /// The calls that draw what a frustum meets; their instances are appended to `visible`.
    pub(crate) fn calls(
        &self,
        frustum: &Frustum,
        visible: &mut Vec<u32>,
        wanted: impl Fn(Surface) -> bool,
    ) -> Vec<Call> {
        let mut calls = Vec::new();
        for (index, draw) in self.draws.iter().enumerate().filter(|(_, d)| wanted(d.surface)) {
            let first = visible.len() as u32;
            let met = draw.placed.iter().filter(|(_, bounds)| frustum.meets(bounds));
            visible.extend(met.map(|(instance, _)| *instance));
            let instances = first..visible.len() as u32;
            if !instances.is_empty() {
                calls.push(Call { draw: index, instances });
            }
        }
        calls
    }

    /// The calls that draw blended surfaces, an instance each, the farthest from `eye` first.
    pub(crate) fn sorted_calls(
        &self,
        frustum: &Frustum,
        eye: Vec3,
        visible: &mut Vec<u32>,
    ) -> Vec<Call> {
        let mut met: Vec<(f32, usize, u32)> = Vec::new();
        let blended = self.draws.iter().enumerate().filter(|(_, d)| d.surface == Surface::Blended);
        for (index, draw) in blended {
            for (instance, bounds) in draw.placed.iter().filter(|(_, b)| frustum.meets(b)) {
                let middle = 0.5 * (bounds.min + bounds.max);
                met.push((middle.distance(eye), index, *instance));
            }
        }
        met.sort_by(|a, b| b.0.total_cmp(&a.0));
        let call = |(_, draw, instance): (f32, usize, u32)| {
            visible.push(instance);
            let last = visible.len() as u32;
            Call { draw, instances: last - 1..last }
        };
        met.into_iter().map(call).collect()
    }
}

fn list<T: bytemuck::Pod>(gpu: &Gpu, label: &'static str, items: &[T]) -> wgpu::Buffer {
    let least = size_of::<T>() as u64;
    gpu.buffer(label, wgpu::BufferUsages::STORAGE, bytemuck::cast_slice(items), least)
}

fn place(instance: &Instance) -> layout::Instance {
    let to = &instance.world_from_object;
    let normal = Affine3A::from_mat3(to.inverse().matrix3.transpose().into());
    layout::Instance {
        world_from_object: layout::rows(to),
        normal_from_object: layout::rows(&normal),
        mirrors: u32::from(to.matrix3.determinant() < 0.0),
        still: instance.still.into(),
        ..layout::Instance::default()
    }
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;

    use glam::{UVec2, Vec2, Vec4};
    use lumencast_scene::{AlphaMode, Mesh, MeshId, View};
    use lumencast_testkit::scenes::Stage as Scenery;

    use super::*;
    use crate::camera::Camera;

    /// Balls in a row along x, a metre apart, the k-th at x = k; all of one mesh of two primitives.
    const BALLS: i32 = 41;

    /// The row, of a solid and a blended material, and walls far behind it that take turns of another
    /// solid one, a masked one and the row's solid one.
    fn snapshot() -> Arc<Snapshot> {
        let mut scenery = Scenery::default();
        let of = |alpha_mode| Material { alpha_mode, ..Material::default() };
        let [one, glass, two, leaf] =
            [AlphaMode::Opaque, AlphaMode::Blend, AlphaMode::Opaque, AlphaMode::Mask(0.5)]
                .map(|mode| scenery.material(of(mode)));
        let mut ball = Scenery::default();
        ball.sphere(Vec3::ZERO, 0.2, 4, one).sphere(Vec3::ZERO, 0.4, 4, glass);
        let primitives =
            ball.snapshot().instances.iter().flat_map(|i| i.mesh.primitives.clone()).collect();
        let mesh = Arc::new(Mesh { primitives, ..Mesh::default() });
        for k in 0..BALLS {
            let place = Affine3A::from_translation(Vec3::X * k as f32);
            scenery.instance(MeshId(0), mesh.clone(), place);
        }
        for k in 0..12 {
            let corner = Vec3::new(-20.0, -20.0, -30.0 - k as f32);
            let material = [two, leaf, one][k as usize % 3];
            scenery.quad(corner, Vec3::X * 80.0, Vec3::Y * 40.0, material);
        }
        scenery.snapshot()
    }

    fn on_a_device() -> GpuScene {
        let gpu = Gpu::new().expect("an adapter");
        let mut scene = GpuScene::new(&gpu, 1);
        let moment = (&*snapshot(), &SurfaceLayouts::default());
        scene.update(&gpu, &mut Commands::new(&gpu), moment, Materials::Full);
        scene
    }

    /// What one sees from a point through a narrow, square picture.
    fn frustum(eye: Vec3, target: Vec3) -> Frustum {
        let view = View::look_at(eye, target, 0.1).expect("two points");
        Frustum::new(&Camera::new(&view, UVec2::ONE, Vec2::ZERO).clip_from_world)
    }

    /// However many instances a primitive has, it is drawn by one call, and of them those alone that the
    /// frustum meets.
    #[test]
    fn instances_are_drawn_together_and_only_where_they_may_be_seen() {
        let scene = on_a_device();
        let mut visible = vec![7];
        let across = frustum(Vec3::new(20.0, 0.0, 100.0), Vec3::X * 20.0);
        let calls = scene.calls(&across, &mut visible, |_| true);
        assert_eq!(calls.len(), 2 + 12, "{calls:?}");
        let balls = |calls: &[Call]| -> Vec<usize> {
            calls.iter().map(|c| c.instances.len()).filter(|n| *n > 1).collect()
        };
        let [small, large] = balls(&calls)[..] else { panic!("{calls:?}") };
        // It is 10 m wide there: so many balls meet it, and a few more may by their boxes.
        assert!((9..=13).contains(&small) && (small..=13).contains(&large), "{small}, {large}");
        for call in &calls {
            let listed = &visible[call.instances.start as usize..call.instances.end as usize];
            let distinct: HashSet<u32> = listed.iter().copied().collect();
            assert_eq!(distinct.len(), listed.len(), "each once: {listed:?}");
            if listed.len() > 1 {
                assert!(listed.iter().all(|k| (13..=27).contains(k)), "{listed:?}");
            }
        }
        assert_eq!(visible[0], 7, "what stood there before");

        let away = frustum(Vec3::new(20.0, 0.0, 100.0), Vec3::new(20.0, 0.0, 200.0));
        assert!(scene.calls(&away, &mut visible, |_| true).is_empty());
    }

    /// Instances of a node deform as one: its vertices once, and one call a primitive.
    #[test]
    fn instances_of_a_node_share_what_is_deformed() {
        let gpu = Gpu::new().expect("an adapter");
        let mut scene = GpuScene::new(&gpu, 1);
        let mut snapshot = Snapshot::clone(&snapshot());
        snapshot.instances.truncate(3);
        let mesh = snapshot.instances[0].mesh.clone();
        let deformation = |weight| Arc::new(Deformation::new(mesh.clone(), vec![weight], None));
        let (shared, other) = (deformation(0.5), deformation(1.0));
        for (instance, node) in snapshot.instances.iter_mut().zip([0, 0, 1]) {
            instance.node = NodeId(node);
            let own = if node == 0 { &shared } else { &other };
            instance.deformation = Some(own.clone());
        }
        for _ in 0..2 {
            let mut commands = Commands::new(&gpu);
            let moment = (&snapshot, &SurfaceLayouts::default());
            scene.update(&gpu, &mut commands, moment, Materials::Full);
            let mut placed: Vec<_> = scene.draws.iter().map(|draw| draw.placed.len()).collect();
            placed.sort_unstable();
            assert_eq!((placed, scene.deformed.len()), (vec![1, 1, 2, 2], 2));
        }
    }

    /// Solid surfaces come first, then those with holes, then blended ones; and a material is set once in
    /// each.
    #[test]
    fn materials_are_not_set_more_often_than_there_are_some() {
        let scene = on_a_device();
        let mut visible = Vec::new();
        let all = frustum(Vec3::new(20.0, 0.0, 1e3), Vec3::X * 20.0);
        let calls = scene.calls(&all, &mut visible, |_| true);
        let mut set: Vec<_> = calls
            .iter()
            .map(|call| (scene.draws[call.draw].surface, scene.draws[call.draw].material))
            .collect();
        assert!(set.is_sorted(), "{set:?}");
        assert_eq!(set.len(), 2 + 12);
        set.dedup();
        let expected = [(Surface::Solid, 0), (Surface::Solid, 2), (Surface::Masked, 3)];
        assert_eq!(set, [&expected[..], &[(Surface::Blended, 1)]].concat());
        let solid = scene.calls(&all, &mut visible, |surface| surface == Surface::Solid);
        assert_eq!(solid.len(), 1 + 8);
    }

    /// One call an instance, the farthest first.
    #[test]
    fn blended_surfaces_are_sorted() {
        let scene = on_a_device();
        let eye = Vec3::new(12.3, 0.0, 0.0);
        let mut visible = Vec::new();
        let along = frustum(eye, eye + Vec3::X);
        let calls = scene.sorted_calls(&along, eye, &mut visible);
        let order: Vec<u32> =
            calls.iter().map(|call| visible[call.instances.start as usize]).collect();
        // A ball about the eye is not behind it.
        assert_eq!(order, (12..BALLS as u32).rev().collect::<Vec<_>>());
        assert!(calls.iter().all(|call| call.instances.len() == 1));
        assert!(calls.iter().all(|call| scene.draws[call.draw].surface == Surface::Blended));
    }

    /// A box that no plane cuts off is met, wherever its corners are.
    #[test]
    fn a_frustum_meets_what_surrounds_it() {
        let narrow = frustum(Vec3::ZERO, Vec3::NEG_Z);
        let around = Aabb { min: Vec3::splat(-9.0), max: Vec3::splat(9.0) };
        assert!(narrow.meets(&around));
        assert!(!narrow.meets(&Aabb { min: Vec3::splat(1.0), ..around }), "behind");
        let nothing = Frustum::new(&glam::Mat4::from_cols(Vec4::X, Vec4::Y, Vec4::ZERO, Vec4::W));
        assert!(!nothing.meets(&Aabb::EMPTY));
    }
}
