//! Triangles, and what their materials are made of at a point.

use glam::{Vec2, Vec3, Vec4};
use lumencast_scene::{AlphaMode, Instance, Material, Primitive, TextureRef, Vertices};

use super::texture::{self, Coding, interpolate_uv, sample};
use super::{Bump, MaterialModel};
use crate::accel::fetch_ahead;
use crate::bsdf::{Bsdf, Substance};

/// A triangle's vertices and attributes, at rest or deformed.
#[derive(Clone, Copy)]
pub(crate) struct Triangle<'a> {
    primitive: &'a Primitive,
    vertices: &'a Vertices,
    corners: [u32; 3],
}

impl<'a> Triangle<'a> {
    #[inline]
    pub(crate) fn new(instance: &'a Instance, primitive: u32, triangle: u32) -> Self {
        let p = primitive as usize;
        let primitive = &instance.mesh.primitives[p];
        let corners = primitive.triangles[triangle as usize];
        Self { primitive, vertices: instance.vertices(p), corners }
    }

    /// Prefetches the indices that [`Self::new`] reads.
    #[inline]
    pub(crate) fn fetch(instance: &Instance, primitive: u32, triangle: u32) {
        let primitive = &instance.mesh.primitives[primitive as usize];
        fetch_ahead(&primitive.triangles[triangle as usize]);
    }

    /// Prefetches the vertices.
    #[inline]
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

    /// Object-space positions.
    #[inline]
    pub(crate) fn positions(&self) -> [Vec3; 3] {
        self.corners.map(|i| self.vertices.positions[i as usize])
    }

    /// Object-space vertex normals.
    #[inline]
    pub(crate) fn normals(&self) -> [Vec3; 3] {
        self.corners.map(|i| self.vertices.normals[i as usize])
    }

    /// The triangle's point at these weights of its vertices.
    #[inline]
    pub(crate) fn at(self, material: &'a Material, weights: Vec3) -> Spot<'a> {
        let uv = self.primitive.uv.each_ref().map(|uv| interpolate_uv(uv, self.corners, weights));
        Spot { triangle: self, material, weights, uv }
    }
}

/// A point of a triangle with its material.
#[derive(Clone, Copy)]
pub(crate) struct Spot<'a> {
    triangle: Triangle<'a>,
    pub(crate) material: &'a Material,
    weights: Vec3,
    /// Texture coordinates 0 and 1.
    uv: [Vec2; 2],
}

impl Spot<'_> {
    #[inline]
    fn uv(&self, texture: &TextureRef) -> Vec2 {
        self.uv[texture.tex_coord.min(1)]
    }

    #[inline]
    fn texture(&self, texture: Option<&TextureRef>, coding: Coding) -> Vec4 {
        texture.map_or(Vec4::ONE, |texture| sample(texture, self.uv(texture), coding))
    }

    /// Prefetches the texels.
    #[inline]
    pub(crate) fn fetch_texels(&self, model: MaterialModel) {
        let m = self.material;
        let fetch = |map: &Option<TextureRef>| {
            if let Some(map) = map {
                texture::fetch_texels(map, self.uv(map));
            }
        };
        fetch(&m.base_color_texture);
        if model == MaterialModel::Full {
            fetch(&m.emissive_texture);
            fetch(&m.normal_texture);
            fetch(&m.metallic_roughness_texture);
            fetch(&m.specular_texture);
            fetch(&m.specular_color_texture);
            fetch(&m.transmission_texture);
        }
    }

    /// Linear base colour and opacity.
    #[inline]
    fn base_color_and_opacity(&self) -> Vec4 {
        let mut color = self.material.base_color;
        let colors = &self.triangle.primitive.colors;
        if !colors.is_empty() {
            let [a, b, c] = self.triangle.corners.map(|i| colors[i as usize]);
            color *= self.weights.x * a + self.weights.y * b + self.weights.z * c;
        }
        color * self.texture(self.material.base_color_texture.as_ref(), Coding::Srgb)
    }

    /// Linear base colour, 0 to 1.
    #[inline]
    pub(crate) fn base_color(&self) -> Vec3 {
        self.base_color_and_opacity().truncate().clamp(Vec3::ZERO, Vec3::ONE)
    }

    /// Share of light that the surface blocks, 0 to 1; the rest passes through.
    pub(crate) fn coverage(&self) -> f32 {
        match self.material.alpha_mode {
            AlphaMode::Opaque => 1.0,
            AlphaMode::Mask(cutoff) => f32::from(self.base_color_and_opacity().w >= cutoff),
            AlphaMode::Blend => self.base_color_and_opacity().w.clamp(0.0, 1.0),
        }
    }

    /// Radiance that the front emits, cd/m².
    #[inline]
    pub(crate) fn emission(&self) -> Vec3 {
        let m = self.material;
        if m.unlit || m.emissive == Vec3::ZERO {
            return Vec3::ZERO;
        }
        m.emissive * self.texture(m.emissive_texture.as_ref(), Coding::Srgb).truncate()
    }

    /// Radiance that the seen side emits, cd/m².
    #[inline]
    pub(crate) fn emission_seen(&self, front: bool, model: MaterialModel) -> Vec3 {
        let both = self.material.double_sided && model == MaterialModel::Full;
        if front || both { self.emission() } else { Vec3::ZERO }
    }

    fn substance(&self) -> Substance {
        let m = self.material;
        let tex = |t: &Option<TextureRef>, coding| self.texture(t.as_ref(), coding);
        let metallic_roughness = tex(&m.metallic_roughness_texture, Coding::Linear);
        let specular_color = tex(&m.specular_color_texture, Coding::Srgb).truncate();
        let unit = |x: f32| x.clamp(0.0, 1.0);
        Substance {
            base_color: self.base_color(),
            metallic: unit(m.metallic * metallic_roughness.z),
            roughness: unit(m.roughness * metallic_roughness.y),
            transmission: unit(m.transmission * tex(&m.transmission_texture, Coding::Linear).x),
            ior: m.ior,
            specular: unit(m.specular * tex(&m.specular_texture, Coding::Linear).w),
            specular_color: m.specular_color * specular_color,
        }
    }

    /// The BSDF of the seen side. `None` where it scatters nothing: unlit surfaces, and backs of
    /// single-sided ones.
    #[inline]
    pub(crate) fn bsdf(&self, front: bool, model: MaterialModel) -> Option<Bsdf> {
        match model {
            MaterialModel::Lambert => Some(Bsdf::lambert(self.base_color())),
            MaterialModel::Full => {
                let shows = !self.material.unlit && (front || self.material.double_sided);
                shows.then(|| Bsdf::new(&self.substance()))
            }
        }
    }

    /// The material's normal map at this point.
    #[inline]
    pub(crate) fn bump(&self, model: MaterialModel) -> Bump {
        let tangents = &self.triangle.vertices.tangents;
        let Some(map) = self.material.normal_texture.as_ref() else { return Bump::FLAT };
        if tangents.is_empty() || model == MaterialModel::Lambert {
            return Bump::FLAT;
        }
        let [a, b, c] = self.triangle.corners.map(|i| tangents[i as usize]);
        let w = self.weights;
        let texel = sample(map, self.uv(map), Coding::Linear).truncate();
        let m = 2.0 * texel - 1.0;
        let scale = self.material.normal_scale;
        Bump {
            tangent: (w.x * a + w.y * b + w.z * c).truncate(),
            sign: a.w,
            normal: Vec3::new(m.x * scale, m.y * scale, m.z),
        }
    }
}
