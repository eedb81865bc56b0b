//! Each target with a counted number of mutated seeds: what a fuzzer would find soonest. `FUZZ_ROUNDS`
//! multiplies the numbers.

use lumencast_fuzz::mutate::{Random, mutated};
use lumencast_fuzz::seeds;

/// The seeds as they are, and so many mutations of them.
fn feed(target: fn(&[u8]), seeds: &[Vec<u8>], mutations: usize) {
    assert!(!seeds.is_empty() && seeds.iter().all(|seed| !seed.is_empty()));
    seeds.iter().for_each(|seed| target(seed));
    let rounds = std::env::var("FUZZ_ROUNDS").ok().and_then(|rounds| rounds.parse().ok());
    let mut random = Random::new(1);
    for _ in 0..mutations * rounds.unwrap_or(1) {
        let [seed, other] = [(); 2].map(|()| &seeds[random.below(seeds.len())]);
        target(&mutated(seed, other, &mut random));
    }
}

#[test]
fn probe_frames() {
    feed(lumencast_fuzz::probe_frames, &seeds::probe_frames(), 20_000);
}

#[test]
fn video_frames() {
    feed(lumencast_fuzz::video_frames, &seeds::video_frames(), 20_000);
}

#[test]
fn lumel_frames() {
    feed(lumencast_fuzz::lumel_frames, &seeds::lumel_frames(), 20_000);
}

#[test]
fn resources() {
    feed(lumencast_fuzz::resources, &seeds::resources(), 50_000);
}

#[test]
fn frames() {
    feed(lumencast_fuzz::frames, &seeds::frames(), 50_000);
}

#[test]
fn reader() {
    feed(lumencast_fuzz::reader, &seeds::reader(), 5_000);
}

#[test]
fn light_files() {
    feed(lumencast_fuzz::light_file, &seeds::light_files(), 10_000);
}

#[test]
fn edits() {
    feed(lumencast_fuzz::edits, &seeds::edits(), 2_000);
}

#[test]
fn scenes() {
    feed(lumencast_fuzz::scene, &seeds::scenes(), 500);
}
