//! Lumel frames: what comes out is what went in, whatever that is, and no bytes do harm.

use std::sync::Arc;

use glam::{UVec2, Vec3};
use half::f16;
use lumencast_codec::{
    Coding, DecodeError, EncodedRegion, FrameHead, LightmapShape, LumelCoding, LumelDecoder,
    LumelEncoder, LumelHeader, ResourceHash, UpdateInfo, limits,
};
use lumencast_light::{FieldId, Layout, Lightmap};

/// Numbers that only look random (splitmix64).
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    fn below(&mut self, n: usize) -> usize {
        (self.next() % n as u64) as usize
    }

    fn unit(&mut self) -> f32 {
        (self.next() >> 40) as f32 / (1 << 24) as f32
    }

    fn colour(&mut self) -> Vec3 {
        Vec3::new(self.unit(), self.unit(), self.unit())
    }
}

fn lightmap(page_size: u32, pages: u32, mut light: impl FnMut(usize) -> Vec3) -> Lightmap {
    let layout = Arc::new(Layout::new(page_size, pages, Vec::new()));
    let mut lightmap = Lightmap::dark(FieldId(1), layout);
    (0..).zip(&mut lightmap.irradiance).for_each(|(lumel, value)| *value = light(lumel));
    lightmap
}

/// A gradient across the page, with an edge, brought to halves at a scale.
fn smooth(page_size: u32) -> impl Fn(usize) -> Vec3 {
    move |lumel| {
        let (x, y) = (lumel as u32 % page_size, lumel as u32 / page_size);
        let shade = if x + y / 3 > page_size / 2 { 0.2 } else { 1.0 };
        shade * Vec3::new(100.0 + x as f32, 150.0 + y as f32, 90.0)
    }
}

fn shape(lightmap: &Lightmap) -> LightmapShape {
    LightmapShape::of(lightmap, Coding::Halves)
}

fn encoder(lightmap: &Lightmap) -> LumelEncoder {
    LumelEncoder::new(shape(lightmap), LumelCoding::Halves)
}

fn update(update: u64) -> UpdateInfo {
    UpdateInfo { update, tick: 2 * update, time: 0.04 * update as f64, scene_version: 3 }
}

/// What a decoder is to make of a value.
fn half(value: f32, scale_log2: i8) -> f32 {
    let scale = f32::from(scale_log2).exp2();
    let half = f16::from_f32((value / scale).clamp(0.0, 65_504.0)).to_f32() * scale;
    if half.is_nan() { 0.0 } else { half }
}

/// Decodes what the encoder made of a lightmap; each lumel has to be there, bit by bit.
fn check(lightmap: &Lightmap, frames: &[EncodedRegion], decoders: &mut [LumelDecoder]) {
    let shape = shape(lightmap);
    assert_eq!(frames.len(), decoders.len());
    for (frame, decoder) in frames.iter().zip(decoders) {
        assert!(frame.bytes.len() <= limits::FRAME_BYTES, "{} bytes", frame.bytes.len());
        let light = decoder.decode(&frame.bytes).expect("a frame");
        let tile = shape.tile(frame.region).expect("a tile");
        assert_eq!(
            (LumelHeader::read(&frame.bytes).expect("a head").size, frame.layer),
            (tile.size, 0)
        );
        let lumels = tile.rows(shape.page_size).flatten();
        assert_eq!(light.irradiance.len(), tile.lumel_count());
        for (lumel, decoded) in lumels.zip(&light.irradiance) {
            let scale_log2 = light.head.scale_log2;
            let wanted = lightmap.irradiance[lumel].map(|value| half(value, scale_log2));
            assert_eq!(*decoded, wanted, "lumel {lumel}");
        }
    }
}

fn decoders(lightmap: &Lightmap) -> Vec<LumelDecoder> {
    shape(lightmap).tiles().map(|tile| LumelDecoder::new(Coding::Halves, tile.size)).collect()
}

#[test]
fn halves_come_out_as_they_went_in() {
    let mut random = Random(1);
    let extremes = [0.0, -1.0, f32::NAN, f32::INFINITY, 1e-9, 1e30, 3e-5, 65_504.0];
    let lights: [(u32, &mut dyn FnMut(usize) -> Vec3); 7] = [
        (256, &mut |_| Vec3::ZERO),
        (1, &mut |_| Vec3::new(3.0, 2.0, 1.0)),
        (300, &mut |_| random.colour()),
        (130, &mut |lumel| Vec3::splat((lumel % 3) as f32 * 40_000.0)),
        (257, &mut smooth(257)),
        (96, &mut |lumel| Vec3::new(extremes[lumel % 8], extremes[lumel / 8 % 8], 5.0)),
        (33, &mut |lumel| 1e-12 * smooth(33)(lumel)),
    ];
    for (page_size, light) in lights {
        let mut lightmap = lightmap(page_size, 2, light);
        let (mut encoder, mut decoders) = (encoder(&lightmap), decoders(&lightmap));
        for u in 0..4 {
            let frames = encoder.encode(&lightmap, update(u), |_| true).unwrap();
            check(&lightmap, &frames, &mut decoders);
            let n = lightmap.irradiance.len();
            match u {
                // All of it, a lumel, nothing.
                0 => lightmap.irradiance.rotate_left(n / 3),
                1 => lightmap.irradiance[n / 2].x += 1.0,
                _ => {}
            }
        }
    }
}

/// The bytes of a keyframe and of deltas, which decoders elsewhere rely on.
#[test]
fn frames_are_as_they_were() {
    let mut random = Random(6);
    let mut lightmap = lightmap(50, 1, |lumel| smooth(50)(lumel) * (1.0 + 0.02 * random.colour()));
    let mut encoder = encoder(&lightmap);
    let mut frames = Vec::new();
    for u in 0..3 {
        frames.extend(encoder.encode(&lightmap, update(u), |_| true).unwrap().remove(0).bytes);
        // Next all of it by the same, then some of it by anything.
        let some = if u == 0 { 0..2500 } else { 0..600 };
        for value in &mut lightmap.irradiance[some] {
            *value *= if u == 0 { Vec3::splat(1.1) } else { random.colour() };
        }
    }
    let name = ResourceHash::of(&frames).to_string();
    assert_eq!((frames.len(), &name[..16]), (11_448, "3d1b7bafdea7a477"));
}

/// Extremes that no prediction foresees, in every channel: no tile exceeds a frame.
#[test]
fn the_worst_noise_fits_a_frame() {
    let mut random = Random(2);
    let mut worst = |_| Vec3::from_array(std::array::from_fn(|_| [0.0, 1.0][random.below(2)]));
    let lights: Vec<Lightmap> = (0..3).map(|_| lightmap(256, 1, &mut worst)).collect();
    let (mut encoder, mut decoders) = (encoder(&lights[0]), decoders(&lights[0]));
    for (u, light) in (0..).zip(&lights) {
        let frames = encoder.encode(light, update(u), |_| true).unwrap();
        check(light, &frames, &mut decoders);
    }
    let mut even = |_| Vec3::from_array(std::array::from_fn(|_| half_of(random.below(0x7C00))));
    let noise = lightmap(256, 1, &mut even);
    let frames = encoder.encode(&noise, update(60), |_| true).unwrap();
    check(&noise, &frames, &mut decoders);
    let bytes = frames[0].bytes.len();
    assert!((350_000..380_000).contains(&bytes), "little is to be saved: {bytes}");
}

fn half_of(bits: usize) -> f32 {
    f16::from_bits(bits as u16).to_f32()
}

#[test]
fn smooth_light_and_darkness_cost_little() {
    let bytes = |light: &dyn Fn(usize) -> Vec3| {
        let lightmap = lightmap(256, 1, light);
        encoder(&lightmap).encode(&lightmap, update(0), |_| true).unwrap().remove(0).bytes.len()
    };
    let (dark, even) = (bytes(&|_| Vec3::ZERO), bytes(&|_| Vec3::new(0.3, 0.2, 0.1)));
    assert!(dark < 150 && even < 200, "{dark} {even}");
    let gradient = bytes(&smooth(256));
    assert!(gradient < 256 * 256 / 8, "a bit a lumel: {gradient}");
}

#[test]
fn still_light_costs_a_few_bytes() {
    let mut random = Random(3);
    let mut lightmap = lightmap(256, 1, |_| random.colour());
    let (mut encoder, mut decoders) = (encoder(&lightmap), decoders(&lightmap));
    check(&lightmap, &encoder.encode(&lightmap, update(0), |_| true).unwrap(), &mut decoders);
    let frames = encoder.encode(&lightmap, update(1), |_| true).unwrap();
    check(&lightmap, &frames, &mut decoders);
    assert!(frames[0].bytes.len() < 64, "{}", frames[0].bytes.len());
    // One lumel: a block of it is told.
    lightmap.irradiance[5000] *= 0.9;
    let frames = encoder.encode(&lightmap, update(2), |_| true).unwrap();
    check(&lightmap, &frames, &mut decoders);
    assert!(frames[0].bytes.len() < 128, "{}", frames[0].bytes.len());
}

/// Light that all changes alike is told by its neighbours' change; noise is told lumel by lumel.
#[test]
fn changes_cost_what_is_new_in_them() {
    let mut random = Random(4);
    let first = lightmap(256, 1, |lumel| smooth(256)(lumel) * (1.0 + 0.01 * random.colour()));
    let second = |change: &mut dyn FnMut() -> Vec3| {
        let mut second = first.clone();
        second.irradiance.iter_mut().for_each(|value| *value *= change());
        let mut encoder = encoder(&first);
        encoder.encode(&first, update(0), |_| true).unwrap();
        encoder.encode(&second, update(1), |_| true).unwrap().remove(0).bytes.len()
    };
    let brighter = second(&mut || Vec3::splat(1.1));
    let noisier = second(&mut || 1.0 + 0.002 * random.colour());
    let keyframe =
        encoder(&first).encode(&first, update(0), |_| true).unwrap().remove(0).bytes.len();
    assert!(brighter < 53 * keyframe / 100, "{brighter} {keyframe}");
    assert!(noisier < 48 * keyframe / 100, "{noisier} {keyframe}");
}

#[test]
fn keyframes_come_when_they_must_and_are_staggered() {
    let mut lightmap = lightmap(512, 1, smooth(512));
    let mut encoder = encoder(&lightmap);
    let mut keyframes = Vec::new();
    for u in 0..130 {
        if u == 70 {
            // The largest value leaves the scale.
            lightmap.irradiance.iter_mut().for_each(|value| *value *= 8.0);
        }
        // Tile 3 is watched from update 20 on.
        for frame in encoder.encode(&lightmap, update(u), |tile| tile < 3 || u >= 20).unwrap() {
            let head = FrameHead::read(&frame.bytes).expect("a head");
            assert_eq!((head.info, frame.new_group), (update(u), head.base.is_none()));
            assert!(head.base.is_none_or(|base| base == u - 1));
            if frame.new_group {
                keyframes.push((u, frame.region));
            }
        }
    }
    let at_once = |u| (0..4).map(move |tile| (u, tile));
    let mut expected: Vec<(u64, u32)> = vec![(0, 0), (0, 1), (0, 2), (20, 3)];
    expected.extend([(57, 3), (58, 2), (59, 1), (60, 0)]);
    expected.extend(at_once(70));
    expected.extend([(117, 3), (118, 2), (119, 1), (120, 0)]);
    assert_eq!(keyframes, expected);
}

#[test]
fn deltas_need_the_update_before() {
    let mut lightmap = lightmap(64, 1, smooth(64));
    let mut encoder = encoder(&lightmap);
    let frames: Vec<Vec<u8>> = [0, 1, 2, 9, 300]
        .into_iter()
        .map(|u| {
            lightmap.irradiance[7].y += 1.0;
            encoder.encode(&lightmap, update(u), |_| true).unwrap().remove(0).bytes
        })
        .collect();
    let mut decoder = LumelDecoder::new(Coding::Halves, UVec2::splat(64));
    let missing = |update, base| Err(DecodeError::MissingBase { update, base });
    let mut decode = |at: usize| decoder.decode(&frames[at]).map(|light| light.head.info.update);
    assert_eq!(decode(1), missing(1, 0));
    assert_eq!(decode(0), Ok(0));
    assert_eq!(decode(2), missing(2, 1));
    assert_eq!(decode(1), Ok(1));
    assert_eq!(decode(0), Ok(0), "a keyframe that comes late is read");
    assert_eq!(decode(2), Ok(2), "and leaves the base where it is");
    assert_eq!(decode(3), Ok(9), "numbers may be left out");
    assert_eq!(decode(4), Ok(300), "a base of 255 updates ago is none");
    assert_eq!(LumelHeader::read(&frames[4]).unwrap().base, None);
    let other = LumelDecoder::new(Coding::Halves, UVec2::new(64, 63)).decode(&frames[0]);
    assert_eq!(other, Err(DecodeError::Mismatch("size")));
}

#[test]
fn heads_that_contradict_themselves_are_refused() {
    let lightmap = lightmap(4, 1, |_| Vec3::ONE);
    let frame = encoder(&lightmap).encode(&lightmap, update(0), |_| true).unwrap().remove(0).bytes;
    // Version, flags, update, distance, scene version, tick, time (8), scale, width, height.
    let turned = |at: usize, byte: u8| {
        let mut turned = frame.clone();
        turned[at] = byte;
        LumelDecoder::new(Coding::Halves, UVec2::splat(4))
            .decode(&turned)
            .map(drop)
            .map_err(|e| e.kind())
    };
    assert_eq!(turned(0, 1), Ok(()));
    for (at, byte, kind) in [
        (0, 2, "version"),
        (1, 2, "malformed"),
        (1, 0, "malformed"),
        (3, 1, "malformed"),
        (15, 0, "malformed"),
        (15, 5, "mismatch"),
        (16, 3, "mismatch"),
        (17, 1, "malformed"),
    ] {
        assert_eq!(turned(at, byte), Err(kind), "{at} {byte}");
    }
    let mut wide = frame[..15].to_vec();
    wide.extend([0x81, 0x02, 1]);
    assert_eq!(LumelHeader::read(&wide).map_err(|e| e.kind()), Err("limit"));
    let mut brightest = frame.clone();
    brightest[14] = 127;
    assert!(
        LumelDecoder::new(Coding::Halves, UVec2::splat(4)).decode(&brightest).is_ok(),
        "2^127 lux or so"
    );
    let long = vec![1; limits::FRAME_BYTES + 1];
    assert_eq!(LumelHeader::read(&long).map_err(|e| e.kind()), Err("limit"));
}

/// Frames with bits turned, cut short and plain noise: values or errors, and never more lumels.
#[test]
fn no_bytes_make_a_decoder_panic() {
    let mut random = Random(5);
    let size = UVec2::new(37, 29);
    let mut lightmap = lightmap(37, 1, |_| random.colour());
    let mut encoder = encoder(&lightmap);
    let mut frames = Vec::new();
    for u in 0..4 {
        frames.push(encoder.encode(&lightmap, update(u), |_| true).unwrap().remove(0).bytes);
        lightmap.irradiance.iter_mut().for_each(|value| *value *= 1.0 + 0.01 * random.unit());
    }
    // Has had all but the last.
    let decoder = || {
        let mut decoder = LumelDecoder::new(Coding::Halves, UVec2::splat(37));
        frames[..3].iter().for_each(|frame| drop(decoder.decode(frame).unwrap()));
        decoder
    };
    for frame in &frames {
        (0..frame.len()).step_by(7).for_each(|length| drop(decoder().decode(&frame[..length])));
    }
    let mut accepted = 0;
    for _ in 0..2_000 {
        let mut bytes = frames[random.below(frames.len())].clone();
        match random.below(3) {
            0 => (0..=random.below(4)).for_each(|_| {
                let at = random.below(bytes.len());
                bytes[at] ^= 1 << random.below(8);
            }),
            1 => {
                bytes.iter_mut().skip(random.below(40)).for_each(|byte| *byte = random.next() as u8)
            }
            _ => {
                let at = random.below(bytes.len());
                bytes[at..].rotate_left(1);
            }
        }
        if let Ok(light) = decoder().decode(&bytes) {
            accepted += 1;
            assert_eq!(light.irradiance.len(), 37 * 37);
            assert!(light.irradiance.iter().all(|value| value.min_element() >= 0.0));
        }
        drop(LumelDecoder::new(Coding::Halves, size).decode(&bytes));
    }
    assert!(accepted > 8, "mutations that leave a frame decodable are tried too: {accepted}");
}

/// A payload of nothing but zeros ends where it reads past its end, not after all lumels.
#[test]
fn what_ends_too_early_is_refused() {
    let lightmap = lightmap(256, 1, smooth(256));
    let frame = encoder(&lightmap).encode(&lightmap, update(0), |_| true).unwrap().remove(0).bytes;
    for length in [17, 18, 23, 1000, frame.len() / 2] {
        let mut decoder = LumelDecoder::new(Coding::Halves, UVec2::splat(256));
        let error = decoder.decode(&frame[..length]).map_err(|error| error.kind());
        assert!(matches!(error, Err("truncated" | "malformed")), "{length}: {error:?}");
    }
}
