//! Scenes whose light is known in closed form, put together by hand.

use std::sync::Arc;

use glam::{Affine3A, Vec3, Vec4};
use lumencast_scene::{
    Environment, Instance, Material, MaterialId, Mesh, MeshId, NodeId, PlacedLight, Primitive,
    PunctualLight, Snapshot, Vertices,
};

/// A scene in the making. Every shape becomes a mesh and an instance of its own.
#[derive(Clone, Debug, Default)]
pub struct Stage {
    materials: Vec<Material>,
    instances: Vec<Instance>,
    lights: Vec<PlacedLight>,
    environment: Environment,
}

/// A perfectly diffuse material that reflects `albedo` of the light and emits `emission` (cd/m²).
pub fn lambert(albedo: Vec3, emission: Vec3) -> Material {
    Material {
        base_color: albedo.extend(1.0),
        metallic: 0.0,
        specular: 0.0,
        emissive: emission,
        ..Material::default()
    }
}

impl Stage {
    /// Adds a material.
    pub fn material(&mut self, material: Material) -> MaterialId {
        self.materials.push(material);
        MaterialId(self.materials.len() as u32 - 1)
    }

    /// Adds a parallelogram; its front faces along `u × v`. Texture coordinates run along u and v.
    pub fn quad(&mut self, corner: Vec3, u: Vec3, v: Vec3, material: MaterialId) -> &mut Self {
        self.primitive(quad(corner, u, v, material), Affine3A::IDENTITY)
    }

    /// Adds the six walls of a box whose fronts face inwards, or outwards where the size is negative.
    pub fn room(&mut self, center: Vec3, size: Vec3, material: MaterialId) -> &mut Self {
        for axis in 0..3 {
            for sign in [-1.0, 1.0] {
                let normal = -sign * Vec3::AXES[axis];
                let u = Vec3::AXES[(axis + 1) % 3] * size;
                let v = sign * -Vec3::AXES[(axis + 2) % 3] * size;
                let corner = center - 0.5 * (size * normal + u + v);
                self.quad(corner, u, v, material);
            }
        }
        self
    }

    /// Adds a sphere of `rings` by `2 * rings` quads with smooth normals; its front faces outwards,
    /// or inwards when the radius is negative. Its area is 0.4 (π/rings)² too small.
    pub fn sphere(
        &mut self,
        center: Vec3,
        radius: f32,
        rings: u32,
        material: MaterialId,
    ) -> &mut Self {
        self.primitive(sphere(center, radius, rings, material), Affine3A::IDENTITY)
    }

    /// Adds any primitive.
    pub fn primitive(&mut self, primitive: Primitive, world_from_object: Affine3A) -> &mut Self {
        let mesh = Mesh { primitives: vec![primitive], ..Mesh::default() };
        let number = self.instances.len() as u32;
        self.instance(MeshId(number), Arc::new(mesh), world_from_object)
    }

    /// Adds an instance of a mesh.
    pub fn instance(
        &mut self,
        mesh_id: MeshId,
        mesh: Arc<Mesh>,
        world_from_object: Affine3A,
    ) -> &mut Self {
        let node = NodeId(self.instances.len() as u32);
        let (copy, still, deformation) = (0, true, None);
        self.instances.push(Instance {
            node,
            copy,
            still,
            mesh_id,
            mesh,
            deformation,
            world_from_object,
        });
        self
    }

    /// Adds a light; `direction` need not be of unit length.
    pub fn light(&mut self, light: PunctualLight, position: Vec3, direction: Vec3) -> &mut Self {
        let node = NodeId(1_000_000 + self.lights.len() as u32);
        let direction = direction.normalize();
        self.lights.push(PlacedLight { node, light, position, direction });
        self
    }

    /// Sets the environment.
    pub fn environment(&mut self, environment: Environment) -> &mut Self {
        self.environment = environment;
        self
    }

    /// The scene as a gatherer wants it.
    pub fn snapshot(&self) -> Arc<Snapshot> {
        Arc::new(Snapshot {
            version: 1,
            time: 0.0,
            origin: Vec3::ZERO,
            instances: self.instances.clone(),
            materials: self.materials.clone().into(),
            lights: self.lights.clone(),
            environment: self.environment.clone(),
        })
    }
}

fn quad(corner: Vec3, u: Vec3, v: Vec3, material: MaterialId) -> Primitive {
    let normal = u.cross(v).normalize();
    let tangent: Vec4 = u.normalize().extend(1.0);
    Primitive {
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        vertices: Vertices {
            positions: vec![corner, corner + u, corner + u + v, corner + v],
            normals: vec![normal; 4],
            tangents: vec![tangent; 4],
        },
        uv: [
            vec![[0.0, 0.0].into(), [1.0, 0.0].into(), [1.0, 1.0].into(), [0.0, 1.0].into()],
            vec![],
        ],
        material,
        ..Primitive::default()
    }
}

fn sphere(center: Vec3, radius: f32, rings: u32, material: MaterialId) -> Primitive {
    let around = 2 * rings;
    let mut vertices = Vertices::default();
    for ring in 0..=rings {
        let polar = std::f32::consts::PI * ring as f32 / rings as f32;
        for k in 0..=around {
            let azimuth = std::f32::consts::TAU * (k % around) as f32 / around as f32;
            let sin = if ring == 0 || ring == rings { 0.0 } else { polar.sin() };
            let d = Vec3::new(sin * azimuth.cos(), polar.cos(), -sin * azimuth.sin());
            vertices.positions.push(center + radius.abs() * d);
            vertices.normals.push(d * radius.signum());
        }
    }
    let mut triangles = Vec::new();
    for ring in 0..rings {
        for k in 0..around {
            let a = ring * (around + 1) + k;
            let b = a + around + 1;
            for [i, j, k] in [[a, b, b + 1], [a, b + 1, a + 1]] {
                triangles.push(if radius > 0.0 { [i, j, k] } else { [i, k, j] });
            }
        }
    }
    Primitive { triangles, vertices, material, ..Primitive::default() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn geometric_normals(p: &Primitive) -> impl Iterator<Item = (Vec3, Vec3)> + '_ {
        p.triangles.iter().map(|t| {
            let [a, b, c] = t.map(|i| p.vertices.positions[i as usize]);
            ((b - a).cross(c - a), (a + b + c) / 3.0)
        })
    }

    #[test]
    fn fronts_face_where_they_should() {
        let outward = sphere(Vec3::ZERO, 2.0, 8, MaterialId(0));
        assert!(geometric_normals(&outward).all(|(n, at)| n.dot(at) >= 0.0));
        let inward = sphere(Vec3::ZERO, -2.0, 8, MaterialId(0));
        assert!(geometric_normals(&inward).all(|(n, at)| n.dot(at) <= 0.0));
        let mut stage = Stage::default();
        let white = stage.material(lambert(Vec3::ONE, Vec3::ZERO));
        stage.room(Vec3::ONE, Vec3::new(2.0, 4.0, 6.0), white);
        let snapshot = stage.snapshot();
        let walls: Vec<_> = snapshot.instances.iter().map(|i| &i.mesh.primitives[0]).collect();
        assert!(
            walls
                .iter()
                .flat_map(|w| geometric_normals(w))
                .all(|(n, at)| n.dot(Vec3::ONE - at) > 0.0)
        );
        let area: f32 =
            walls.iter().flat_map(|w| geometric_normals(w)).map(|(n, _)| 0.5 * n.length()).sum();
        assert!((area - 88.0).abs() < 1e-4, "{area}");
    }
}
