//! Sound bytes from which mutations start: the repository's vectors and a built-in scene.

use std::path::Path;

use base64::{Engine, prelude::BASE64_STANDARD};
use glam::{Quat, UVec3, Vec3};
use lumencast_codec::{LightFile, ProbeHeader, SceneInfo, UpdateInfo};
use lumencast_light::{FieldId, Grid, Order, ProbeVolume};
use lumencast_scene::{FileContents, Scene};
use serde_json::{Value, json};

use crate::packed;

/// A file of `vectors/`.
///
/// # Panics
/// Where it is not there, or no JSON.
fn vectors(name: &str) -> Value {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../vectors").join(name);
    let text = std::fs::read(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    serde_json::from_slice(&text).unwrap_or_else(|error| panic!("{name}: {error}"))
}

fn list(value: &Value) -> impl Iterator<Item = &Value> {
    value.as_array().into_iter().flatten()
}

/// Probe frames of one region, one after the other.
struct Sequence {
    size: UVec3,
    order: Order,
    frames: Vec<Vec<u8>>,
}

fn sequences() -> Vec<Sequence> {
    let vectors = vectors("codec.json");
    let bytes = |frame: &Value| BASE64_STANDARD.decode(frame["bytes"].as_str()?).ok();
    let sequence = |sequence: &Value| {
        let frames = list(&sequence["frames"]).filter_map(bytes).collect();
        let size = serde_json::from_value(sequence["size"].clone()).ok()?;
        let order = serde_json::from_value(sequence["order"].clone()).ok()?;
        Some(Sequence { size, order, frames })
    };
    list(&vectors["sequences"]).filter_map(sequence).collect()
}

/// Probe frames.
pub fn probe_frames() -> Vec<Vec<u8>> {
    sequences().into_iter().flat_map(|sequence| sequence.frames).collect()
}

/// Catalogs, state frames, and edits as clients send them.
pub fn frames() -> Vec<Vec<u8>> {
    let vectors = vectors("frames.json");
    let frames = list(&vectors["frames"]).map(|case| case["frame"].to_string().into_bytes());
    frames.chain(client_edits()).collect()
}

fn client_edits() -> Vec<Vec<u8>> {
    let vectors = vectors("edits.json");
    let edit = |(number, case): (usize, &Value)| {
        json!({ "seq": number + 1, "edit": case["json"] }).to_string().into_bytes()
    };
    list(&vectors["edits"]).enumerate().map(edit).collect()
}

/// Light of one volume as a server would save it, before there is any.
fn dark(size: UVec3, order: Order) -> LightFile {
    let grid = Grid {
        center: Vec3::ZERO,
        rotation: Quat::IDENTITY,
        size: size.as_vec3(),
        resolution: size,
    };
    let volume = ProbeVolume::dark(FieldId(0), grid, order);
    let scene = SceneInfo { name: "fuzz".into(), root: "fuzz.glb".into() };
    LightFile::of_fields(scene, "seed", [&volume.into()], UpdateInfo::default())
}

/// All that a client reads of a server: catalog, state and light.
pub fn reader() -> Vec<Vec<u8>> {
    let vectors = vectors("frames.json");
    let is_state = |case: &&Value| case["track"] == "state";
    let states = list(&vectors["frames"]).filter(is_state).map(|case| case["frame"].to_string());
    let mut states = states.collect::<Vec<_>>().into_iter().cycle();
    let mut stream = |sequence: Sequence| {
        let catalog = dark(sequence.size, sequence.order).catalog.encode();
        let mut stream = packed(b'c', &catalog);
        for frame in sequence.frames {
            stream.extend(
                states.next().map(|state| packed(b's', state.as_bytes())).unwrap_or_default(),
            );
            let layer = ProbeHeader::read(&frame).map_or(0, |header| header.info.layer());
            stream.extend(packed(layer, &frame));
        }
        stream
    };
    sequences().into_iter().map(&mut stream).collect()
}

/// What clients send.
pub fn edits() -> Vec<Vec<u8>> {
    client_edits().chunks(5).map(|lines| lines.join(&b'\n')).collect()
}

/// Saved light.
pub fn light_files() -> Vec<Vec<u8>> {
    let orders = [Order::L1, Order::L2, Order::L3, Order::L4];
    let file = |sequence: Sequence| {
        let mut file = dark(sequence.size, sequence.order);
        file.frames.iter_mut().zip(sequence.frames).for_each(|(saved, frame)| saved.bytes = frame);
        file.write()
    };
    let dark = orders.map(|order| dark(UVec3::splat(2), order).write());
    sequences().into_iter().map(file).chain(dark).collect()
}

/// A built-in scene, and a script.
pub fn scenes() -> Vec<Vec<u8>> {
    let cornell = Scene::builtin("cornell").map(|scene| scene.files().swap_remove(0).contents);
    let Some(FileContents::Bytes(glb)) = cornell else { return Vec::new() };
    let script = br#"{"at": 0.5, "edit": {"edit": "remove_node", "node": 3}}
{"repeat": 2}"#;
    vec![glb.to_vec(), script.to_vec()]
}
