//! Probe frames, alone and one after another.

#![no_main]

use glam::UVec3;
use libfuzzer_sys::fuzz_target;
use lumencast_codec::{ProbeDecoder, ProbeHeader};

fuzz_target!(|data: &[u8]| {
    // A frame that says its own size and order fits its region, so that payloads are reached.
    let (size, order) = match ProbeHeader::read(data) {
        Ok(header) => (header.size, header.order),
        Err(_) => (UVec3::splat(4), lumencast_light::Order::L2),
    };
    let mut decoder = ProbeDecoder::new(size, order);
    // As one frame, and cut in two: the second may be a delta against the first.
    drop(decoder.decode(data));
    let (first, second) = data.split_at(data.len() / 2);
    drop(decoder.decode(first));
    if let Ok(light) = decoder.decode(second) {
        assert!(light.coefficients.iter().all(|c| !c.is_nan()));
    }
});
