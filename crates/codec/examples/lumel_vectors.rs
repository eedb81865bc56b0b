//! Writes `vectors/lumels.json`, by which every decoder of lumel frames is tested:
//! `cargo run -p lumencast-codec --example lumel_vectors > vectors/lumels.json`.
//!
//! `sequences`: each is for one decoder, frames in order. `irradiance` is the FNV-1a hash (32 bits) of
//! the decoded lumels' little-endian f32 bits, r, g, b by turns; `first` the first of them. `changed`
//! tells whether any lumel is another than in the frame before. `error` is the kind of the error where
//! a frame is to be refused. `mutations`: the frame of a sequence with one byte replaced, given to a
//! decoder that has decoded those before it; the hash, or null where it is to be refused. `slopes`: the
//! keyframe of a tile of slopes, and the slopes of its first lumels.

#![expect(clippy::print_stdout, reason = "its purpose is to print a file")]

use std::ops::Range;
use std::sync::Arc;

use base64::{Engine, prelude::BASE64_STANDARD};
use glam::{UVec2, Vec3};
use lumencast_codec::{
    Coding, DecodeError, LightmapShape, LumelCoding, LumelDecoder, LumelEncoder, UpdateInfo,
};
use lumencast_light::{FieldId, Layout, Lightmap, STEEPEST, Told};
use lumencast_testkit::vectors::fnv;
use serde_json::{Value, json};

use crate::noise::Noise;

mod noise;

fn main() {
    let sequences = [
        sequence("a gradient that flickers", 20, 0, 0..6, flickering),
        sequence("one lumel", 1, 0, 0..4, flickering),
        sequence("a block and a lumel more", 9, 0, 0..5, flickering),
        sequence("the last column of a page", 257, 1, 0..3, standing),
        sequence("the last row of a page", 257, 2, 0..3, standing),
        sequence("nothing changes", 40, 0, 0..4, standing),
        sequence("all becomes brighter at once", 24, 0, 0..5, dimmed),
        sequence("one block changes", 40, 0, 0..5, one_block),
        sequence("noise", 16, 0, 0..4, noise),
        sequence("dark, then light", 12, 0, 0..4, |at, update, noise| {
            flickering(at, update, noise) * if update < 2 { 0.0 } else { 1.0 }
        }),
        sequence("scales that change", 12, 0, 0..6, |at, update, noise| {
            flickering(at, update, noise) * (5.0 * update as f32).exp2()
        }),
        sequence("a keyframe amid the sequence", 10, 0, 58..63, flickering),
        sequence("large update numbers", 8, 0, (1 << 40)..(1 << 40) + 4, flickering),
        sequence("100 klx beside 0.001 lx", 16, 0, 0..4, |at, update, noise| {
            flickering(at, update, noise) * if at.x < 8 { 1e3 } else { 1e-5 }
        }),
    ];
    let mutations: Vec<Value> = sequences.iter().enumerate().flat_map(mutations).collect();
    let sequences: Vec<Value> = sequences
        .iter()
        .map(|s| json!({ "name": s.name, "size": s.size, "frames": s.expected() }))
        .collect();
    let all = json!({
        "sequences": sequences, "malformed": malformed(), "mutations": mutations,
        "slopes": slopes(),
    });
    println!("{}", serde_json::to_string_pretty(&all).expect("plain values"));
}

struct Sequence {
    name: &'static str,
    size: UVec2,
    frames: Vec<Vec<u8>>,
}

/// The frames of one tile of a page, of light that is told by place and number of the update.
fn sequence(
    name: &'static str,
    page_size: u32,
    region: u32,
    updates: Range<u64>,
    light: impl Fn(UVec2, u64, &mut Noise) -> Vec3,
) -> Sequence {
    let layout = Arc::new(Layout::new(page_size, 1, Vec::new()));
    let mut lightmap = Lightmap::dark(FieldId(0), layout);
    let shape = LightmapShape::of(&lightmap, Coding::Halves);
    let size = shape.tile(region).expect("a tile").size;
    let mut encoder = LumelEncoder::new(shape, LumelCoding::Halves);
    let mut noise = Noise(page_size.into());
    let first = updates.start;
    let mut frames = Vec::new();
    for update in updates {
        for (number, lumel) in (0..).zip(&mut lightmap.irradiance) {
            let at = UVec2::new(number % page_size, number / page_size);
            *lumel = light(at, update - first, &mut noise);
        }
        let info = UpdateInfo {
            update,
            tick: 2 * update + 7,
            time: 0.04 * update as f64,
            scene_version: update / 3,
        };
        let encoded = encoder.encode(&lightmap, info, |watched| watched == region).expect("frames");
        frames.extend(encoded.into_iter().map(|frame| frame.bytes));
    }
    Sequence { name, size, frames }
}

/// A tile of slopes, from one bound to the other.
fn slopes() -> Value {
    let mut lightmap = Lightmap::dark(FieldId(0), Arc::new(Layout::new(8, 1, Vec::new())));
    for (lumel, slope) in (0..).zip(lightmap.told_mut(Told::Slopes)) {
        let t = lumel as f32 / 63.0;
        *slope = Vec3::new(STEEPEST - 2.0 * STEEPEST * t, 0.0, 0.3 - t);
    }
    let shape = LightmapShape::of(&lightmap, Coding::Halves);
    let tile = shape.tiles().find(|tile| tile.told == Told::Slopes).expect("a tile of slopes");
    let mut encoder = LumelEncoder::new(shape, LumelCoding::Halves);
    let encoded = encoder.encode(&lightmap, UpdateInfo::default(), |region| region == tile.id);
    let bytes = &encoded.expect("frames")[0].bytes;
    let light = LumelDecoder::new(Coding::Halves, tile.size).decode(bytes).expect("slopes");
    let first = &light.told(Told::Slopes)[..16];
    json!({ "region": tile.id, "size": tile.size, "bytes": BASE64_STANDARD.encode(bytes), "first": first })
}

/// A gradient with an edge.
fn standing(at: UVec2, _: u64, _: &mut Noise) -> Vec3 {
    let shade = if at.x + at.y / 3 > 14 { 0.2 } else { 1.0 };
    shade * Vec3::new(100.0 + at.x as f32, 150.0 + at.y as f32, 90.0)
}

/// The same with some noise, but for a stripe that stands still.
fn flickering(at: UVec2, update: u64, noise: &mut Noise) -> Vec3 {
    let flicker = if at.y / 8 == 1 { Vec3::ZERO } else { 0.02 * noise.vector() };
    standing(at, update, noise) * (Vec3::ONE + flicker)
}

fn dimmed(at: UVec2, update: u64, noise: &mut Noise) -> Vec3 {
    standing(at, update, noise) * (1.0 + 0.1 * update as f32)
}

fn one_block(at: UVec2, update: u64, noise: &mut Noise) -> Vec3 {
    let bright = at / 8 == UVec2::new(2, 1 + update as u32 % 3);
    standing(at, update, noise) * if bright { 1.5 } else { 1.0 }
}

fn noise(_: UVec2, _: u64, noise: &mut Noise) -> Vec3 {
    (10.0 * noise.vector()).exp2()
}

impl Sequence {
    fn expected(&self) -> Vec<Value> {
        let mut decoder = LumelDecoder::new(Coding::Halves, self.size);
        let mut before = None;
        let mut frames = Vec::new();
        for frame in &self.frames {
            let light = decoder.decode(frame).expect("a frame of the encoder");
            let header = light.head;
            frames.push(json!({
                "bytes": BASE64_STANDARD.encode(frame),
                "update": header.info.update,
                "base": header.base,
                "tick": header.info.tick,
                "time": header.info.time,
                "scene_version": header.info.scene_version,
                "scale_log2": header.scale_log2,
                "irradiance": fnv(&light.irradiance),
                "first": light.irradiance[0],
                "changed": before.as_ref() != Some(&light.irradiance),
            }));
            before = Some(light.irradiance);
        }
        frames
    }
}

fn mutations((index, sequence): (usize, &Sequence)) -> Vec<Value> {
    let mut noise = Noise(index as u64);
    (0..24)
        .map(|_| {
            let frame = noise.next() as usize % sequence.frames.len();
            let offset = noise.next() as usize % sequence.frames[frame].len();
            let byte = noise.next() as u8;
            let mut bytes = sequence.frames[frame].clone();
            bytes[offset] = byte;
            let mut decoder = LumelDecoder::new(Coding::Halves, sequence.size);
            for earlier in &sequence.frames[..frame] {
                decoder.decode(earlier).expect("a frame of the encoder");
            }
            let result = decoder.decode(&bytes).ok().map(|light| fnv(&light.irradiance));
            json!({ "sequence": index, "frame": frame, "offset": offset, "byte": byte, "irradiance": result })
        })
        .collect()
}

/// Frames for a decoder of 9×9 lumels that holds nothing.
fn malformed() -> Vec<Value> {
    let page = 9;
    let small = sequence("", page, 0, 0..2, noise);
    let (key, delta) = (&small.frames[0], &small.frames[1]);
    let with = |frame: &[u8], offset: usize, byte: u8| {
        let mut frame = frame.to_vec();
        frame[offset] = byte;
        frame
    };
    // Offsets while all varints have one byte.
    let (flags, distance, width, height, payload) = (1, 3, 15, 16, 17);
    let mut wide = key.clone();
    wide.splice(width..=width, [0x81, 0x02]);
    let mut huge = key.clone();
    huge.splice(width..=width, [0xFF, 0xFF, 0xFF, 0xFF, 0x7F]);
    let mut trailing = key.clone();
    trailing.extend([1; 8]);
    // Every bit is a 1, as of residuals of all digits.
    let ones = [&key[..payload], &[0], &[0xFF; 200]].concat();
    [
        ("nothing", Vec::new()),
        ("another version", with(key, 0, 2)),
        ("an unknown flag", with(key, flags, 3)),
        ("a keyframe with a base", with(key, distance, 1)),
        ("a base that is missing", delta.clone()),
        ("a header cut short", key[..height].to_vec()),
        ("no lumels", with(key, width, 0)),
        ("no rows", with(key, height, 0)),
        ("257 lumels along a side", wide),
        ("2^35 - 1 lumels along a side", huge),
        ("a size other than the tile's", with(key, width, 8)),
        ("a payload that starts with 1", with(key, payload, 1)),
        ("a payload cut short", key[..payload + 20].to_vec()),
        ("residuals of all digits", ones),
        ("bytes after the end", trailing),
    ]
    .into_iter()
    .map(|(name, bytes)| {
        let error = LumelDecoder::new(Coding::Halves, UVec2::splat(page)).decode(&bytes);
        let kind = error.as_ref().map_err(DecodeError::kind).expect_err(name);
        json!({ "name": name, "bytes": BASE64_STANDARD.encode(&bytes), "error": kind })
    })
    .collect()
}
