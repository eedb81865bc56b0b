//! Lumels as video: near what went in, cheap where nothing changes, sound whatever is lost.

use std::sync::Arc;

use glam::Vec3;
use lumencast_codec::{
    Coding, DecodeError, EncodedRegion, FrameHead, LightmapShape, LumelCoding, LumelDecoder,
    LumelEncoder, Qp, UpdateInfo,
};
use lumencast_light::{FieldId, Layout, Lightmap};

fn qp(qp: u8) -> Qp {
    Qp::new(qp).expect("a parameter")
}

/// Soft light with a shadow's edge, over three decades, moved by `shift` lumels.
fn lightmap(page_size: u32, pages: u32, shift: u32) -> Lightmap {
    let layout = Arc::new(Layout::new(page_size, pages, Vec::new()));
    let mut lightmap = Lightmap::dark(FieldId(1), layout);
    for (lumel, value) in (0..).zip(&mut lightmap.irradiance) {
        let (x, y) = ((lumel + shift) % page_size, lumel / page_size % page_size);
        let (u, v) = (x as f32 / page_size as f32, y as f32 / page_size as f32);
        let shade = if u + v / 3.0 > 0.7 { 0.05 } else { 1.0 };
        let distance = (u - 0.3).powi(2) + (v - 0.4).powi(2);
        *value = shade * Vec3::new(900.0, 700.0, 500.0 + 300.0 * u) / (1.0 + 40.0 * distance);
    }
    lightmap
}

fn encoder(lightmap: &Lightmap, coding: LumelCoding) -> LumelEncoder {
    LumelEncoder::new(LightmapShape::of(lightmap, coding.coding()), coding)
}

fn decoder(lightmap: &Lightmap, coding: Coding, page: u32) -> LumelDecoder {
    let tile = LightmapShape::of(lightmap, coding).tile(page).expect("a page");
    LumelDecoder::new(coding, tile.size)
}

/// An update every 40 ms.
fn update(update: u64) -> UpdateInfo {
    UpdateInfo { update, tick: update, time: 0.04 * update as f64, scene_version: 3 }
}

fn encode(encoder: &mut LumelEncoder, lightmap: &Lightmap, u: u64) -> Vec<EncodedRegion> {
    encoder.encode(lightmap, update(u), |_| true).expect("frames")
}

/// PSNR of displayed light, decibels: white is the brightest, gamma 2.2.
fn psnr(a: &[Vec3], b: &[Vec3]) -> f64 {
    assert_eq!(a.len(), b.len());
    let white = a.iter().map(|e| e.max_element()).fold(0.0, f32::max);
    let shown = |e: Vec3| (e / white).clamp(Vec3::ZERO, Vec3::ONE).powf(1.0 / 2.2);
    let squares = a.iter().zip(b).map(|(a, b)| f64::from((shown(*a) - shown(*b)).length_squared()));
    -10.0 * (squares.sum::<f64>() / (3 * a.len()) as f64).log10()
}

#[test]
fn light_comes_back_nearly_as_it_was() {
    for (page_size, coding, least) in [
        (64, LumelCoding::H264(qp(18)), 40.0),
        (50, LumelCoding::H264(qp(18)), 40.0),
        (64, LumelCoding::H264Stacked(qp(18)), 42.0),
        (33, LumelCoding::H264Stacked(qp(12)), 44.0),
        (1, LumelCoding::H264(qp(12)), 40.0),
    ] {
        let light = lightmap(page_size, 2, 0);
        let mut encoder = encoder(&light, coding);
        let frames = encode(&mut encoder, &light, 0);
        assert_eq!(frames.iter().map(|frame| frame.region).collect::<Vec<_>>(), [0, 1]);
        for (frame, page) in frames.iter().zip(light.irradiance.chunks(page_size.pow(2) as usize)) {
            assert!(frame.new_group && frame.layer == 0);
            let mut decoder = decoder(&light, coding.coding(), frame.region);
            let decoded = decoder.decode(&frame.bytes).expect("a keyframe");
            assert_eq!(decoded.head, FrameHead::read(&frame.bytes).expect("a head"));
            let near = psnr(page, &decoded.irradiance);
            assert!(near > least, "{page_size}, {coding:?}: {near} dB");
        }
    }
}

/// Colour at full resolution is nearer where colours change from lumel to lumel.
#[test]
fn stacked_planes_keep_fine_colours() {
    let mut light = lightmap(64, 1, 0);
    for (lumel, value) in light.irradiance.iter_mut().enumerate() {
        *value =
            if lumel % 2 == 0 { Vec3::new(90.0, 20.0, 10.0) } else { Vec3::new(10.0, 40.0, 60.0) };
    }
    let [halved, full] =
        [LumelCoding::H264(qp(18)), LumelCoding::H264Stacked(qp(18))].map(|coding| {
            let frames = encode(&mut encoder(&light, coding), &light, 0);
            let decoded =
                decoder(&light, coding.coding(), 0).decode(&frames[0].bytes).expect("light");
            psnr(&light.irradiance, &decoded.irradiance)
        });
    assert!(full > halved + 6.0, "{halved} dB, stacked {full} dB");
}

/// Light that stands costs a short frame now and then; light whose noise flickers below what a code
/// tells, no more.
#[test]
fn still_light_costs_almost_nothing() {
    let light = lightmap(128, 1, 0);
    let mut encoder = encoder(&light, LumelCoding::H264(qp(18)));
    let mut decoder = decoder(&light, Coding::H264, 0);
    let first = encode(&mut encoder, &light, 0);
    let shown = decoder.decode(&first[0].bytes).expect("a keyframe").irradiance;
    let (mut bytes, mut keyframes) = (0, 0);
    for u in 1..=200 {
        let mut flickering = light.clone();
        for (i, value) in flickering.irradiance.iter_mut().enumerate() {
            *value *= 1.0 + 0.002 * ((i as f32 + u as f32) * 12.9898).sin();
        }
        for frame in encode(&mut encoder, &flickering, u) {
            match frame.new_group {
                true => keyframes += 1,
                false => bytes += frame.bytes.len(),
            }
            let decoded = decoder.decode(&frame.bytes).expect("a frame");
            assert_eq!((decoded.head.info.update, &decoded.irradiance), (u, &shown));
        }
    }
    assert!((1..=8 * 32).contains(&bytes), "{bytes} bytes in 8 seconds beside keyframes");
    assert!(keyframes <= 3, "{keyframes} keyframes in 8 seconds");
}

/// Groups end after two seconds or 50 pictures, whichever is sooner.
#[test]
fn groups_of_changing_light_are_short_at_any_rate() {
    for (seconds, most) in [(0.01, 50), (0.04, 50), (0.2, 10), (5.0, 1)] {
        let mut encoder = encoder(&lightmap(64, 1, 0), LumelCoding::H264(qp(18)));
        let updates = (0..3 * most + 1).filter(|u| {
            let info = UpdateInfo { time: seconds * *u as f64, ..update(*u) };
            let frames = encoder.encode(&lightmap(64, 1, *u as u32), info, |_| true);
            frames.expect("frames")[0].new_group
        });
        let expected: Vec<u64> = (0..=3).map(|group| group * most).collect();
        assert_eq!(updates.collect::<Vec<u64>>(), expected, "every {seconds} s");
    }
}

#[test]
fn changing_light_has_a_keyframe_every_two_seconds() {
    let light = lightmap(64, 1, 0);
    let mut encoder = encoder(&light, LumelCoding::H264(qp(18)));
    let mut decoder = decoder(&light, Coding::H264, 0);
    let mut keyframes = Vec::new();
    for u in 0..160 {
        let light = lightmap(64, 1, u as u32);
        let frames = encode(&mut encoder, &light, u);
        let [frame] = &frames[..] else { panic!("{} frames", frames.len()) };
        let head = FrameHead::read(&frame.bytes).expect("a head");
        assert_eq!(head.base.is_none(), frame.new_group);
        if frame.new_group {
            keyframes.push(u);
        }
        let decoded = decoder.decode(&frame.bytes).expect("a frame");
        assert!(psnr(&light.irradiance, &decoded.irradiance) > 38.0, "update {u}");
    }
    assert!(keyframes.len() >= 4 && keyframes.windows(2).all(|pair| pair[1] - pair[0] <= 50));
}

/// Whoever has lost a picture of light that stands is not left with it.
#[test]
fn still_light_has_keyframes_that_cost_little() {
    for (page_size, seconds) in [(64, 2..=3), (512, 4..=60)] {
        let light = lightmap(page_size, 1, 0);
        let mut encoder = encoder(&light, LumelCoding::H264(qp(12)));
        let mut decoder = decoder(&light, Coding::H264, 0);
        let first = encode(&mut encoder, &light, 0);
        decoder.decode(&first[0].bytes).expect("a keyframe");
        let (mut bytes, mut keyframes) = (0, vec![0]);
        for u in 1..=4000 {
            for frame in encode(&mut encoder, &light, u) {
                bytes += frame.bytes.len();
                let decoded = decoder.decode(&frame.bytes).expect("a frame");
                assert!(psnr(&light.irradiance, &decoded.irradiance) > 38.0);
                if frame.new_group {
                    keyframes.push(u);
                }
            }
        }
        assert!(keyframes.len() > 2);
        for group in keyframes.windows(2).map(|pair| (pair[1] - pair[0]) / 25) {
            assert!(seconds.contains(&group), "{page_size}: {group} s");
        }
        assert!(bytes < 160 * 2500, "{page_size}: {bytes} bytes in 160 seconds");
    }
}

/// A new group begins where light needs another scale or mapping, and where somebody comes to watch.
#[test]
fn groups_begin_where_they_must() {
    let mut light = lightmap(64, 1, 0);
    let mut encoder = encoder(&light, LumelCoding::H264(qp(18)));
    let mut begins = |light: &Lightmap, u: u64, watched: bool| {
        let frames = encoder.encode(light, update(u), |_| watched).expect("frames");
        frames.first().map(|frame| frame.new_group)
    };
    assert_eq!(begins(&light, 0, true), Some(true));
    light.irradiance[7] *= 1.1;
    assert_eq!(begins(&light, 1, true), Some(false));
    light.irradiance.iter_mut().for_each(|value| *value *= 30.0);
    assert_eq!(begins(&light, 2, true), Some(true));
    light.irradiance.iter_mut().for_each(|value| *value *= 0.01);
    assert_eq!(begins(&light, 3, true), Some(true));
    assert_eq!(begins(&light, 4, false), None);
    assert_eq!(begins(&light, 5, true), Some(true));
    // Dark pages are light too, and stay with one mapping.
    light.irradiance.fill(Vec3::ZERO);
    begins(&light, 6, true);
    assert_eq!(begins(&light, 7, true), None);
}

/// Where there are more lumels than an update has room for, pages take turns.
#[test]
fn many_pages_take_turns() {
    let light = lightmap(1024, 3, 0);
    let mut encoder = encoder(&light, LumelCoding::H264(qp(30)));
    let turns: Vec<(u32, u32)> = (0..10)
        .flat_map(|u| {
            encode(&mut encoder, &lightmap(1024, 3, u), u.into()).into_iter().map(move |f| (u, f))
        })
        .map(|(update, frame)| (update, frame.region))
        .collect();
    assert_eq!(turns, [(0, 0), (2, 1), (4, 2), (6, 0), (8, 1)]);
    let light = lightmap(512, 2, 0);
    let mut small = self::encoder(&light, LumelCoding::H264(qp(30)));
    for update in 0..4 {
        let frames = encode(&mut small, &lightmap(512, 2, update), update.into());
        assert_eq!(frames.len(), 2, "update {update}");
    }
}

/// What is lost or late is waited for, and a keyframe mends all.
#[test]
fn losses_are_mended_by_the_next_keyframe() {
    let light = lightmap(64, 1, 0);
    let mut encoder = encoder(&light, LumelCoding::H264(qp(18)));
    let frames: Vec<EncodedRegion> =
        (0..120).flat_map(|u| encode(&mut encoder, &lightmap(64, 1, u), u.into())).collect();
    let next = frames.iter().skip(1).position(|frame| frame.new_group).expect("a keyframe") + 1;
    let mut decoder = decoder(&light, Coding::H264, 0);
    assert!(matches!(decoder.decode(&frames[1].bytes), Err(DecodeError::MissingBase { .. })));
    decoder.decode(&frames[0].bytes).expect("a keyframe");
    decoder.decode(&frames[1].bytes).expect("a delta");
    for late in &frames[..=1] {
        let refused = decoder.decode(&late.bytes).map_err(|error| error.kind());
        assert_eq!(refused, Err("late"));
    }
    decoder.decode(&frames[2].bytes).expect("late frames change nothing");
    for after_a_loss in &frames[4..next] {
        let refused = decoder.decode(&after_a_loss.bytes).map_err(|error| error.kind());
        assert_eq!(refused, Err("missing_base"));
    }
    for (frame, u) in frames[next..].iter().zip(next as u32..) {
        let decoded = decoder.decode(&frame.bytes).expect("a frame");
        assert!(psnr(&lightmap(64, 1, u).irradiance, &decoded.irradiance) > 38.0);
    }
}

#[test]
fn damaged_frames_do_no_lasting_harm() {
    let light = lightmap(64, 1, 0);
    let mut encoder = encoder(&light, LumelCoding::H264(qp(18)));
    let frames: Vec<EncodedRegion> =
        (0..100).flat_map(|u| encode(&mut encoder, &lightmap(64, 1, u), u.into())).collect();
    let mut decoder = decoder(&light, Coding::H264, 0);
    for (round, frame) in frames.iter().enumerate() {
        let mut damaged = frame.bytes.clone();
        let at = round * 7919 % damaged.len();
        damaged[at] ^= 1 << (round % 8);
        damaged.truncate(damaged.len() - round % 5);
        drop(decoder.decode(&damaged));
    }
    // As a server that goes on numbers it.
    let keyframe = encode(&mut self::encoder(&light, LumelCoding::H264(qp(18))), &light, 1 << 40);
    let decoded = decoder.decode(&keyframe[0].bytes).expect("a keyframe");
    assert!(psnr(&light.irradiance, &decoded.irradiance) > 38.0);
}

#[test]
fn wrong_frames_are_refused() {
    let light = lightmap(64, 1, 0);
    let coding = LumelCoding::H264(qp(18));
    let frame = encode(&mut encoder(&light, coding), &light, 0).remove(0).bytes;
    let head = 16;
    let refused = |bytes: &[u8]| {
        decoder(&light, Coding::H264, 0).decode(bytes).map(drop).map_err(|error| error.kind())
    };
    assert_eq!(refused(&frame), Ok(()));
    let changed = |at: usize, value: u8| {
        let mut bytes = frame.clone();
        bytes[at] = value;
        refused(&bytes)
    };
    // Toe and range follow the head.
    assert_eq!(changed(head - 1, 33), Err("malformed"));
    assert_eq!(changed(head, 0), Err("malformed"));
    assert_eq!(refused(&frame[..head]), Err("truncated"));
    assert_eq!(refused(&frame[..head + 1]), Err("malformed"), "a keyframe without a picture");
    let other = lightmap(32, 1, 0);
    let small = encode(&mut encoder(&other, coding), &other, 0).remove(0).bytes;
    assert_eq!(refused(&small), Err("mismatch"));
    assert!(coding.check(4096).is_err());
    assert!(coding.check(2048).is_ok() && LumelCoding::Halves.check(4096).is_ok());
}
