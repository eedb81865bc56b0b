//! The meshes that are on the device, each uploaded once, with what deforms.

use std::collections::HashMap;
use std::sync::Arc;

use lumencast_gpu::Gpu;
use lumencast_scene::Mesh;

use crate::deform::Deformable;
use crate::part::{Part, upload};

/// The meshes that are on the device.
#[derive(Debug, Default)]
pub(crate) struct Geometry {
    /// Meshes by their addresses. Each is kept, so that no other takes its place.
    meshes: HashMap<usize, Kept>,
}

#[derive(Debug)]
struct Kept {
    mesh: Arc<Mesh>,
    parts: Vec<Part>,
    /// There is one for each primitive, once an instance deforms.
    deformables: Vec<Option<Deformable>>,
}

impl Geometry {
    /// The primitives of a mesh, in order.
    pub(crate) fn parts(&mut self, gpu: &Gpu, mesh: &Arc<Mesh>) -> &[Part] {
        &self.kept(gpu, mesh).parts
    }

    /// The same, and what deforms of each; nothing where the device has no room for that.
    pub(crate) fn deforming(
        &mut self,
        gpu: &Gpu,
        mesh: &Arc<Mesh>,
    ) -> impl Iterator<Item = (&Part, Option<&Deformable>)> {
        let kept = self.kept(gpu, mesh);
        if kept.deformables.is_empty() {
            kept.deformables = mesh.primitives.iter().map(|p| Deformable::new(gpu, p)).collect();
        }
        kept.parts.iter().zip(kept.deformables.iter().map(Option::as_ref))
    }

    fn kept(&mut self, gpu: &Gpu, mesh: &Arc<Mesh>) -> &mut Kept {
        self.meshes.entry(Arc::as_ptr(mesh).addr()).or_insert_with(|| Kept {
            mesh: mesh.clone(),
            parts: mesh.primitives.iter().map(|p| upload(gpu, p)).collect(),
            deformables: Vec::new(),
        })
    }

    /// Forgets meshes that nobody else has.
    pub(crate) fn forget_unused(&mut self) {
        self.meshes.retain(|_, kept| Arc::strong_count(&kept.mesh) > 1);
    }
}
