//! A lit room beside a dark one, as a file brings them, anywhere in the world.

use glam::{DVec3, Vec3};
use lumencast_scene::Scene;
use serde_json::{Value, json};

use crate::mapped::container;

/// Metres.
const THICKNESS: f64 = 0.1;

/// Two closed rooms of 4 × 3 × 4 m with walls of ten centimetres, the lit one towards −x of the middle
/// of the wall's foot between them, the dark one towards +x. A lamp hangs in the lit one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rooms {
    /// The middle of that foot, world.
    pub at: DVec3,
    /// How the file says where walls are.
    pub placed: Placed,
    /// Radiance of all surfaces, cd/m².
    pub emission: f32,
}

/// How a file says where things are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Placed {
    /// Every node has its place in the world.
    Flat,
    /// Nodes lie below one that has it, and that below another which takes it back and gives it again.
    Nested,
    /// Every vertex has its place in the world, in 32 bits.
    Baked,
}

impl Rooms {
    /// As they reflect.
    pub const ALBEDO: f32 = 0.5;
    /// Of the lamp, candela.
    pub const INTENSITY: f32 = 100.0;
    /// The lamp, from [`Rooms::at`].
    pub const LAMP: Vec3 = Vec3::new(-2.0, 2.5, 0.3);

    /// The point of the world that a point of the rooms is.
    #[must_use]
    pub fn world(&self, point: Vec3) -> Vec3 {
        (self.at + point.as_dvec3()).as_vec3()
    }

    /// The point of the rooms that a point of the world is.
    #[must_use]
    pub fn local(&self, world: Vec3) -> Vec3 {
        (world.as_dvec3() - self.at).as_vec3()
    }

    /// The same rooms about the world's origin.
    #[must_use]
    pub fn near(&self) -> Self {
        Self { at: DVec3::ZERO, ..*self }
    }

    /// Middle and size of each wall.
    fn slabs() -> [(DVec3, DVec3); 7] {
        let t = THICKNESS;
        let (x, y, z) = (4.0 + 0.5 * t, 3.0 + 0.5 * t, 2.0 + 0.5 * t);
        let level = DVec3::new(8.0 + 2.0 * t, t, 4.0 + 2.0 * t);
        let (side, end) = (DVec3::new(t, 3.0, 4.0), DVec3::new(8.0, 3.0, t));
        [
            (DVec3::new(0.0, -0.5 * t, 0.0), level),
            (DVec3::new(0.0, y, 0.0), level),
            (DVec3::new(-x, 1.5, 0.0), side + 2.0 * t * DVec3::Z),
            (DVec3::new(x, 1.5, 0.0), side + 2.0 * t * DVec3::Z),
            (DVec3::new(0.0, 1.5, -z), end),
            (DVec3::new(0.0, 1.5, z), end),
            (DVec3::new(0.0, 1.5, 0.0), side),
        ]
    }

    /// The scene that their file makes.
    ///
    /// # Panics
    /// Where the loader refuses it.
    #[must_use]
    pub fn scene(&self) -> Scene {
        Scene::from_glb("rooms", self.glb()).unwrap_or_else(|error| panic!("{error}"))
    }

    fn glb(&self) -> Vec<u8> {
        let lamp = json!({ "KHR_lights_punctual": { "light": 0 } });
        let lamp_at = self.at + Self::LAMP.as_dvec3();
        let cubes: Vec<(DVec3, DVec3)> = match self.placed {
            Placed::Baked => Self::slabs().map(|(at, size)| (self.at + at, size)).to_vec(),
            _ => vec![(DVec3::ZERO, DVec3::ONE)],
        };
        let mut nodes: Vec<Value> = Self::slabs()
            .iter()
            .enumerate()
            .map(|(n, (at, size))| match self.placed {
                Placed::Flat => node(0, self.at + *at, *size),
                Placed::Nested => node(0, *at, *size),
                Placed::Baked => json!({ "mesh": n }),
            })
            .collect();
        let mut roots: Vec<usize> = (0..nodes.len()).collect();
        let nested = self.placed == Placed::Nested;
        let at = if nested { Self::LAMP.as_dvec3() } else { lamp_at };
        nodes.push(json!({ "translation": at.to_array(), "extensions": lamp }));
        roots.push(nodes.len() - 1);
        if nested {
            let there =
                |children, at: DVec3| json!({ "children": children, "translation": at.to_array() });
            for at in [self.at, -self.at, self.at] {
                nodes.push(there(roots, at));
                roots = vec![nodes.len() - 1];
            }
        }
        let numbers: Vec<f32> = cubes.iter().flat_map(|(at, size)| cube(*at, *size)).collect();
        let bytes = 4 * 108;
        let accessor = |n: usize| {
            json!({ "bufferView": 0, "byteOffset": n * bytes, "componentType": 5126,
                    "type": "VEC3", "count": 36 })
        };
        let mesh = |n: usize| json!({ "primitives": [{ "attributes": { "POSITION": n }, "material": 0 }] });
        let (albedo, emission) = (Self::ALBEDO, self.emission);
        let light = json!({ "type": "point", "intensity": Self::INTENSITY });
        let file = json!({
            "asset": { "version": "2.0" },
            "extensionsUsed": ["KHR_lights_punctual", "KHR_materials_specular",
                               "KHR_materials_emissive_strength"],
            "extensions": { "KHR_lights_punctual": { "lights": [light] } },
            "scenes": [{ "nodes": roots }],
            "nodes": nodes,
            "meshes": (0..cubes.len()).map(mesh).collect::<Vec<_>>(),
            "materials": [{
                "pbrMetallicRoughness": {
                    "baseColorFactor": [albedo, albedo, albedo, 1.0], "metallicFactor": 0.0,
                },
                "emissiveFactor": [1.0, 1.0, 1.0],
                "extensions": {
                    "KHR_materials_specular": { "specularFactor": 0.0 },
                    "KHR_materials_emissive_strength": { "emissiveStrength": emission },
                },
            }],
            "buffers": [{ "byteLength": 4 * numbers.len() }],
            "bufferViews": [{ "buffer": 0, "byteLength": 4 * numbers.len() }],
            "accessors": (0..cubes.len()).map(accessor).collect::<Vec<_>>(),
        });
        let binary: Vec<u8> = numbers.iter().flat_map(|number| number.to_le_bytes()).collect();
        container(file.to_string().into_bytes(), &binary)
    }
}

fn node(mesh: usize, at: DVec3, size: DVec3) -> Value {
    json!({ "mesh": mesh, "translation": at.to_array(), "scale": size.to_array() })
}

/// The corners of a box's triangles, outside its front.
fn cube(at: DVec3, size: DVec3) -> Vec<f32> {
    let mut numbers = Vec::new();
    for axis in 0..3 {
        for sign in [-1.0, 1.0] {
            let (n, u) = (DVec3::AXES[axis] * sign, DVec3::AXES[(axis + 1) % 3]);
            let v = n.cross(u);
            let corner = |[a, b]: [f64; 2]| (at + 0.5 * size * (n + a * u + b * v)).as_vec3();
            let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(corner);
            for i in [0, 1, 2, 0, 2, 3] {
                numbers.extend(corners[i].to_array());
            }
        }
    }
    numbers
}
