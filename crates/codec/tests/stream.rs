//! Long streams: error bounds, drift, layers, watchers, and bytes that nobody encoded.

use glam::{Quat, UVec3, Vec3};
use lumencast_codec::{
    Catalog, ClientEdit, DecodeError, EncodedRegion, LightFile, ProbeDecoder, ProbeEncoder,
    ProbeHeader, RegionLight, StateFrame, UpdateInfo,
};
use lumencast_light::{FieldId, Grid, Order, ProbeVolume};

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

    /// Each component about normal with variance 1 (sum of twelve uniform numbers).
    fn normal(&mut self) -> Vec3 {
        let mut one =
            || (0..12).map(|_| (self.next() >> 40) as f32 / (1 << 24) as f32).sum::<f32>() - 6.0;
        Vec3::new(one(), one(), one())
    }
}

fn volume(resolution: [u32; 3], order: Order) -> ProbeVolume {
    let resolution = UVec3::from_array(resolution);
    let grid = Grid { center: Vec3::ZERO, rotation: Quat::IDENTITY, size: Vec3::ONE, resolution };
    ProbeVolume::dark(FieldId(0), grid, order)
}

/// Noisy light about which the encoder can know nothing.
fn light_up(volume: &mut ProbeVolume, brightness: f32, noise: f32, random: &mut Random) {
    for probe in 0..volume.grid.probe_count() {
        let own = brightness * (1.0 + 0.2 * (probe as f32).sin());
        for (i, c) in volume.probe_mut(probe).iter_mut().enumerate() {
            let mean = if i == 0 { 1.0 } else { 0.4 / (i as f32) };
            *c = own * (Vec3::splat(mean) + noise * random.normal());
        }
    }
}

fn update(update: u64) -> UpdateInfo {
    UpdateInfo { update, tick: update, time: update as f64 * 0.04, scene_version: update }
}

/// Root mean square of errors and the largest, relative to the length of each probe's c0.
fn errors(volume: &ProbeVolume, decoded: &[Vec3]) -> (f64, f64) {
    let n = volume.order.coefficients();
    let (mut sum, mut worst) = (0.0, 0.0_f64);
    for (exact, got) in volume.coefficients.chunks(n).zip(decoded.chunks(n)) {
        let c0 = f64::from(exact[0].length());
        for (e, g) in exact.iter().zip(got) {
            let error = f64::from(e.distance(*g)) / c0;
            sum += error * error;
            worst = worst.max(error);
        }
    }
    ((sum / (3 * volume.coefficients.len()) as f64).sqrt(), worst)
}

#[test]
fn errors_stay_within_what_is_stated() {
    for (brightness, order) in
        [(1.0, Order::L1), (45_000.0, Order::L2), (3e-4, Order::L3), (1.0, Order::L4)]
    {
        let mut volume = volume([5, 4, 6], order);
        let mut encoder = ProbeEncoder::new(volume.grid.resolution, order);
        let mut decoder = ProbeDecoder::new(volume.grid.resolution, order);
        let mut random = Random(1);
        for u in 0..100 {
            light_up(&mut volume, brightness, 0.03, &mut random);
            let frame = encoder.encode(&volume, update(u), |_| true).remove(0);
            let decoded = decoder.decode(&frame.bytes).unwrap();
            let (rms, worst) = errors(&volume, &decoded.coefficients);
            assert!(rms < 0.01, "{order:?} {u}: {rms}");
            assert!((f64::from(frame.error) - rms).abs() < 1e-4, "the encoder knows its error");
            // One step in each of three channels; a step is 2.1 % of c0's length, √3 of it in all.
            assert!(worst < 0.021 * 3.0_f64.sqrt(), "{order:?} {u}: {worst}");
        }
    }
}

#[test]
fn ten_thousand_updates_do_not_drift() {
    let mut volume = volume([3, 3, 3], Order::L2);
    let mut encoder = ProbeEncoder::new(volume.grid.resolution, Order::L2);
    let mut decoder = ProbeDecoder::new(volume.grid.resolution, Order::L2);
    let mut random = Random(2);
    let (mut worst, mut farthest) = (0.0_f64, 0.0_f64);
    for u in 0..10_000 {
        let brightness = 1.0 + 0.5 * (u as f32 * 0.003).sin();
        light_up(&mut volume, brightness, 0.01, &mut random);
        let frame = encoder.encode(&volume, update(u), |_| true).remove(0);
        let decoded = decoder.decode(&frame.bytes).unwrap();
        let (rms, largest) = errors(&volume, &decoded.coefficients);
        (worst, farthest) = (worst.max(rms), farthest.max(largest));
    }
    assert!(worst < 0.01, "{worst}");
    assert!(farthest < 0.021 * 3.0_f64.sqrt(), "{farthest}");
}

#[test]
fn a_still_field_costs_almost_nothing_and_keeps_still() {
    let mut volume = volume([8, 8, 8], Order::L2);
    light_up(&mut volume, 1.0, 0.05, &mut Random(3));
    let mut encoder = ProbeEncoder::new(volume.grid.resolution, Order::L2);
    let mut decoder = ProbeDecoder::new(volume.grid.resolution, Order::L2);
    let mut first: Option<RegionLight> = None;
    for u in 0..40 {
        let frame = encoder.encode(&volume, update(u), |_| true).remove(0);
        let light = decoder.decode(&frame.bytes).unwrap();
        if let Some(first) = &first {
            assert!(frame.bytes.len() < 1000, "{u}: {} bytes", frame.bytes.len());
            let n = volume.coefficients.len();
            let moved =
                light.coefficients.iter().zip(&first.coefficients).filter(|(a, b)| a != b).count();
            assert!(moved < n / 10, "{u}: {moved} of {n} coefficients moved");
        } else {
            assert!(frame.bytes.len() > 3000);
            first = Some(light);
        }
    }
}

#[test]
fn a_single_value_that_moves_is_not_overlooked() {
    // So little that the probe's mean error stays below what is left alone.
    let mut volume = volume([4, 4, 4], Order::L2);
    light_up(&mut volume, 1.0, 0.05, &mut Random(8));
    let mut encoder = ProbeEncoder::new(volume.grid.resolution, Order::L2);
    let mut decoder = ProbeDecoder::new(volume.grid.resolution, Order::L2);
    let first = encoder.encode(&volume, update(0), |_| true).remove(0);
    volume.coefficients = decoder.decode(&first.bytes).unwrap().coefficients;
    for probe in 0..volume.grid.probe_count() {
        let c0 = volume.probe(probe)[0].length();
        volume.probe_mut(probe)[5] += 0.027 * c0 / 3.0_f32.sqrt();
    }
    let second = encoder.encode(&volume, update(1), |_| true).remove(0);
    let (_, worst) = errors(&volume, &decoder.decode(&second.bytes).unwrap().coefficients);
    assert!(worst < 0.021, "{worst}");
}

#[test]
fn each_layer_needs_only_itself_and_lower_ones() {
    let mut volume = volume([4, 4, 4], Order::L2);
    let mut encoder = ProbeEncoder::new(volume.grid.resolution, Order::L2);
    let mut random = Random(4);
    let frames: Vec<EncodedRegion> = (0..120)
        .flat_map(|u| {
            light_up(&mut volume, 1.0, 0.03, &mut random);
            encoder.encode(&volume, update(u), |_| true)
        })
        .collect();
    let decode = |kept: u8| -> Vec<(u64, Vec<Vec3>)> {
        let mut decoder = ProbeDecoder::new(UVec3::splat(4), Order::L2);
        let kept = frames.iter().filter(|frame| frame.layer <= kept);
        kept.map(|frame| decoder.decode(&frame.bytes).unwrap())
            .map(|light| (light.header.info.update, light.coefficients))
            .collect()
    };
    let all = decode(2);
    assert_eq!(all.len(), 120);
    for kept in [0, 1] {
        let some = decode(kept);
        assert_eq!(some.len(), [30, 60][usize::from(kept)]);
        assert!(some.iter().all(|light| all.contains(light)), "the same bits as with all layers");
    }
    // Groups begin where a client may begin: at keyframes, and after them in the other layers.
    let mut new_groups = frames.iter().filter(|frame| frame.new_group);
    for (u, layer) in [(0, 0), (1, 2), (2, 1), (40, 0), (41, 2), (42, 1)] {
        let frame = new_groups.next().unwrap();
        let header = ProbeHeader::read(&frame.bytes).unwrap();
        assert_eq!((header.info.update, frame.layer), (u, layer));
        assert_eq!(header.base.is_none(), layer == 0);
    }
}

#[test]
fn keyframes_are_staggered_and_come_when_somebody_begins_to_watch() {
    let mut volume = volume([16, 8, 8], Order::L1);
    light_up(&mut volume, 1.0, 0.03, &mut Random(5));
    let mut encoder = ProbeEncoder::new(volume.grid.resolution, Order::L1);
    let mut keyframes = Vec::new();
    for u in 0..160 {
        // Region 1 is watched from update 61 on: it begins at 64.
        for frame in encoder.encode(&volume, update(u), |region| region == 0 || u >= 61) {
            assert!(frame.region == 0 || u >= 64);
            if ProbeHeader::read(&frame.bytes).unwrap().base.is_none() {
                keyframes.push((frame.region, u));
            }
        }
    }
    assert_eq!(
        keyframes,
        [(0, 0), (0, 40), (1, 64), (1, 76), (0, 80), (1, 116), (0, 120), (1, 156)]
    );
}

#[test]
fn gaps_in_the_numbers_are_bridged() {
    let mut volume = volume([2, 2, 2], Order::L2);
    let mut encoder = ProbeEncoder::new(volume.grid.resolution, Order::L2);
    let mut decoder = ProbeDecoder::new(volume.grid.resolution, Order::L2);
    let mut random = Random(6);
    for u in [0, 4, 5, 6, 7, 11, 12, 200, 202, 1000, 1004, 1005] {
        light_up(&mut volume, 1.0, 0.03, &mut random);
        for frame in encoder.encode(&volume, update(u), |_| true) {
            let light = decoder.decode(&frame.bytes).unwrap();
            assert!(errors(&volume, &light.coefficients).0 < 0.01);
        }
    }
}

#[test]
fn light_that_is_no_light_is_encoded_all_the_same() {
    let mut volume = volume([2, 2, 2], Order::L2);
    let extremes =
        [f32::NAN, f32::INFINITY, f32::MAX, f32::MIN, f32::MIN_POSITIVE, 1e-45, -0.0, 1e30];
    for (i, c) in volume.coefficients.iter_mut().enumerate() {
        *c = Vec3::new(extremes[i % 8], extremes[i / 8 % 8], extremes[(i + 3) % 8]);
    }
    let mut encoder = ProbeEncoder::new(volume.grid.resolution, Order::L2);
    let mut decoder = ProbeDecoder::new(volume.grid.resolution, Order::L2);
    for u in 0..8 {
        for frame in encoder.encode(&volume, update(u), |_| true) {
            let light = decoder.decode(&frame.bytes).unwrap();
            assert!(light.coefficients.iter().all(|c| c.is_finite()));
        }
        volume.coefficients.rotate_left(1);
    }
}

#[test]
fn neighbours_may_differ_a_billionfold() {
    let mut volume = volume([4, 1, 1], Order::L1);
    for (probe, value) in [1e5, 1e-3, 1e5, 0.0].into_iter().enumerate() {
        volume.probe_mut(probe).fill(Vec3::splat(value));
    }
    let mut encoder = ProbeEncoder::new(volume.grid.resolution, Order::L1);
    let frame = encoder.encode(&volume, update(0), |_| true).remove(0);
    let mut decoder = ProbeDecoder::new(volume.grid.resolution, Order::L1);
    let light = decoder.decode(&frame.bytes).unwrap();
    // What is 2^-24 of the scale, here 2^17, counts as dark: 0.0078.
    for (exact, got) in volume.coefficients.iter().zip(&light.coefficients) {
        let tolerated = 0.02 * exact.length() + 0.0078 * 0.05;
        assert!(exact.distance(*got) < tolerated, "{exact} {got}");
    }
}

/// Frames with bits turned, cut short, joined, and plain noise.
#[test]
fn no_bytes_make_a_decoder_panic() {
    let mut random = Random(7);
    let mut volume = volume([6, 5, 4], Order::L2);
    let mut encoder = ProbeEncoder::new(volume.grid.resolution, Order::L2);
    let mut decoder = ProbeDecoder::new(volume.grid.resolution, Order::L2);
    let mut frames = Vec::new();
    for u in 0..8 {
        light_up(&mut volume, 1.0, 0.05, &mut random);
        frames.push(encoder.encode(&volume, update(u), |_| true).remove(0).bytes);
        decoder.decode(&frames[u as usize]).unwrap();
    }
    let file = LightFile::of_fields(
        lumencast_codec::SceneInfo { name: "a".into(), root: "b".into() },
        "a test",
        [&volume.clone().into()],
        UpdateInfo::default(),
    );
    frames.extend([file.write(), file.catalog.encode(), StateFrame::default().encode()]);
    let mut accepted = 0;
    for _ in 0..20_000 {
        let mut bytes = frames[random.below(frames.len())].clone();
        match random.below(4) {
            0 => bytes.truncate(random.below(bytes.len())),
            1 => {
                for _ in 0..=random.below(4) {
                    let at = random.below(bytes.len());
                    bytes[at] ^= 1 << random.below(8);
                }
            }
            2 => {
                let (from, to) = (random.below(bytes.len()), random.below(bytes.len()));
                bytes[from.min(to)..].rotate_left(1);
            }
            _ => {
                bytes.iter_mut().skip(random.below(30)).for_each(|byte| *byte = random.next() as u8)
            }
        }
        let mut decoder = decoder.clone();
        if let Ok(light) = decoder.decode(&bytes) {
            accepted += 1;
            assert!(light.coefficients.len() == volume.coefficients.len());
        }
        drop(StateFrame::decode(&bytes));
        drop(ClientEdit::decode(&bytes));
        drop(Catalog::decode(&bytes));
        if let Ok(file) = LightFile::read(&bytes) {
            drop(file.fields());
        }
    }
    assert!(accepted > 100, "mutations that leave a frame decodable are tried too: {accepted}");
}

#[test]
fn frames_that_are_too_long_are_refused_unread() {
    let bytes = vec![1; lumencast_codec::limits::FRAME_BYTES + 1];
    let error = ProbeDecoder::new(UVec3::ONE, Order::L1).decode(&bytes);
    assert!(matches!(error, Err(DecodeError::Limit { .. })));
    assert!(matches!(Catalog::decode(&bytes), Err(DecodeError::Limit { .. })));
}
