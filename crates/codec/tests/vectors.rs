//! `vectors/codec.json`, which the TypeScript client reads too.

use base64::{Engine, prelude::BASE64_STANDARD};
use glam::{UVec3, Vec3};
use lumencast_codec::ProbeDecoder;
use lumencast_light::Order;
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
    size: UVec3,
    order: Order,
    frames: Vec<Frame>,
}

#[derive(Deserialize)]
struct Frame {
    bytes: String,
    update: u64,
    layer: u8,
    base: Option<u64>,
    tick: u64,
    time: f64,
    scene_version: u64,
    scale_log2: i8,
    coefficients: u32,
    first: Vec3,
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
    coefficients: Option<u32>,
}

fn vectors() -> Vectors {
    let text = include_str!("../../../vectors/codec.json");
    serde_json::from_str(text).expect("vectors/codec.json")
}

fn bytes(base64: &str) -> Vec<u8> {
    BASE64_STANDARD.decode(base64).expect("base64")
}

#[test]
fn frames_decode_to_the_recorded_bits() {
    for sequence in vectors().sequences {
        let mut decoder = ProbeDecoder::new(sequence.size, sequence.order);
        for frame in sequence.frames {
            let light = decoder.decode(&bytes(&frame.bytes)).expect(&sequence.name);
            let header = light.header;
            assert_eq!(fnv(&light.coefficients), frame.coefficients, "{}", sequence.name);
            assert_eq!(light.coefficients[0], frame.first);
            assert_eq!((header.info.update, header.base), (frame.update, frame.base));
            assert_eq!((header.info.tick, header.info.time), (frame.tick, frame.time));
            assert_eq!(
                (header.info.layer(), header.info.scene_version),
                (frame.layer, frame.scene_version)
            );
            assert_eq!(header.scale_log2, frame.scale_log2);
        }
    }
}

#[test]
fn malformed_frames_are_refused_with_their_kind() {
    for case in vectors().malformed {
        let error = ProbeDecoder::new(UVec3::new(2, 1, 1), Order::L2).decode(&bytes(&case.bytes));
        assert_eq!(error.map_err(|e| e.kind()), Err(case.error.as_str()), "{}", case.name);
    }
}

#[test]
fn mutated_frames_decode_alike_or_are_refused_alike() {
    let vectors = vectors();
    for (index, case) in vectors.mutations.iter().enumerate() {
        let sequence = &vectors.sequences[case.sequence];
        let mut decoder = ProbeDecoder::new(sequence.size, sequence.order);
        for frame in &sequence.frames[..case.frame] {
            decoder.decode(&bytes(&frame.bytes)).expect("a good frame");
        }
        let mut frame = bytes(&sequence.frames[case.frame].bytes);
        frame[case.offset] = case.byte;
        let result = decoder.decode(&frame).ok().map(|light| fnv(&light.coefficients));
        assert_eq!(result, case.coefficients, "mutation {index}");
    }
}
