//! Writes .glb files, with the parts of glTF that the built-in scenes and tests need.

use glam::Vec3;
use serde_json::{Map, Value, json};

use super::shapes::Shape;

/// A .glb file under construction. Each added object gets the next index of its kind.
#[derive(Debug, Default)]
pub(crate) struct Writer {
    json: Map<String, Value>,
    binary: Vec<u8>,
}

impl Writer {
    /// Adds an object to one of glTF's arrays.
    pub(crate) fn add(&mut self, array: &str, object: Value) -> usize {
        let array = self.json.entry(array).or_insert_with(|| json!([]));
        match array {
            Value::Array(objects) => {
                objects.push(object);
                objects.len() - 1
            }
            _ => 0,
        }
    }

    /// Adds an accessor of floats; `kind` is "SCALAR", "VEC2", "VEC3", ….
    pub(crate) fn floats(&mut self, kind: &str, values: &[f32]) -> usize {
        let components = match kind {
            "VEC2" => 2,
            "VEC3" => 3,
            "VEC4" => 4,
            "MAT4" => 16,
            _ => 1,
        };
        let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        let view = self.view(&bytes);
        let bound = |pick: fn(f32, f32) -> f32| -> Vec<f32> {
            let component = |c| values.iter().skip(c).step_by(components).copied();
            (0..components).map(|c| component(c).reduce(pick).unwrap_or(0.0)).collect()
        };
        let accessor = json!({
            "bufferView": view, "componentType": 5126, "type": kind,
            "count": values.len() / components,
            "min": bound(f32::min), "max": bound(f32::max),
        });
        self.add("accessors", accessor)
    }

    pub(crate) fn vectors(&mut self, values: &[Vec3]) -> usize {
        self.floats("VEC3", bytemuck::cast_slice(values))
    }

    /// Adds an accessor of indices.
    pub(crate) fn indices(&mut self, triangles: &[[u32; 3]]) -> usize {
        let bytes: Vec<u8> = triangles.iter().flatten().flat_map(|i| i.to_le_bytes()).collect();
        let view = self.view(&bytes);
        let count = triangles.len() * 3;
        let accessor =
            json!({ "bufferView": view, "componentType": 5125, "type": "SCALAR", "count": count });
        self.add("accessors", accessor)
    }

    /// Adds bytes, four-byte aligned.
    pub(crate) fn view(&mut self, bytes: &[u8]) -> usize {
        let offset = self.binary.len();
        self.binary.extend_from_slice(bytes);
        self.binary.resize(self.binary.len().next_multiple_of(4), 0);
        let view = json!({ "buffer": 0, "byteOffset": offset, "byteLength": bytes.len() });
        self.add("bufferViews", view)
    }

    /// Adds a mesh of shapes, each with its material.
    pub(crate) fn mesh(&mut self, name: &str, parts: &[(&Shape, usize)]) -> usize {
        let primitives: Vec<Value> = parts
            .iter()
            .map(|(shape, material)| {
                let attributes = json!({
                    "POSITION": self.vectors(&shape.positions),
                    "NORMAL": self.vectors(&shape.normals),
                });
                let indices = self.indices(&shape.triangles);
                json!({ "attributes": attributes, "indices": indices, "material": material })
            })
            .collect();
        self.add("meshes", json!({ "name": name, "primitives": primitives }))
    }

    /// Adds a diffuse material.
    pub(crate) fn diffuse(&mut self, name: &str, color: [f32; 3]) -> usize {
        self.surface(name, color, 1.0)
    }

    /// Adds a dielectric material of this perceptual roughness.
    pub(crate) fn surface(&mut self, name: &str, color: [f32; 3], roughness: f32) -> usize {
        self.dielectric(name, color, roughness, false)
    }

    /// Adds a dielectric material for surfaces that are seen from both sides.
    pub(crate) fn two_sided(&mut self, name: &str, color: [f32; 3], roughness: f32) -> usize {
        self.dielectric(name, color, roughness, true)
    }

    fn dielectric(&mut self, name: &str, color: [f32; 3], roughness: f32, both: bool) -> usize {
        let [r, g, b] = color;
        let pbr = json!({
            "baseColorFactor": [r, g, b, 1.0], "metallicFactor": 0.0, "roughnessFactor": roughness,
        });
        let material = json!({ "name": name, "pbrMetallicRoughness": pbr, "doubleSided": both });
        self.add("materials", material)
    }

    /// Adds a black material that emits `radiance` (cd/m²) from its front.
    pub(crate) fn emitter(&mut self, name: &str, radiance: [f32; 3]) -> usize {
        let strength = radiance.into_iter().fold(1.0, f32::max);
        let pbr = json!({ "baseColorFactor": [0.0, 0.0, 0.0, 1.0], "metallicFactor": 0.0 });
        let material = json!({
            "name": name, "pbrMetallicRoughness": pbr,
            "emissiveFactor": radiance.map(|r| r / strength),
            "extensions": { "KHR_materials_emissive_strength": { "emissiveStrength": strength } },
        });
        self.uses("KHR_materials_emissive_strength");
        self.add("materials", material)
    }

    /// Adds a node.
    pub(crate) fn node(&mut self, node: Value) -> usize {
        self.add("nodes", node)
    }

    /// Adds a KHR_lights_punctual light and a node that carries it.
    pub(crate) fn light(&mut self, light: Value, mut node: Value) -> usize {
        self.uses("KHR_lights_punctual");
        let extensions = self.json.entry("extensions").or_insert_with(|| json!({}));
        let lights = &mut extensions["KHR_lights_punctual"]["lights"];
        if !lights.is_array() {
            *lights = json!([]);
        }
        let index = lights.as_array().map_or(0, Vec::len);
        if let Some(lights) = lights.as_array_mut() {
            lights.push(light);
        }
        node["extensions"] = json!({ "KHR_lights_punctual": { "light": index } });
        self.node(node)
    }

    /// Adds a perspective camera (vertical field of view, radians) and a node that carries it.
    pub(crate) fn camera(&mut self, name: &str, yfov: f32, mut node: Value) -> usize {
        let perspective = json!({ "yfov": yfov, "znear": 0.05, "zfar": 100.0 });
        let camera = json!({ "name": name, "type": "perspective", "perspective": perspective });
        node["camera"] = self.add("cameras", camera).into();
        self.node(node)
    }

    /// Adds an animation of one property of one node.
    pub(crate) fn animation(
        &mut self,
        name: &str,
        (node, path): (usize, &str),
        interpolation: &str,
        times: &[f32],
        (kind, values): (&str, &[f32]),
    ) -> usize {
        let (input, output) = (self.floats("SCALAR", times), self.floats(kind, values));
        let sampler = json!({ "input": input, "output": output, "interpolation": interpolation });
        let channel = json!({ "sampler": 0, "target": { "node": node, "path": path } });
        let animation = json!({ "name": name, "samplers": [sampler], "channels": [channel] });
        self.add("animations", animation)
    }

    fn uses(&mut self, extension: &str) {
        let used = self.json.entry("extensionsUsed").or_insert_with(|| json!([]));
        if let Some(used) = used.as_array_mut()
            && !used.iter().any(|name| name == extension)
        {
            used.push(extension.into());
        }
    }

    /// The file, with a scene of all nodes that have no parent.
    pub(crate) fn finish(self, extras: Value) -> Vec<u8> {
        let nodes = self.json.get("nodes").and_then(Value::as_array).cloned().unwrap_or_default();
        let children: Vec<u64> = nodes
            .iter()
            .filter_map(|node| node.get("children")?.as_array())
            .flatten()
            .filter_map(Value::as_u64)
            .collect();
        let roots: Vec<u64> =
            (0..nodes.len() as u64).filter(|node| !children.contains(node)).collect();
        self.finish_as(json!({ "nodes": roots, "extras": extras }))
    }

    /// The file, with this scene.
    pub(crate) fn finish_as(mut self, scene: Value) -> Vec<u8> {
        let entry = |json: &mut Map<String, Value>, key: &str, value| {
            json.entry(key).or_insert(value);
        };
        entry(&mut self.json, "asset", json!({ "version": "2.0", "generator": "lumencast" }));
        entry(&mut self.json, "scene", json!(0));
        entry(&mut self.json, "scenes", json!([scene]));
        entry(&mut self.json, "buffers", json!([{ "byteLength": self.binary.len() }]));
        container(&Value::Object(self.json).to_string(), &self.binary)
    }
}

/// Packs JSON and a binary chunk into a .glb.
pub(crate) fn container(json: &str, binary: &[u8]) -> Vec<u8> {
    let mut json = json.as_bytes().to_vec();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut glb = b"glTF".to_vec();
    let length = 12 + 8 + json.len() + 8 + binary.len();
    for word in [2, length as u32, json.len() as u32] {
        glb.extend_from_slice(&word.to_le_bytes());
    }
    glb.extend_from_slice(b"JSON");
    glb.extend_from_slice(&json);
    glb.extend_from_slice(&(binary.len() as u32).to_le_bytes());
    glb.extend_from_slice(b"BIN\0");
    glb.extend_from_slice(binary);
    glb
}
