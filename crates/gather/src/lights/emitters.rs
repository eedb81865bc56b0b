//! Emissive triangles as light sources.

use glam::{Vec2, Vec3};
use lumencast_scene::{Instance, Material};

use crate::sampling::{Table, triangle};
use crate::surface::{Frames, MaterialModel, Triangle, scaled_cross};

/// An emissive triangle.
#[derive(Clone, Copy, Debug)]
struct Emitter {
    instance: u32,
    primitive: u32,
    triangle: u32,
    /// World positions, metres.
    corners: [Vec3; 3],
    /// Unit normal of the front.
    normal: Vec3,
    /// m².
    area: f32,
    /// Whether both faces emit.
    double_sided: bool,
    /// Bound of the error of a point's position along the normal, metres.
    offset: f32,
}

/// The emissive triangles of a snapshot.
#[derive(Debug, Default)]
pub(crate) struct Emitters {
    emitters: Vec<Emitter>,
    /// Luminous flux over π of each emitter; emptied by `finish`.
    powers: Vec<f32>,
    by_power: Table,
}

/// A sampled point of an emissive triangle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EmitterSample {
    pub(crate) instance: u32,
    pub(crate) primitive: u32,
    pub(crate) triangle: u32,
    /// Barycentric weights of the triangle's vertices.
    pub(crate) weights: Vec3,
    /// World position, moved a little off the surface so that the surface does not occlude it.
    pub(crate) position: Vec3,
    /// Density per steradian as seen from the receiving point.
    pub(crate) pdf: f32,
}

impl Emitters {
    /// Adds a primitive's triangles with their mean luminances (cd/m²). Returns the index of the
    /// first.
    pub(crate) fn add(
        &mut self,
        (index, instance): (u32, &Instance),
        frames: &Frames,
        primitive: u32,
        double_sided: bool,
        luminance: impl Fn(u32) -> f32,
    ) -> u32 {
        let first = self.emitters.len() as u32;
        let triangles = instance.mesh.primitives[primitive as usize].triangles.len() as u32;
        self.emitters.extend((0..triangles).map(|triangle| {
            let local = Triangle::new(instance, primitive, triangle).positions();
            let corners = local.map(|p| frames.position(p));
            let [a, b, c] = corners;
            let normal = frames.normal(scaled_cross(local[1] - local[0], local[2] - local[0]));
            let area = 0.5 * (b - a).cross(c - a).length();
            let far = corners.map(Vec3::abs);
            let offset = frames.error(local, far[0].max(far[1]).max(far[2])).dot(normal.abs());
            Emitter {
                instance: index,
                primitive,
                triangle,
                corners,
                normal,
                area,
                double_sided,
                offset,
            }
        }));
        let sides = if double_sided { 2.0 } else { 1.0 };
        let power = |e: &Emitter| {
            e.area * luminance(e.triangle) * sides * f32::from(e.normal != Vec3::ZERO)
        };
        self.powers.extend(self.emitters[first as usize..].iter().map(power));
        first
    }

    /// Builds the table of powers; call it after the last `add`.
    pub(crate) fn finish(&mut self) {
        self.by_power = Table::new(std::mem::take(&mut self.powers));
    }

    /// Whether there are no emitters.
    pub(crate) fn is_empty(&self) -> bool {
        self.by_power.is_empty()
    }

    /// Samples a point, uniform on a triangle chosen by power. `None` where `from` is on its dark
    /// side.
    pub(crate) fn sample(&self, from: Vec3, choice: f32, u: Vec2) -> Option<EmitterSample> {
        if self.is_empty() {
            return None;
        }
        let (index, _, _) = self.by_power.choose(choice);
        let e = &self.emitters[index];
        let uv = triangle(u);
        let weights = Vec3::new(1.0 - uv.x - uv.y, uv.x, uv.y);
        let [a, b, c] = e.corners;
        let on_surface = weights.x * a + weights.y * b + weights.z * c;
        let pdf = self.pdf(index as u32, from, on_surface);
        let side = 1.0f32.copysign((from - on_surface).dot(e.normal));
        (pdf > 0.0).then_some(EmitterSample {
            instance: e.instance,
            primitive: e.primitive,
            triangle: e.triangle,
            weights,
            position: on_surface + side * e.offset * e.normal,
            pdf,
        })
    }

    /// Density per steradian of sampling a point as seen from `from`; 0 on the dark side.
    pub(crate) fn pdf(&self, index: u32, from: Vec3, position: Vec3) -> f32 {
        let e = &self.emitters[index as usize];
        let to = from - position;
        let distance = to.length();
        let cos = to.dot(e.normal) / distance;
        let cos = if e.double_sided { cos.abs() } else { cos };
        let chance = self.by_power.probability(index as usize);
        let pdf = chance / e.area * distance * distance / cos;
        if cos > 0.0 && pdf.is_finite() { pdf } else { 0.0 }
    }
}

/// Whether a material makes its triangles emitters (`Some`), and whether both faces emit.
pub(crate) fn shines(material: &Material, model: MaterialModel) -> Option<bool> {
    let dark = material.unlit || material.emissive.max_element() <= 0.0;
    (!dark).then_some(material.double_sided && model == MaterialModel::Full)
}
