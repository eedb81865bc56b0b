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
    let (mut encoder, mut decoder) = coder(18);
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
    let measured = [12, 18, 24, 30, 36].map(|parameter| {
        let (mut encoder, mut decoder) = coder(parameter);
        let picture = gradient(5, 30);
        let unit = encoder.encode(&picture, true).unwrap();
        (unit.len(), mean_square_error(&picture, &decoder.decode(&unit).unwrap()))
    });
    for pair in measured.windows(2) {
        assert!(pair[0].0 > pair[1].0 && pair[0].1 < pair[1].1, "{measured:?}");
    }
    assert_eq!((Qp::new(11), Qp::new(37)), (None, None));
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
