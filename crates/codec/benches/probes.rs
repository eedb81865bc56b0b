//! Probe frames made and read.
//!
//! ```sh
//! cargo bench -p lumencast-codec
//! ```

use criterion::{BatchSize, Criterion, Throughput, criterion_group, criterion_main};
use glam::{Quat, UVec3, Vec3};
use lumencast_codec::{ProbeDecoder, ProbeEncoder, UpdateInfo, regions};
use lumencast_light::{FieldId, Grid, Order, ProbeVolume};

/// Light that changes a little from update to update, all of it.
fn light(update: u64) -> ProbeVolume {
    let grid = Grid {
        center: Vec3::ZERO,
        rotation: Quat::IDENTITY,
        size: Vec3::splat(8.0),
        resolution: UVec3::splat(8),
    };
    let mut volume = ProbeVolume::dark(FieldId(0), grid, Order::L2);
    for (i, c) in volume.coefficients.iter_mut().enumerate() {
        let phase = 0.7 * i as f32 + 0.05 * update as f32;
        *c = Vec3::new(phase.sin(), (1.3 * phase).sin(), (0.6 * phase).cos());
        if i % 9 == 0 {
            *c = 4.0 + *c;
        }
    }
    volume
}

fn info(update: u64) -> UpdateInfo {
    UpdateInfo { update, ..UpdateInfo::default() }
}

fn codec(criterion: &mut Criterion) {
    let lights: Vec<ProbeVolume> = (0..2).map(light).collect();
    let (grid, order) = (lights[0].grid, lights[0].order);
    let mut encoder = ProbeEncoder::new(grid.resolution, order);
    let keyframe = encoder.encode(&lights[0], info(0), |_| true).remove(0).bytes;
    let after_keyframe = encoder.clone();
    let delta = encoder.encode(&lights[1], info(1), |_| true).remove(0).bytes;
    let size = regions(grid.resolution)[0].size;

    let mut group = criterion.benchmark_group("probes");
    group.throughput(Throughput::Elements(grid.probe_count() as u64));
    group.bench_function("encode/keyframe", |b| {
        let new = || ProbeEncoder::new(grid.resolution, order);
        let encode = |mut encoder: ProbeEncoder| encoder.encode(&lights[0], info(0), |_| true);
        b.iter_batched(new, encode, BatchSize::SmallInput);
    });
    group.bench_function("encode/delta", |b| {
        let encode = |mut encoder: ProbeEncoder| encoder.encode(&lights[1], info(1), |_| true);
        b.iter_batched(|| after_keyframe.clone(), encode, BatchSize::SmallInput);
    });
    group.bench_function("decode/keyframe", |b| {
        b.iter(|| ProbeDecoder::new(size, order).decode(&keyframe).expect("a frame"));
    });
    group.bench_function("decode/delta", |b| {
        let mut decoder = ProbeDecoder::new(size, order);
        decoder.decode(&keyframe).expect("a frame");
        let decode = |mut decoder: ProbeDecoder| decoder.decode(&delta).expect("a frame");
        b.iter_batched(|| decoder.clone(), decode, BatchSize::SmallInput);
    });
    group.finish();
}

criterion_group!(probes, codec);
criterion_main!(probes);
