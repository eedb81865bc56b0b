//! What a ray has met: position, normals and material at a hit.

pub(crate) mod texture;

use glam::{Affine3A, Mat3, Mat3A, Vec2, Vec3, Vec3A};
use lumencast_scene::{AlphaMode, Instance, Material, Primitive, TextureRef, Vertices};

use crate::accel::{Hit, abs, fetch_ahead};
use crate::bsdf::{Bsdf, Substance, frame};
use texture::{Coding, interpolate_normal, interpolate_uv, sample};

/// γ(n) of Higham: bound of the relative error of n roundings.
pub(crate) const fn gamma(n: f32) -> f32 {
    let e = n * f32::EPSILON * 0.5;
    e / (1.0 - e)
}

/// Which materials to believe.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum MaterialModel {
    /// The materials as glTF describes them.
    #[default]
    Full,
    /// Every surface an opaque two-sided Lambert one with its base colour, shaded by vertex normals
    /// without normal maps, emitting from its front only: for comparisons with other renderers.
    Lambert,
}

/// What tracing needs to know of an instance beside its triangles.
#[derive(Clone, Debug)]
pub(crate) struct Frames {
    world_from_object: Affine3A,
    /// Inverse transpose, for normals.
    normal_from_object: Mat3A,
    abs_world_from_object: Mat3A,
    abs_object_from_world: Mat3A,
    abs_object_translation: Vec3A,
}

impl Frames {
    pub(crate) fn new(world_from_object: Affine3A) -> Self {
        let object_from_world = world_from_object.inverse();
        Self {
            world_from_object,
            normal_from_object: object_from_world.matrix3.transpose(),
            abs_world_from_object: abs(&world_from_object.matrix3),
            abs_object_from_world: abs(&object_from_world.matrix3),
            abs_object_translation: object_from_world.translation.abs(),
        }
    }

    /// World normal of an object-space normal: unit length, or zero where that has no direction.
    pub(crate) fn normal(&self, object: Vec3) -> Vec3 {
        Vec3::from(self.normal_from_object * Vec3A::from(object)).normalize_or_zero()
    }

    pub(crate) fn position(&self, object: Vec3) -> Vec3 {
        self.world_from_object.transform_point3a(object.into()).into()
    }

    /// How far from the true surface a computed point of a triangle may lie, a component each:
    /// errors of interpolating, of transforming to the world, and of transforming the next ray's
    /// origin back (Pharr, Jakob and Humphreys 2023, section 6.8).
    pub(crate) fn error(&self, corners: [Vec3; 3], world: Vec3) -> Vec3 {
        let largest = corners.map(|c| Vec3A::from(c.abs()));
        let largest = largest[0].max(largest[1]).max(largest[2]);
        let local = gamma(16.0) * largest
            + gamma(4.0)
                * (self.abs_object_from_world * Vec3A::from(world.abs())
                    + self.abs_object_translation);
        let error = self.abs_world_from_object * local
            + gamma(4.0)
                * (self.abs_world_from_object * largest + self.world_from_object.translation.abs());
        (2.0 * error).into()
    }
}

/// A triangle's vertices and attributes, wherever they come from.
#[derive(Clone, Copy)]
pub(crate) struct Triangle<'a> {
    primitive: &'a Primitive,
    vertices: &'a Vertices,
    corners: [u32; 3],
}

impl<'a> Triangle<'a> {
    pub(crate) fn new(instance: &'a Instance, primitive: u32, triangle: u32) -> Self {
        let p = primitive as usize;
        let primitive = &instance.mesh.primitives[p];
        let corners = primitive.triangles[triangle as usize];
        Self { primitive, vertices: instance.vertices(p), corners }
    }

    /// Asks for the indices that [`Self::new`] reads.
    pub(crate) fn fetch(instance: &Instance, primitive: u32, triangle: u32) {
        let primitive = &instance.mesh.primitives[primitive as usize];
        fetch_ahead(&primitive.triangles[triangle as usize]);
    }

    /// Asks for the vertices.
    pub(crate) fn fetch_vertices(&self) {
        for corner in self.corners {
            let i = corner as usize;
            fetch_ahead(&self.vertices.positions[i]);
            fetch_ahead(&self.vertices.normals[i]);
            for uv in &self.primitive.uv {
                uv.get(i).map(fetch_ahead);
            }
            self.vertices.tangents.get(i).map(fetch_ahead);
        }
    }

    /// Asks for the texels.
    pub(crate) fn fetch_texels(&self, material: &Material, weights: Vec3, model: MaterialModel) {
        let fetch = |map: &Option<TextureRef>| {
            if let Some(map) = map {
                texture::fetch_texels(map, self.uv(map.tex_coord, weights));
            }
        };
        fetch(&material.base_color_texture);
        if model == MaterialModel::Full {
            fetch(&material.emissive_texture);
            fetch(&material.normal_texture);
            fetch(&material.metallic_roughness_texture);
            fetch(&material.specular_texture);
            fetch(&material.specular_color_texture);
            fetch(&material.transmission_texture);
        }
    }

    /// Object-space positions.
    pub(crate) fn positions(&self) -> [Vec3; 3] {
        self.corners.map(|i| self.vertices.positions[i as usize])
    }

    fn uv(&self, set: usize, weights: Vec3) -> Vec2 {
        interpolate_uv(&self.primitive.uv[set.min(1)], self.corners, weights)
    }

    fn texture(&self, texture: Option<&TextureRef>, weights: Vec3, coding: Coding) -> glam::Vec4 {
        texture.map_or(glam::Vec4::ONE, |t| sample(t, self.uv(t.tex_coord, weights), coding))
    }

    /// Linear base colour and opacity.
    pub(crate) fn base_color(&self, material: &Material, weights: Vec3) -> glam::Vec4 {
        let mut color = material.base_color;
        if !self.primitive.colors.is_empty() {
            let [a, b, c] = self.corners.map(|i| self.primitive.colors[i as usize]);
            color *= weights.x * a + weights.y * b + weights.z * c;
        }
        color * self.texture(material.base_color_texture.as_ref(), weights, Coding::Srgb)
    }

    /// Share of light that does not pass through the holes of the surface, 0 to 1.
    pub(crate) fn coverage(&self, material: &Material, weights: Vec3) -> f32 {
        match material.alpha_mode {
            AlphaMode::Opaque => 1.0,
            AlphaMode::Mask(cutoff) => f32::from(self.base_color(material, weights).w >= cutoff),
            AlphaMode::Blend => self.base_color(material, weights).w.clamp(0.0, 1.0),
        }
    }

    /// Emitted radiance of the front, cd/m².
    pub(crate) fn emission(&self, material: &Material, weights: Vec3) -> Vec3 {
        if material.unlit || material.emissive == Vec3::ZERO {
            return Vec3::ZERO;
        }
        let texture = self.texture(material.emissive_texture.as_ref(), weights, Coding::Srgb);
        material.emissive * texture.truncate()
    }

    fn substance(&self, material: &Material, weights: Vec3) -> Substance {
        let m = material;
        let tex = |t: &Option<TextureRef>, coding| self.texture(t.as_ref(), weights, coding);
        let metallic_roughness = tex(&m.metallic_roughness_texture, Coding::Linear);
        let specular_color = tex(&m.specular_color_texture, Coding::Srgb).truncate();
        let unit = |x: f32| x.clamp(0.0, 1.0);
        Substance {
            base_color: self.base_color(m, weights).truncate().clamp(Vec3::ZERO, Vec3::ONE),
            metallic: unit(m.metallic * metallic_roughness.z),
            roughness: unit(m.roughness * metallic_roughness.y),
            transmission: unit(m.transmission * tex(&m.transmission_texture, Coding::Linear).x),
            ior: m.ior,
            specular: unit(m.specular * tex(&m.specular_texture, Coding::Linear).w),
            specular_color: m.specular_color * specular_color,
        }
    }

    /// Shading normal in object space, normal map included.
    fn shading_normal(&self, material: Option<&Material>, weights: Vec3) -> Vec3 {
        let normal = interpolate_normal(self.vertices, self.corners, weights);
        let Some((material, map)) = material.and_then(|m| Some((m, m.normal_texture.as_ref()?)))
        else {
            return normal;
        };
        if self.vertices.tangents.is_empty() {
            return normal;
        }
        let [a, b, c] = self.corners.map(|i| self.vertices.tangents[i as usize]);
        let tangent = (weights.x * a + weights.y * b + weights.z * c).truncate();
        let n = normal.normalize_or_zero();
        let bitangent = n.cross(tangent) * a.w;
        let texel = sample(map, self.uv(map.tex_coord, weights), Coding::Linear).truncate();
        let m = 2.0 * texel - 1.0;
        let scale = material.normal_scale;
        m.x * scale * tangent + m.y * scale * bitangent + m.z * n
    }
}

/// A point on a surface that a ray has met.
pub(crate) struct Point<'a> {
    /// Which triangle.
    pub(crate) hit: Hit,
    pub(crate) triangle: Triangle<'a>,
    pub(crate) material: &'a Material,
    /// World.
    pub(crate) position: Vec3,
    /// Unit normal of the triangle on the side that the ray came from.
    pub(crate) normal: Vec3,
    /// Whether the ray came from the front.
    pub(crate) front: bool,
    /// Weights of the triangle's vertices.
    weights: Vec3,
    /// Bound of the position's error along the normal, metres.
    offset: f32,
    /// Towards where the ray came from, unit.
    view: Vec3,
}

impl<'a> Point<'a> {
    /// The point of a hit; `direction` is the unit direction of the ray. `None` for triangles so
    /// thin that they have no normal.
    pub(crate) fn new(
        hit: Hit,
        instance: &'a Instance,
        frames: &Frames,
        material: &'a Material,
        direction: Vec3,
    ) -> Option<Self> {
        let triangle = Triangle::new(instance, hit.primitive, hit.triangle);
        let corners = triangle.positions();
        let [a, b, c] = corners;
        let weights = hit.weights();
        let position = frames.position(weights.x * a + weights.y * b + weights.z * c);
        let front_normal = frames.normal(scaled_cross(b - a, c - a));
        if front_normal == Vec3::ZERO {
            return None;
        }
        let front = front_normal.dot(direction) < 0.0;
        let normal = if front { front_normal } else { -front_normal };
        let offset = frames.error(corners, position).dot(normal.abs());
        Some(Self {
            hit,
            triangle,
            material,
            position,
            normal,
            front,
            weights,
            offset,
            view: -direction,
        })
    }

    /// Emitted radiance towards the ray, cd/m².
    pub(crate) fn emission(&self, model: MaterialModel) -> Vec3 {
        let both = self.material.double_sided && model == MaterialModel::Full;
        if self.front || both {
            self.triangle.emission(self.material, self.weights)
        } else {
            Vec3::ZERO
        }
    }

    /// Linear base colour, 0 to 1.
    pub(crate) fn base_color(&self) -> Vec3 {
        let color = self.triangle.base_color(self.material, self.weights).truncate();
        color.clamp(Vec3::ZERO, Vec3::ONE)
    }

    /// How the surface scatters towards the ray, and the frame (columns in the world) in which it
    /// does; `None` where it scatters nothing: unlit surfaces and backs of single-sided ones.
    pub(crate) fn scattering(&self, frames: &Frames, model: MaterialModel) -> Option<(Bsdf, Mat3)> {
        let (bsdf, map) = match model {
            MaterialModel::Lambert => (Bsdf::lambert(self.base_color()), None),
            MaterialModel::Full => {
                if self.material.unlit || !(self.front || self.material.double_sided) {
                    return None;
                }
                let substance = self.triangle.substance(self.material, self.weights);
                (Bsdf::new(&substance), Some(self.material))
            }
        };
        let normal = frames.normal(self.triangle.shading_normal(map, self.weights));
        Some((bsdf, frame(self.visible(normal))))
    }

    /// The shading normal on the ray's side, bent as little as makes it face the ray: normal maps
    /// and coarse meshes would else show their back.
    fn visible(&self, shading: Vec3) -> Vec3 {
        const LEAST: f32 = 1e-3;
        let n = if shading.dot(self.normal) < 0.0 { -shading } else { shading };
        if n == Vec3::ZERO {
            return self.normal;
        }
        let cos = n.dot(self.view);
        if cos >= LEAST {
            return n;
        }
        (n + (2.0 * LEAST - cos) * self.view).normalize_or(self.normal)
    }

    /// Where a ray along `direction` starts: off the surface by as much as rounding may have put
    /// the position on its other side.
    pub(crate) fn leave(&self, direction: Vec3) -> Vec3 {
        let side = 1.0f32.copysign(direction.dot(self.normal));
        self.position + side * self.offset * self.normal
    }
}

/// A cross product that neither overflows nor vanishes for very large or small triangles; only its
/// direction counts.
pub(crate) fn scaled_cross(a: Vec3, b: Vec3) -> Vec3 {
    let largest = a.abs().max(b.abs()).max_element();
    if largest == 0.0 { Vec3::ZERO } else { (a / largest).cross(b / largest) }
}
