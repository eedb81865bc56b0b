//! Writes `vectors/codec.json`, by which every decoder of probe frames is tested:
//! `cargo run -p lumencast-codec --example codec_vectors > vectors/codec.json`.
//!
//! `sequences`: each is for one decoder, frames in order. `coefficients` is the FNV-1a hash (32 bits)
//! of the decoded coefficients' little-endian f32 bits, r, g, b by turns; `first` the first of them.
//! `error` is the kind of the error where a frame is to be refused. `mutations`: the frame of a
//! sequence with one byte replaced, given to a decoder that has decoded those before it; the hash,
//! or null where it is to be refused.

#![expect(clippy::print_stdout, reason = "its purpose is to print a file")]

use base64::{Engine, prelude::BASE64_STANDARD};
use glam::{Quat, UVec3, Vec3};
use lumencast_codec::{DecodeError, ProbeDecoder, ProbeEncoder, UpdateInfo};
use lumencast_light::{FieldId, Grid, Order, ProbeVolume};
use lumencast_testkit::vectors::fnv;
use serde_json::{Value, json};

use crate::noise::Noise;

mod noise;

fn main() {
    let sequences = [
        sequence("keyframe and deltas, L2", [4, 3, 2], Order::L2, 1.0, 0..13),
        sequence("L1", [5, 1, 3], Order::L1, 1.0, 0..6),
        sequence("L3", [2, 3, 3], Order::L3, 1.0, 0..5),
        sequence("L4", [1, 2, 2], Order::L4, 1.0, 0..5),
        sequence("one probe", [1, 1, 1], Order::L2, 1.0, 0..5),
        sequence("dark", [4, 4, 4], Order::L2, 0.0, 0..5),
        sequence("100 klx", [3, 3, 3], Order::L2, 45_000.0, 0..5),
        sequence("0.001 lx", [3, 3, 3], Order::L2, 3e-4, 0..5),
        sequence("a full brick", [8, 8, 8], Order::L2, 100.0, 0..3),
        sequence("large update numbers", [2, 2, 2], Order::L2, 1.0, (1 << 40)..(1 << 40) + 9),
    ];
    let mutations: Vec<Value> = sequences.iter().enumerate().flat_map(mutations).collect();
    let sequences: Vec<Value> = sequences
        .iter()
        .map(|s| json!({ "name": s.name, "size": s.size, "order": u8::from(s.order), "frames": s.expected() }))
        .collect();
    let all = json!({ "sequences": sequences, "malformed": malformed(), "mutations": mutations });
    println!("{}", serde_json::to_string_pretty(&all).expect("plain values"));
}

struct Sequence {
    name: &'static str,
    size: UVec3,
    order: Order,
    frames: Vec<Vec<u8>>,
}

/// Light with a gradient, a dark corner and a bright one, that flickers a little.
fn sequence(
    name: &'static str,
    size: [u32; 3],
    order: Order,
    brightness: f32,
    updates: std::ops::Range<u64>,
) -> Sequence {
    let size = UVec3::from_array(size);
    let grid =
        Grid { center: Vec3::ZERO, rotation: Quat::IDENTITY, size: Vec3::ONE, resolution: size };
    let mut volume = ProbeVolume::dark(FieldId(0), grid, order);
    let mut encoder = ProbeEncoder::new(size, order);
    let mut noise = Noise(u64::from(order.band() as u32) + 1);
    let mut frames = Vec::new();
    for update in updates {
        for probe in 0..grid.probe_count() {
            // Every seventh probe is much darker, every eleventh stands still after the first update.
            let own = if probe % 7 == 3 { 1e-4 } else { 1.0 + 0.1 * probe as f32 };
            if probe % 11 == 5 && !frames.is_empty() {
                continue;
            }
            for (i, c) in volume.probe_mut(probe).iter_mut().enumerate() {
                let mean =
                    if i == 0 { Vec3::new(1.0, 0.8, 0.6) } else { Vec3::splat(0.3 / i as f32) };
                *c = brightness * own * (mean + 0.05 * noise.vector());
            }
        }
        let info = UpdateInfo {
            update,
            tick: 2 * update + 7,
            time: 0.04 * update as f64,
            scene_version: update / 3,
        };
        frames.extend(encoder.encode(&volume, info, |_| true).into_iter().map(|frame| frame.bytes));
    }
    Sequence { name, size, order, frames }
}

impl Sequence {
    fn expected(&self) -> Vec<Value> {
        let mut decoder = ProbeDecoder::new(self.size, self.order);
        self.frames
            .iter()
            .map(|frame| {
                let light = decoder.decode(frame).expect("a frame of the encoder");
                let header = light.header;
                json!({
                    "bytes": BASE64_STANDARD.encode(frame),
                    "update": header.info.update,
                    "layer": header.info.layer(),
                    "base": header.base,
                    "tick": header.info.tick,
                    "time": header.info.time,
                    "scene_version": header.info.scene_version,
                    "scale_log2": header.scale_log2,
                    "coefficients": fnv(&light.coefficients),
                    "first": light.coefficients[0],
                })
            })
            .collect()
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
            let mut decoder = ProbeDecoder::new(sequence.size, sequence.order);
            for earlier in &sequence.frames[..frame] {
                decoder.decode(earlier).expect("a frame of the encoder");
            }
            let result = decoder.decode(&bytes).ok().map(|light| fnv(&light.coefficients));
            json!({ "sequence": index, "frame": frame, "offset": offset, "byte": byte, "coefficients": result })
        })
        .collect()
}

/// Frames for a decoder of 2×1×1 probes, order 2, that holds nothing.
fn malformed() -> Vec<Value> {
    let one = sequence("", [2, 1, 1], Order::L2, 1.0, 0..2);
    let (key, delta) = (&one.frames[0], &one.frames[1]);
    let with = |frame: &[u8], offset: usize, byte: u8| {
        let mut frame = frame.to_vec();
        frame[offset] = byte;
        frame
    };
    // Offsets while all varints have one byte.
    let (flags, update, distance, time, order, x, payload) = (1, 2, 3, 6, 15, 16, 19);
    let mut nan = key.clone();
    nan[time..time + 8].copy_from_slice(&f64::NAN.to_le_bytes());
    let mut long = vec![1, 1];
    long.extend([0x80; 10]);
    let mut beyond = vec![1, 1];
    beyond.extend([0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0x7F]);
    let mut trailing = key.clone();
    trailing.extend([1; 8]);
    [
        ("nothing", Vec::new()),
        ("another version", with(key, 0, 2)),
        ("an unknown flag", with(key, flags, 3)),
        ("a keyframe with a base", with(key, distance, 1)),
        ("a delta without a base", with(delta, distance, 0)),
        ("a base before update 0", with(delta, distance, 2)),
        ("a base in a higher layer", with(&with(delta, update, 4), distance, 1)),
        ("a base that is missing", delta.clone()),
        ("a header cut short", key[..12].to_vec()),
        ("a varint of 10 bytes", long),
        ("a varint of 2^53 and more", beyond),
        ("time that is no number", nan),
        ("order 0", with(key, order, 0)),
        ("order 5", with(key, order, 5)),
        ("an order other than the field's", with(key, order, 1)),
        ("no cells", with(key, x, 0)),
        ("17 cells", with(key, x, 17)),
        ("a size other than the region's", with(key, x, 3)),
        ("a payload that starts with 1", with(key, payload, 1)),
        ("bytes after the end", trailing),
    ]
    .into_iter()
    .map(|(name, bytes)| {
        let error = ProbeDecoder::new(one.size, one.order).decode(&bytes);
        let kind = error.as_ref().map_err(DecodeError::kind).expect_err(name);
        json!({ "name": name, "bytes": BASE64_STANDARD.encode(&bytes), "error": kind })
    })
    .collect()
}
