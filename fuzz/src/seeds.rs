//! Sound bytes from which mutations start: the repository's vectors and a built-in scene.

use std::path::Path;
use std::sync::Arc;

use base64::{Engine, prelude::BASE64_STANDARD};
use glam::{Quat, UVec2, UVec3, Vec2, Vec3};
use lumencast_codec::{
    FieldEncoder, LightFile, LumelCoding, ProbeHeader, Qp, Resource, SceneInfo, UpdateInfo,
    layout_resources,
};
use lumencast_light::{
    ChartVertex, Charts, Field, FieldId, Grid, Layout, Lightmap, Order, ProbeVolume, Rectangle,
    Surface, SurfaceId,
};
use lumencast_scene::{FileContents, Scene};
use serde_json::{Value, json};

use crate::packed;

/// Lumels along a side of the pages of [`video_frames`].
pub const VIDEO_SIDE: u32 = 20;

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

/// A page on which two surfaces share charts, lit so brightly.
fn lightmap(brightness: f32) -> Lightmap {
    let at = |x: f32, y: f32| ChartVertex { source: 0, rectangle: 0, at: Vec2::new(x, y) };
    let charts = Arc::new(Charts {
        sizes: vec![UVec2::splat(8)],
        vertices: vec![at(0.5, 0.5), at(7.25, 0.5), at(0.5, 7.5)],
        triangles: vec![[0, 1, 2], Charts::NOWHERE],
    });
    let surface = |node: u32| Surface {
        id: SurfaceId { node, ..SurfaceId::default() },
        charts: charts.clone(),
        rectangles: vec![Rectangle { page: 0, corner: UVec2::new(8 * node, 0) }],
    };
    let layout = Layout::new(VIDEO_SIDE, 1, vec![surface(0), surface(1)]);
    let mut lightmap = Lightmap::dark(FieldId(0), Arc::new(layout));
    for (lumel, value) in lightmap.irradiance.iter_mut().enumerate() {
        *value = brightness * Vec3::new(1.0, 2.0, (lumel % 7) as f32);
    }
    lightmap
}

/// Lumel frames of one tile, as halves: a keyframe and deltas.
pub fn lumel_frames() -> Vec<Vec<u8>> {
    frames_of_lumels(LumelCoding::Halves)
}

/// The same of a page, as video.
pub fn video_frames() -> Vec<Vec<u8>> {
    frames_of_lumels(LumelCoding::H264(Qp::new(18).expect("a parameter")))
}

fn frames_of_lumels(coding: LumelCoding) -> Vec<Vec<u8>> {
    let updates = [1.0, 1.0, 1.1, 3.0].map(|brightness| Field::from(lightmap(brightness)));
    let mut encoder = FieldEncoder::new(&updates[0], coding);
    let mut encode = |(update, field): (u64, &Field)| {
        let info = UpdateInfo { update, tick: update, ..UpdateInfo::default() };
        let frames = encoder.encode(field, info, |_| true).expect("frames");
        frames.into_iter().next().map(|frame| frame.bytes)
    };
    (0..).zip(&updates).filter_map(&mut encode).collect()
}

/// Layouts, and charts.
pub fn resources() -> Vec<Vec<u8>> {
    let (layout, charts) = layout_resources(&lightmap(1.0).layout);
    charts.into_iter().chain([layout]).map(Resource::into_bytes).collect()
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

/// A lightmap as a server would save it.
fn saved_lightmap() -> LightFile {
    let scene = SceneInfo { name: "fuzz".into(), root: "fuzz.glb".into() };
    let field = lightmap(1.0).with_slopes(true).into();
    LightFile::of_fields(scene, "seed", [&field], UpdateInfo::default())
}

/// All that a client reads of a lightmap: its catalog, layout, charts and light.
fn lightmap_stream() -> Vec<u8> {
    let catalog = saved_lightmap().catalog.encode();
    let (layout, charts) = layout_resources(&lightmap(1.0).layout);
    let resources = std::iter::once(layout).chain(charts);
    let resources = resources.flat_map(|resource| packed(b'r', resource.bytes()));
    let light = lumel_frames().into_iter().flat_map(|frame| packed(0, &frame));
    packed(b'c', &catalog).into_iter().chain(resources).chain(light).collect()
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
    let volumes: Vec<Vec<u8>> = sequences().into_iter().map(&mut stream).collect();
    volumes.into_iter().chain([lightmap_stream()]).collect()
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
    sequences().into_iter().map(file).chain(dark).chain([saved_lightmap().write()]).collect()
}

/// A built-in scene, and a script.
pub fn scenes() -> Vec<Vec<u8>> {
    let cornell = Scene::builtin("cornell").map(|scene| scene.files().swap_remove(0).contents);
    let Some(FileContents::Bytes(glb)) = cornell else { return Vec::new() };
    let script = br#"{"at": 0.5, "edit": {"edit": "remove_node", "node": 3}}
{"repeat": 2}"#;
    vec![glb.to_vec(), script.to_vec()]
}
