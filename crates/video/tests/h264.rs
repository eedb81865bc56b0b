//! H.264, as pictures of lumels need it.

use lumencast_video::{
    H264Decoder, H264Encoder, Picture, PictureDecoder, PictureEncoder, Qp, VideoError,
};

const SIDE: u32 = 64;

fn qp(qp: u8) -> Qp {
    Qp::new(qp).expect("a parameter in range")
}

fn coder(parameter: u8) -> (H264Encoder, H264Decoder) {
    let encoder = H264Encoder::new(SIDE, SIDE, qp(parameter)).expect("an encoder");
    (encoder, H264Decoder::new().expect("a decoder"))
}

/// A soft gradient over the whole range, moved by `shift` samples, with grain that differs by `shift`.
fn gradient(shift: u32, grain: u32) -> Picture {
    let mut picture = Picture::plain(SIDE, SIDE, 0, [0; 2]);
    let noise = |i: u32| i.wrapping_mul(2_654_435_761).wrapping_add(shift * 40_503) >> 16;
    for (i, luma) in (0..).zip(&mut picture.luma) {
        let (x, y) = (i % SIDE, i / SIDE);
        let base = (x + shift) % SIDE * 3 + y;
        *luma = (base + noise(i) % (grain + 1)).min(255) as u8;
    }
    for (plane, samples) in picture.chroma.iter_mut().enumerate() {
        for (i, chroma) in (0..).zip(samples) {
            *chroma = (i % (SIDE / 2) * 8 / (plane as u32 + 1)) as u8;
        }
    }
    picture
}

fn largest_error(a: &[u8], b: &[u8]) -> u8 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| a.abs_diff(*b)).max().unwrap_or(0)
}

fn mean_square_error(a: &Picture, b: &Picture) -> f64 {
    let squares = a.luma.iter().zip(&b.luma).map(|(a, b)| f64::from(a.abs_diff(*b)).powi(2));
    squares.sum::<f64>() / a.luma.len() as f64
}

#[test]
fn pictures_come_back_nearly_as_they_were() {
    let (mut encoder, mut decoder) = coder(12);
    for frame in 0..4 {
        let picture = gradient(frame, 0);
        let unit = encoder.encode(&picture, frame == 0).unwrap();
        let decoded = decoder.decode(&unit).unwrap();
        assert_eq!((decoded.width, decoded.height), (SIDE, SIDE));
        assert!(largest_error(&picture.luma, &decoded.luma) <= 6);
        for (plane, decoded) in picture.chroma.iter().zip(&decoded.chroma) {
            assert!(largest_error(plane, decoded) <= 6);
        }
    }
}

/// Nothing squeezes samples into 16 to 235.
#[test]
fn the_whole_range_is_used() {
    let (mut encoder, mut decoder) = coder(20);
    for value in [0, 1, 16, 128, 235, 254, 255] {
        let picture = Picture::plain(SIDE, SIDE, value, [255 - value, value]);
        let decoded = decoder.decode(&encoder.encode(&picture, true).unwrap()).unwrap();
        assert!(largest_error(&picture.luma, &decoded.luma) <= 1, "{value}");
        assert!(largest_error(&picture.chroma[0], &decoded.chroma[0]) <= 1, "{value}");
    }
}

/// No picture is left out, however much changes; and none that has not changed costs much.
#[test]
fn every_picture_has_its_unit_and_still_ones_are_short() {
    for parameter in [*Qp::RANGE.start(), 18] {
        has_its_unit(coder(parameter));
    }
}

fn has_its_unit((mut encoder, mut decoder): (H264Encoder, H264Decoder)) {
    let mut keyframe = 0;
    for frame in 0..60 {
        let unit = encoder.encode(&gradient(frame * 17, 40), frame == 0).unwrap();
        decoder.decode(&unit).unwrap();
        keyframe = if frame == 0 { unit.len() } else { keyframe };
    }
    let still = gradient(3, 40);
    let lengths: Vec<usize> =
        (0..12).map(|_| encoder.encode(&still, false).unwrap().len()).collect();
    assert!(lengths[2..].iter().all(|length| *length < 40), "{lengths:?}");
    assert!(keyframe > 1000);
}

/// Types of the units in a stream (H.264, table 7-1), and what they hold behind their first byte.
fn units(stream: &[u8]) -> Vec<(u8, Vec<u8>)> {
    let starts: Vec<usize> = stream
        .windows(3)
        .enumerate()
        .filter(|(_, code)| *code == [0, 0, 1])
        .map(|(at, _)| at + 3)
        .collect();
    let ends = starts.iter().skip(1).map(|start| start - 3).chain([stream.len()]);
    let unit =
        |(start, end): (&usize, usize)| (stream[*start] & 31, stream[start + 1..end].to_vec());
    starts.iter().zip(ends).map(unit).collect()
}

const SLICE: u8 = 1;
const KEYFRAME: u8 = 5;
const SEQUENCE: u8 = 7;
const PICTURE: u8 = 8;

/// Neither cuts nor time make keyframes: these come when they are asked for, with all that a decoder
/// needs.
#[test]
fn keyframes_come_when_asked_for() {
    let (mut encoder, _) = coder(18);
    let types = |stream: &[u8]| -> Vec<u8> { units(stream).into_iter().map(|(t, _)| t).collect() };
    let keyframe = encoder.encode(&gradient(0, 0), true).unwrap();
    assert_eq!(types(&keyframe), [SEQUENCE, PICTURE, KEYFRAME]);
    for frame in 1..600 {
        let cut = Picture::plain(SIDE, SIDE, if frame % 2 == 0 { 20 } else { 230 }, [90, 200]);
        let picture = if frame % 7 < 3 { gradient(frame, 90) } else { cut };
        assert_eq!(types(&encoder.encode(&picture, false).unwrap()), [SLICE], "{frame}");
    }
    assert_eq!(types(&encoder.encode(&gradient(1, 0), true).unwrap()), types(&keyframe));
}

#[test]
fn the_first_picture_is_a_keyframe_also_where_none_is_asked_for() {
    let (mut encoder, mut decoder) = coder(18);
    let first = encoder.encode(&gradient(0, 0), false).unwrap();
    assert!(units(&first).iter().any(|(t, _)| *t == KEYFRAME));
    decoder.decode(&first).unwrap();
}

/// Bits of a unit (H.264, 7.2 and 9.1).
struct Bits {
    bytes: Vec<u8>,
    at: usize,
}

impl Bits {
    fn of(unit: &[u8]) -> Self {
        let mut bytes: Vec<u8> = Vec::new();
        for byte in unit {
            // A 3 after two zeros only keeps start codes out.
            if *byte != 3 || !bytes.ends_with(&[0, 0]) {
                bytes.push(*byte);
            }
        }
        Self { bytes, at: 0 }
    }

    fn take(&mut self, count: u32) -> u32 {
        (0..count).fold(0, |value, _| {
            let bit = self.bytes[self.at / 8] >> (7 - self.at % 8) & 1;
            self.at += 1;
            value << 1 | u32::from(bit)
        })
    }

    fn flag(&mut self) -> bool {
        self.take(1) == 1
    }

    fn golomb(&mut self) -> u32 {
        let mut zeros = 0;
        while !self.flag() {
            zeros += 1;
        }
        (1 << zeros) - 1 + self.take(zeros)
    }
}

/// Decoders are told that the whole range is used, and that the matrix is that of BT.709 (H.264, 7.3.2.1.1
/// and E.1.1).
#[test]
fn the_stream_says_how_samples_are_to_be_read() {
    let (mut encoder, _) = coder(18);
    let keyframe = encoder.encode(&gradient(0, 0), true).unwrap();
    let (_, sequence) = units(&keyframe).into_iter().find(|(t, _)| *t == SEQUENCE).unwrap();
    let mut bits = Bits::of(&sequence);
    assert_eq!(bits.take(8), 66, "the baseline profile");
    bits.take(16);
    bits.golomb();
    bits.golomb();
    if bits.golomb() == 0 {
        bits.golomb();
    }
    bits.golomb();
    bits.flag();
    let macroblocks = [bits.golomb() + 1, bits.golomb() + 1];
    assert_eq!(macroblocks, [SIDE / 16; 2]);
    assert!(bits.flag(), "whole pictures");
    bits.flag();
    if bits.flag() {
        for _ in 0..4 {
            bits.golomb();
        }
    }
    assert!(bits.flag(), "how samples are to be read is told");
    assert!(!bits.flag() && !bits.flag() && bits.flag(), "no ratio, no overscan, but the signal");
    bits.take(3);
    assert!(bits.flag(), "the whole range");
    assert!(bits.flag());
    bits.take(16);
    assert_eq!(bits.take(8), 1, "BT.709");
}

/// What changes little is neither denoised nor taken for background: it comes back as it is.
#[test]
fn faint_changes_arrive() {
    let (mut encoder, mut decoder) = coder(12);
    let mut picture = Picture::plain(SIDE, SIDE, 100, [128; 2]);
    decoder.decode(&encoder.encode(&picture, true).unwrap()).unwrap();
    for step in 1..=8 {
        picture.luma.iter_mut().for_each(|luma| *luma += 1);
        let decoded = decoder.decode(&encoder.encode(&picture, false).unwrap()).unwrap();
        assert!(largest_error(&picture.luma, &decoded.luma) <= 1, "step {step}");
    }
}

#[test]
fn a_finer_parameter_costs_more_and_is_nearer() {
    let measured = [6, 9, 12, 18, 24, 30, 36].map(|parameter| {
        let (mut encoder, mut decoder) = coder(parameter);
        let picture = gradient(5, 30);
        let unit = encoder.encode(&picture, true).unwrap();
        (unit.len(), mean_square_error(&picture, &decoder.decode(&unit).unwrap()))
    });
    for pair in measured.windows(2) {
        assert!(pair[0].0 > pair[1].0 && pair[0].1 < pair[1].1, "{measured:?}");
    }
    assert_eq!((Qp::new(5), Qp::new(37)), (None, None));
}

/// Whoever joins at a keyframe sees what the others see.
#[test]
fn a_keyframe_stands_alone() {
    let (mut encoder, mut first) = coder(18);
    for frame in 0..3 {
        first.decode(&encoder.encode(&gradient(frame, 0), frame == 0).unwrap()).unwrap();
    }
    let mut second = H264Decoder::new().unwrap();
    let delta = encoder.encode(&gradient(3, 0), false).unwrap();
    first.decode(&delta).unwrap();
    assert!(matches!(second.decode(&delta), Err(VideoError::Unit(_))));
    for frame in 4..7 {
        let unit = encoder.encode(&gradient(frame, 0), frame == 4).unwrap();
        assert_eq!(first.decode(&unit).unwrap(), second.decode(&unit).unwrap());
    }
}

/// A damaged unit is an error or a picture, and the next keyframe mends all.
#[test]
fn damaged_units_do_no_lasting_harm() {
    let (mut encoder, mut decoder) = coder(18);
    decoder.decode(&encoder.encode(&gradient(0, 10), true).unwrap()).unwrap();
    for round in 1..40_u32 {
        let mut unit = encoder.encode(&gradient(round, 10), false).unwrap();
        let at = (round * 7919) as usize % unit.len();
        unit[at] ^= 1 << (round % 8);
        unit.truncate(unit.len() - (round % 5) as usize);
        drop(decoder.decode(&unit));
        drop(decoder.decode(&[]));
        drop(decoder.decode(&[0, 0, 0, 1, 0x67, 255, 255]));
        let picture = gradient(round, 10);
        let mut fresh = H264Decoder::new().unwrap();
        let keyframe = encoder.encode(&picture, true).unwrap();
        assert_eq!(decoder.decode(&keyframe).ok(), fresh.decode(&keyframe).ok(), "round {round}");
        assert!(fresh.decode(&encoder.encode(&picture, false).unwrap()).is_ok());
    }
}

#[test]
fn pictures_that_are_too_large_or_of_another_size_are_refused() {
    let too_large = H264Encoder::new(4096, 4096, qp(18)).err();
    assert_eq!(too_large, Some(VideoError::Size { width: 4096, height: 4096 }));
    assert!(H264Encoder::new(1024, 3072, qp(18)).is_ok());
    let (mut encoder, _) = coder(18);
    let other = Picture::plain(32, SIDE, 0, [0; 2]);
    let refused = encoder.encode(&other, true);
    assert_eq!(refused, Err(VideoError::Size { width: 32, height: SIDE }));
}
