//! The glTF 2.0 reader. It turns bytes into an [`Asset`](crate::asset::Asset), or a fault that says
//! where it is.
//!
//! It is total: any bytes give a value or an error. It allocates no more memory than the bytes and
//! the limits warrant.

mod accessor;
mod animation;
mod glossiness;
mod instancing;
mod json;
mod material;
mod mesh;
mod node;
mod skin;
pub(crate) mod source;
mod tangents;
mod texture;
mod uv_sets;
mod vertices;

use std::path::Path;
use std::sync::Arc;

use rayon::prelude::*;

use accessor::Accessors;
pub(crate) use mesh::face_normal;
use source::{Bytes, Container, Folder};

use crate::asset::{Asset, FileContents, SceneFile};
use crate::error::{At, Fault, invalid};
use crate::limits::Budget;
use crate::settings::Settings;

/// Extensions that the reader understands.
const KNOWN: &[&str] = &[
    "EXT_mesh_gpu_instancing",
    "KHR_lights_punctual",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_mesh_quantization",
    "KHR_node_visibility",
    "KHR_texture_transform",
    "EXT_texture_webp",
];

/// Reads a .gltf or .glb file whose name within the scene's folder is `name`.
pub(crate) fn read_file(
    path: &Path,
    name: &str,
    folder: &Folder,
    budget: &Budget,
) -> Result<Asset, Fault> {
    let bytes = folder.read_file(path).map_err(Fault::Read)?;
    let mut asset = read(bytes, Some(&folder.beside(name)), budget)?;
    let contents = FileContents::Path(path.to_owned());
    asset.files.insert(0, SceneFile { name: name.to_owned(), contents });
    Ok(asset)
}

/// Reads a .glb in memory that refers to no other files.
pub(crate) fn read_bytes(name: &str, bytes: Arc<[u8]>, budget: &Budget) -> Result<Asset, Fault> {
    let mut asset = read(bytes.to_vec(), None, budget)?;
    let contents = FileContents::Bytes(bytes);
    asset.files.insert(0, SceneFile { name: name.to_owned(), contents });
    Ok(asset)
}

fn read(bytes: Vec<u8>, folder: Option<&Folder>, budget: &Budget) -> Result<Asset, Fault> {
    let container = Container::open(bytes)?;
    let mut root: json::Root = serde_json::from_slice(&container.json).map_err(Fault::Json)?;
    let mut warnings = check_version_and_extensions(&root)?;
    if container.is_padded {
        warnings.push("NUL characters after its JSON are left out".into());
    }
    if root.trim_padding() {
        warnings.push("NUL characters at the end of names are left out".into());
    }
    let mut files = Vec::new();
    let buffers = read_buffers(&root, container.binary, folder, &mut files)?;
    let accessors = Accessors { root: &root, buffers: &buffers, budget };

    let images = texture::read_images(accessors, folder, &material::images_used(&root)?)?;
    let materials = material::read(&root, &images, budget, &mut warnings)?;
    let meshes = read_meshes(accessors, &materials, &mut warnings)?;
    let lights = node::lights(&root, &mut warnings)?;
    let mut nodes = node::read(&root, &lights, &mut warnings)?;
    instancing::read(accessors, &mut nodes, &mut warnings)?;
    let skins = (0..root.skins.len())
        .map(|index| skin::read_skin(accessors, index).map(Arc::new))
        .collect::<Result<Vec<_>, _>>()?;
    node::check_meshes(&nodes, &meshes, &skins)?;
    let animations = (0..root.animations.len())
        .map(|index| animation::read(accessors, index, &nodes, &meshes, &mut warnings))
        .collect::<Result<Vec<_>, _>>()?;

    files.extend(images.files);
    files.sort();
    files.dedup();
    let file = |(name, path)| SceneFile { name, contents: FileContents::Path(path) };
    Ok(Asset {
        roots: node::roots(&root, &nodes)?,
        nodes,
        meshes,
        materials,
        first_material: 0,
        skins,
        animations,
        cameras: node::cameras(&root, &mut warnings)?,
        settings: settings(&root)?,
        warnings,
        files: files.into_iter().map(file).collect(),
    })
}

fn check_version_and_extensions(root: &json::Root) -> Result<Vec<String>, Fault> {
    let version = root.asset.min_version.as_ref().unwrap_or(&root.asset.version);
    if version != "2.0" {
        return Err(invalid(format!("glTF of version {version:?}; 2.0 is read")));
    }
    let unknown = |name: &&String| !KNOWN.contains(&name.as_str());
    if let Some(name) = root.extensions_required.iter().find(unknown) {
        return Err(Fault::UnknownExtension(name.clone()));
    }
    let unknown = root.extensions_used.iter().filter(unknown);
    Ok(unknown.map(|name| format!("the extension {name} is not read")).collect())
}

fn read_buffers(
    root: &json::Root,
    binary: Option<Bytes>,
    folder: Option<&Folder>,
    files: &mut Vec<texture::Referred>,
) -> Result<Vec<Bytes>, Fault> {
    let mut buffers = Vec::with_capacity(root.buffers.len());
    for (index, json) in root.buffers.iter().enumerate() {
        let mut read = || -> Result<Bytes, Fault> {
            let Some(uri) = &json.uri else {
                let binary = if index == 0 { binary.clone() } else { None };
                return binary
                    .ok_or_else(|| invalid("it has no uri, and there is no binary chunk"));
            };
            if let Some(bytes) = source::data_uri(uri) {
                return bytes.map(Bytes::from);
            }
            let outside = || Fault::Outside { uri: source::shorten(uri) };
            let (name, path, bytes) = folder.ok_or_else(outside)?.read(uri)?;
            files.push((name, path));
            Ok(bytes.into())
        };
        let buffer = read().at(|| format!("buffer {index}"))?;
        if (buffer.len() as u64) < json.byte_length {
            let (there, said) = (buffer.len(), json.byte_length);
            return Err(invalid(format!(
                "buffer {index} has {there} bytes, not the {said} that it should; the file is cut off"
            )));
        }
        buffers.push(buffer);
    }
    Ok(buffers)
}

fn read_meshes(
    accessors: Accessors<'_>,
    materials: &[crate::Material],
    warnings: &mut Vec<String>,
) -> Result<Vec<Arc<crate::Mesh>>, Fault> {
    let read: Vec<_> = (0..accessors.root.meshes.len())
        .into_par_iter()
        .map(|index| mesh::read(accessors, index, materials))
        .collect::<Result<_, _>>()?;
    let mut meshes = Vec::with_capacity(read.len());
    for (mesh, notes) in read {
        meshes.push(Arc::new(mesh));
        warnings.extend(notes.warnings);
    }
    Ok(meshes)
}

/// `extras.lumencast` of the scene.
fn settings(root: &json::Root) -> Result<Settings, Fault> {
    let Some(scene) = root.scenes.get(root.scene.unwrap_or(0)) else {
        return Ok(Settings::default());
    };
    let Some(json) = scene.extras.get("lumencast") else { return Ok(Settings::default()) };
    let settings: Settings = serde_json::from_value(json.clone())
        .map_err(|e| invalid(format!("extras.lumencast of the scene: {e}")))?;
    settings.check().at(|| "extras.lumencast of the scene".into())?;
    Ok(settings)
}
