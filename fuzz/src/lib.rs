//! What strangers' bytes must not do: panic, loop, or take memory without end.
//!
//! Each function is the body of a fuzz target. `cargo +nightly fuzz run --features libfuzzer frames`
//! runs one for as long as one likes; the tests feed each a counted number of mutated [`seeds`].

pub mod mutate;
pub mod seeds;

use std::sync::Arc;

use glam::{UVec2, UVec3};
use lumencast_cache::Cache;
use lumencast_codec::{
    Catalog, ClientEdit, Coding, LayoutResource, LightFile, LightTrack, LumelDecoder, LumelHeader,
    ProbeDecoder, ProbeHeader, StateFrame, layout_resources, read_charts,
};
use lumencast_light::{Charts, Layout, OnTriangle, Order, Rectangle, Surface, SurfaceId};
use lumencast_scene::{Edit, Scene, Script};
use lumencast_server::{Inbox, Limits, Verdict};

/// Probe frames, alone and one after another.
pub fn probe_frames(data: &[u8]) {
    // A frame that says its own size and order fits its region, so that payloads are reached.
    let (size, order) = match ProbeHeader::read(data) {
        Ok(header) => (header.size, header.order),
        Err(_) => (UVec3::splat(4), Order::L2),
    };
    let mut decoder = ProbeDecoder::new(size, order);
    // As one frame, and cut in two: the second may be a delta against the first.
    drop(decoder.decode(data));
    let (first, second) = data.split_at(data.len() / 2);
    drop(decoder.decode(first));
    if let Ok(light) = decoder.decode(second) {
        assert!(light.coefficients.iter().all(|c| !c.is_nan()));
    }
}

/// Lumel frames, alone and one after another.
pub fn lumel_frames(data: &[u8]) {
    // A frame that says its own size fits its tile, so that payloads are reached.
    let size = LumelHeader::read(data).map_or(UVec2::splat(8), |header| header.size);
    decode_lumels(data, Coding::Halves, size);
}

/// Lumel frames that hold video, alone and one after another.
pub fn video_frames(data: &[u8]) {
    decode_lumels(data, Coding::H264, UVec2::splat(seeds::VIDEO_SIDE));
}

fn decode_lumels(data: &[u8], coding: Coding, size: UVec2) {
    let mut decoder = LumelDecoder::new(coding, size);
    // As one frame, and cut in two: the second may be a delta against the first.
    drop(decoder.decode(data));
    let (first, second) = data.split_at(data.len() / 2);
    drop(decoder.decode(first));
    if let Ok(light) = decoder.decode(second) {
        assert_eq!(light.irradiance.len(), size.element_product() as usize);
        assert!(light.irradiance.iter().all(|c| c.is_finite() && c.min_element() >= 0.0));
    }
}

/// Layouts and charts: what is accepted can be read at any point, and is the same once it is written
/// and read again.
pub fn resources(data: &[u8]) {
    if let Ok(layout) = LayoutResource::read(data) {
        assert!(layout.charts().len() <= layout.surfaces.len());
        layout.layout(|_| Some(Arc::default()));
    }
    if let Ok(charts) = read_charts(data) {
        for triangle in 0..charts.triangles.len() {
            charts.at(triangle as u32, glam::Vec3::X);
        }
        let layout = layout_resources(&beside_each_other(charts.clone())).1.remove(0);
        assert_eq!(read_charts(layout.bytes()), Ok(charts));
    }
}

/// A layout of one surface, each of whose rectangles has a page.
fn beside_each_other(charts: Charts) -> Layout {
    let pages = charts.sizes.len() as u32;
    let rectangles = (0..pages).map(|page| Rectangle { page, corner: UVec2::ZERO }).collect();
    let surface = Surface { id: SurfaceId::default(), charts: Arc::new(charts), rectangles };
    Layout::new(4096, pages, vec![surface])
}

/// Catalogs, state frames and edits: what is accepted is the same once it is written and read again.
pub fn frames(data: &[u8]) {
    if let Ok(catalog) = Catalog::decode(data) {
        // Rotations are made of length 1, which may turn their last bits.
        let again = Catalog::decode(&catalog.encode()).expect("what was encoded");
        assert_eq!(again.fields.len(), catalog.fields.len());
        Cache::new().add_catalog(data, 0.0).expect("what decodes is taken in");
    }
    if let Ok(frame) = StateFrame::decode(data) {
        assert_eq!(StateFrame::decode(&frame.encode()).as_ref(), Ok(&frame));
    }
    if let Ok(edit) = ClientEdit::decode(data) {
        assert_eq!(ClientEdit::decode(&edit.encode()).as_ref(), Ok(&edit));
    }
}

/// What a client does with all that a server sends, as [`packed`] frames of its tracks in any order.
pub fn reader(mut data: &[u8]) {
    let mut cache = Cache::new();
    let mut now = 0.0;
    while let Some(([track, low, high], rest)) = data.split_first_chunk() {
        let length = usize::from(u16::from_le_bytes([*low, *high])).min(rest.len());
        let (frame, after) = rest.split_at(length);
        data = after;
        now += 0.04;
        match track {
            b'c' => drop(cache.add_catalog(frame, now)),
            b's' => drop(cache.add_state(frame, now)),
            b'r' => drop(cache.add_resource(frame)),
            layer => {
                let track = LightTrack { field: 0, region: 0, layer: layer % 4 };
                drop(cache.add_light(track, frame, now));
            }
        }
        let light = cache.light(now);
        assert!(light.irradiance(glam::Vec3::ZERO, glam::Vec3::Y).is_finite());
        for lightmap in light.lightmaps() {
            for surface in lightmap.layout.surfaces() {
                let (surface, weights) = (surface.id, glam::Vec3::X);
                let point = OnTriangle { surface, triangle: 0, weights };
                let read = lightmap.irradiance_on(&point, glam::Vec3::Y, glam::Vec3::X);
                assert!(read.is_none_or(|irradiance| !irradiance.is_nan()));
            }
        }
        cache.scene_events();
    }
}

/// A frame of [`reader`]: its track (`c`atalog, `s`tate, `r`esource, or the number of a layer), its length in two
/// bytes, and what it holds.
pub fn packed(track: u8, frame: &[u8]) -> Vec<u8> {
    let [low, high] = (frame.len() as u16).to_le_bytes();
    [&[track, low, high], frame].concat()
}

/// Saved light.
pub fn light_file(data: &[u8]) {
    if let Ok(file) = LightFile::read(data) {
        LightFile::read(&file.write()).expect("what was written");
        drop(file.fields());
        drop(Cache::new().load(data, 0.0));
    }
}

/// What a server does with clients' frames, each a line, of two clients in turn.
pub fn edits(data: &[u8]) {
    let Some(mut scene) = Scene::builtin("cornell") else { return };
    let mut inbox = Inbox::new(Limits::default());
    for (number, frame) in data.split(|byte| *byte == b'\n').enumerate() {
        let (client, now) = (["a", "b"][number % 2], 0.01 * number as f64);
        let verdict = inbox.receive(client, frame, now);
        assert!(verdict != Verdict::CutOff || number > 2 * Limits::default().rubbish as usize);
    }
    let mail = inbox.take(10.0);
    for received in &mail.edits {
        assert!(received.seq <= mail.acks[&received.client], "each is acknowledged");
        apply(&mut scene, &received.edit);
    }
}

/// The glTF reader, and scripts of edits.
pub fn scene(data: &[u8]) {
    if let Ok(mut scene) = Scene::from_glb("fuzz", data.to_vec()) {
        scene.snapshot();
        scene.advance(0.3);
        scene.snapshot();
        scene.edits_since_load();
    }
    if let Ok(text) = std::str::from_utf8(data)
        && let Ok(script) = Script::parse(text)
    {
        script.due(0.0, 1.0).count();
    }
}

/// Applies an edit as a server does; what is accepted is followed by every replica.
fn apply(scene: &mut Scene, edit: &Edit) {
    let mut replica = scene.pristine(scene.time());
    for edit in scene.edits_since_load() {
        replica.replay(&edit).expect("an own edit");
    }
    if let Ok(edit) = scene.apply(edit) {
        replica.replay(&edit).expect("what the server accepts is followed");
        scene.snapshot();
        scene.edits_since_load();
    }
}
