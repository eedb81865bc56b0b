//! Bytes and errors of probe frames over a simulated minute of 25 updates a second:
//! `cargo run -p lumencast-codec --example measure -- [CELLS] [SAMPLES] [SECONDS] [ORDER]`.

#![expect(clippy::print_stdout, reason = "its purpose is to print a table")]

mod room;

use std::time::{Duration, Instant};

use glam::Vec3;
use lumencast_codec::{ProbeDecoder, ProbeEncoder, UpdateInfo};
use lumencast_light::{Order, ProbeVolume};
use room::{Random, Room};

/// Updates a second.
const RATE: f32 = 25.0;
/// Share of a new tick in the blended light.
const RATIO: f32 = 0.05;

fn main() {
    let mut arguments = std::env::args().skip(1).map(|a| a.parse::<u32>().expect("a number"));
    let cells = arguments.next().unwrap_or(8);
    let samples = arguments.next().unwrap_or(16);
    let seconds = arguments.next().unwrap_or(60);
    let order = Order::try_from(arguments.next().unwrap_or(2) as u8).expect("an order");
    println!(
        "{cells}³ probes, {order:?}, {samples} samples a probe and tick, {seconds} s at {RATE} Hz"
    );
    println!(
        "sequence     bytes/update  /probe  key/probe  layer0  layer1  layer2  rms/c0   worst  encode  decode"
    );
    for (name, scene) in SEQUENCES {
        measure(name, scene, cells, samples, seconds, order);
    }
}

type Scene = fn(f32) -> Room;
const SEQUENCES: [(&str, Scene); 4] = [
    ("still", |_| Room {
        lamp: Vec3::new(0.5, 1.5, 0.3),
        intensity: 800.0,
        ball: Vec3::new(-1.0, -1.0, 0.0),
    }),
    ("moving lamp", |t| Room {
        lamp: Vec3::new(2.0 * (0.9 * t).cos(), 1.2, 2.0 * (0.9 * t).sin()),
        intensity: 800.0,
        ball: Vec3::new(-1.0, -1.0, 0.0),
    }),
    ("switch", |t| Room {
        lamp: Vec3::new(0.5, 1.5, 0.3),
        intensity: if ((t / 5.0) as u32).is_multiple_of(2) { 800.0 } else { 20.0 },
        ball: Vec3::new(-1.0, -1.0, 0.0),
    }),
    ("minute", |t| Room {
        lamp: if t % 20.0 < 8.0 {
            Vec3::new(2.0 * t.cos(), 1.2, 2.0 * t.sin())
        } else {
            Vec3::new(0.5, 1.5, 0.3)
        },
        intensity: if t % 30.0 > 25.0 { 20.0 } else { 800.0 },
        ball: Vec3::new(-1.0 + (0.7 * t).sin(), -1.0, 0.8 * t.cos()),
    }),
];

fn measure(name: &str, scene: Scene, cells: u32, samples: u32, seconds: u32, order: Order) {
    let mut light = room::volume(cells, order);
    let mut tick = light.clone();
    let mut encoder = ProbeEncoder::new(light.grid.resolution, order);
    let regions: Vec<_> = encoder.regions().collect();
    let mut decoders: Vec<_> = regions.iter().map(|r| ProbeDecoder::new(r.size, order)).collect();
    let mut random = Random::new(7);
    let probes = light.grid.probe_count() as f64;
    let updates = (seconds as f32 * RATE) as u64;
    let (mut bytes, mut count) = ([0_usize; 4], [0_usize; 4]);
    let (mut square, mut worst) = (0.0, 0.0_f64);
    let (mut encoding, mut decoding) = (Duration::ZERO, Duration::ZERO);
    for update in 0..updates {
        let time = update as f32 / RATE;
        scene(time).gather(&mut tick, samples, &mut random);
        let ratio = RATIO.max(1.0 / (update + 1) as f32);
        for (l, t) in light.coefficients.iter_mut().zip(&tick.coefficients) {
            *l = l.lerp(*t, ratio);
        }
        let info = UpdateInfo { update, tick: update, time: f64::from(time), scene_version: 0 };
        let start = Instant::now();
        let frames = encoder.encode(&light, info, |_| true);
        encoding += start.elapsed();
        let mut sum = 0.0;
        for frame in frames {
            let start = Instant::now();
            let region = frame.region as usize;
            let decoded = decoders[region].decode(&frame.bytes).expect("what was encoded");
            decoding += start.elapsed();
            let kind = if decoded.header.base.is_none() { 3 } else { usize::from(frame.layer) };
            bytes[kind] += frame.bytes.len();
            count[kind] += regions[region].probe_count();
            let own = regions[region].probes(light.grid.resolution);
            sum += relative_square_error(&light, own, &decoded.coefficients);
        }
        let mean = sum / (3.0 * light.coefficients.len() as f64);
        square += mean;
        worst = worst.max(mean.sqrt());
    }
    let total: usize = bytes.iter().sum();
    let each = |kind: usize| bytes[kind] as f64 / count[kind].max(1) as f64;
    println!(
        "{name:12} {:12.0} {:7.2} {:10.2} {:7.2} {:7.2} {:7.2} {:6.2} % {:5.2} % {:5.2} ms {:4.2} ms",
        total as f64 / updates as f64,
        total as f64 / updates as f64 / probes,
        each(3),
        each(0),
        each(1),
        each(2),
        100.0 * (square / updates as f64).sqrt(),
        100.0 * worst,
        encoding.as_secs_f64() * 1e3 / updates as f64,
        decoding.as_secs_f64() * 1e3 / updates as f64,
    );
}

/// Sum of squared errors, relative to the length of each probe's c0.
fn relative_square_error(
    light: &ProbeVolume,
    probes: impl Iterator<Item = usize>,
    decoded: &[Vec3],
) -> f64 {
    let n = light.order.coefficients();
    probes
        .zip(decoded.chunks(n))
        .map(|(probe, values)| {
            let exact = light.probe(probe);
            let error: f32 = exact.iter().zip(values).map(|(e, v)| e.distance_squared(*v)).sum();
            f64::from(error / exact[0].length_squared())
        })
        .sum()
}
