//! `vectors/lumels.json`, which the TypeScript client reads too.

use base64::{Engine, prelude::BASE64_STANDARD};
use glam::{UVec2, Vec3};
use lumencast_codec::{Coding, LumelDecoder};
use lumencast_testkit::vectors::fnv;
use serde::Deserialize;

#[derive(Deserialize)]
struct Vectors {
    sequences: Vec<Sequence>,
    malformed: Vec<Malformed>,
    mutations: Vec<Mutation>,
}

#[derive(Deserialize)]
struct Sequence {
    name: String,
    size: UVec2,
    frames: Vec<Frame>,
}

#[derive(Deserialize)]
struct Frame {
    bytes: String,
    update: u64,
    base: Option<u64>,
    tick: u64,
    time: f64,
    scene_version: u64,
    scale_log2: i8,
    irradiance: u32,
    first: Vec3,
    changed: bool,
}

#[derive(Deserialize)]
struct Malformed {
    name: String,
    bytes: String,
    error: String,
}

#[derive(Deserialize)]
struct Mutation {
    sequence: usize,
    frame: usize,
    offset: usize,
    byte: u8,
    irradiance: Option<u32>,
}

fn vectors() -> Vectors {
    let text = include_str!("../../../vectors/lumels.json");
    serde_json::from_str(text).expect("vectors/lumels.json")
}

fn bytes(base64: &str) -> Vec<u8> {
    BASE64_STANDARD.decode(base64).expect("base64")
}

#[test]
fn frames_decode_to_the_recorded_bits() {
    for sequence in vectors().sequences {
        let mut decoder = LumelDecoder::new(Coding::Halves, sequence.size);
        let mut before = None;
        for frame in sequence.frames {
            let light = decoder.decode(&bytes(&frame.bytes)).expect(&sequence.name);
            let header = light.head;
            assert_eq!(fnv(&light.irradiance), frame.irradiance, "{}", sequence.name);
            assert_eq!(light.irradiance[0], frame.first);
            assert_eq!((header.info.update, header.base), (frame.update, frame.base));
            assert_eq!((header.info.tick, header.info.time), (frame.tick, frame.time));
            assert_eq!(header.info.scene_version, frame.scene_version);
            assert_eq!(
                (header.scale_log2, light.irradiance.len()),
                (frame.scale_log2, sequence.size.element_product() as usize)
            );
            assert_eq!(before.as_ref() != Some(&light.irradiance), frame.changed);
            before = Some(light.irradiance);
        }
    }
}

#[test]
fn malformed_frames_are_refused_with_their_kind() {
    for case in vectors().malformed {
        let error = LumelDecoder::new(Coding::Halves, UVec2::splat(9)).decode(&bytes(&case.bytes));
        assert_eq!(error.map_err(|e| e.kind()), Err(case.error.as_str()), "{}", case.name);
    }
}

#[test]
fn mutated_frames_decode_alike_or_are_refused_alike() {
    let vectors = vectors();
    for (index, case) in vectors.mutations.iter().enumerate() {
        let sequence = &vectors.sequences[case.sequence];
        let mut decoder = LumelDecoder::new(Coding::Halves, sequence.size);
        for frame in &sequence.frames[..case.frame] {
            decoder.decode(&bytes(&frame.bytes)).expect("a good frame");
        }
        let mut frame = bytes(&sequence.frames[case.frame].bytes);
        frame[case.offset] = case.byte;
        let result = decoder.decode(&frame).ok().map(|light| fnv(&light.irradiance));
        assert_eq!(result, case.irradiance, "mutation {index}");
    }
}
