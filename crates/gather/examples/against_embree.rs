//! Our rays beside Embree's, in turns, on the same threads and the same triangles.
//!
//! `LUMENCAST_EMBREE=libembree4.so cargo run --release -p lumencast-gather --example against_embree --
//! SCENE [RAYS] [THREADS]`
//!
//! Embree runs with its default (medium) build quality, once in its watertight mode, as ours always
//! is, and once without; over all triangles in one level, and in two, which is what a scene whose
//! parts move needs, each beside ours with as many levels. Ours in one level is told for trees as they
//! are built, as Embree's are, and improved, as pictures and bakes have them. Ratios above 1 mean that
//! ours is faster.
#![expect(clippy::print_stdout, reason = "a program for the terminal")]

use std::collections::HashMap;
use std::error::Error;
use std::num::NonZeroUsize;
use std::time::Instant;

use glam::{Affine3A, Vec3};
use lumencast_gather::measure::{RayBench, TestRay, build_seconds, scattered, top_level_seconds};
use lumencast_gather::path_trace::{Levels, Options, Trees};
use lumencast_scene::{Scene, Snapshot};
use lumencast_testkit::embree::{Embree, EmbreeInstances, Quality};
use rayon::prelude::*;

const ROUNDS: usize = 15;
/// Instances under the top level that is built.
const INSTANCES: u32 = 1000;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let name = arguments.next().ok_or("which scene?")?;
    let rays: usize = arguments.next().map_or(Ok(1_000_000), |n| n.parse())?;
    let threads = arguments.next().map(|n| n.parse::<NonZeroUsize>()).transpose()?;
    let library =
        std::env::var_os("LUMENCAST_EMBREE").ok_or("LUMENCAST_EMBREE names no library")?;

    let mut scene = Scene::open(&name)?;
    let view = match scene.cameras().first() {
        Some(camera) => camera.view(),
        None => return Err("the scene has no camera".into()),
    };
    let snapshot = scene.snapshot();
    let bench_with = |levels, trees| {
        let options = Options { threads, levels, ..Options::default() };
        RayBench::new(&snapshot, view, rays, &options, trees)
    };
    let bench = bench_with(Levels::One, Trees::Improved)?;
    let bench_built = bench_with(Levels::One, Trees::AsBuilt)?;
    let bench_two = bench_with(Levels::Two, Trees::Improved)?;
    let triangles = bench.triangles();
    let pool = bench.install(rayon::current_num_threads);
    println!("{name}: {} triangles, {} rays, {pool} threads", triangles.len(), bench.closest.len());

    let build = |robust| Embree::new(library.as_ref(), &triangles, Quality::Medium, robust, pool);
    let kinds = [
        (Levels::One, Trees::AsBuilt),
        (Levels::Two, Trees::AsBuilt),
        (Levels::One, Trees::Improved),
    ];
    let mut builds = kinds.map(|_| Vec::new());
    for _ in 0..ROUNDS {
        let theirs = seconds(|| build(true).map(drop));
        for (ratios, (levels, trees)) in builds.iter_mut().zip(kinds) {
            ratios.push(theirs / bench.install(|| build_seconds(&snapshot, levels, trees)));
        }
    }
    let [one, two, improved] = builds.map(median);
    println!("build: {one:.2} of Embree's speed, in two levels {two:.2}; improved {improved:.2}");

    let first = &snapshot.instances[0];
    let mesh = triangles[..first.mesh.triangle_count()].to_vec();
    let object_from_world = first.world_from_object.inverse();
    let places: Vec<_> =
        scattered(&snapshot, INSTANCES).into_iter().map(|to| to * object_from_world).collect();
    let placed: Vec<_> = places.iter().map(|&to| (0, to)).collect();
    let mut instances = EmbreeInstances::new(library.as_ref(), &[mesh], &placed, true, pool)?;
    let (mut tops, mut fastest) = (Vec::new(), [f64::INFINITY; 2]);
    for _ in 0..10 * ROUNDS {
        let ours = bench.install(|| top_level_seconds(&snapshot, INSTANCES));
        let start = Instant::now();
        instances.place(places.iter().copied());
        let theirs = start.elapsed().as_secs_f64();
        fastest = [fastest[0].min(ours), fastest[1].min(theirs)];
        tops.push(theirs / ours);
    }
    println!(
        "top level over {INSTANCES} instances: {:.2} of Embree's speed (best {:.2} and {:.2} ms)",
        median(tops),
        1e3 * fastest[0],
        1e3 * fastest[1],
    );

    let (meshes, placed) = levels(&snapshot, &triangles);
    for robust in [true, false] {
        let mode = if robust { "watertight" } else { "fast" };
        let one = build(robust)?;
        for (bench, trees) in [(&bench, "one level"), (&bench_built, "one level as built")] {
            against(
                bench,
                &format!("{mode}, {trees}"),
                |r| one.closest(r.origin, r.direction, r.t_max).is_some(),
                |r| one.occluded(r.origin, r.direction, r.t_max),
            );
        }
        let two = EmbreeInstances::new(library.as_ref(), &meshes, &placed, robust, pool)?;
        against(
            &bench_two,
            &format!("{mode}, two levels"),
            |r| two.closest(r.origin, r.direction, r.t_max).is_some(),
            |r| two.occluded(r.origin, r.direction, r.t_max),
        );
    }
    Ok(())
}

/// Triangles of one mesh.
type Triangles = Vec<[Vec3; 3]>;

/// The scene's meshes, once each (deformed ones once an instance), and where they stand.
fn levels(
    snapshot: &Snapshot,
    triangles: &[[Vec3; 3]],
) -> (Vec<Triangles>, Vec<(usize, Affine3A)>) {
    let (mut meshes, mut known, mut placed) = (Vec::new(), HashMap::new(), Vec::new());
    let mut rest = triangles;
    for instance in &snapshot.instances {
        let (own, after) = rest.split_at(instance.mesh.triangle_count());
        rest = after;
        let object_from_world = instance.world_from_object.inverse();
        let mut add = || {
            let place = |c: Vec3| object_from_world.transform_point3(c);
            meshes.push(own.iter().map(|corners| corners.map(place)).collect());
            meshes.len() - 1
        };
        let mesh = match instance.deformation {
            Some(_) => add(),
            None => *known.entry(instance.mesh_id).or_insert_with(add),
        };
        placed.push((mesh, instance.world_from_object));
    }
    (meshes, placed)
}

/// Traces ours and theirs in turns, and prints the medians of the ratios.
fn against(
    bench: &RayBench,
    what: &str,
    closest_of: impl Fn(&TestRay) -> bool + Sync,
    any_of: impl Fn(&TestRay) -> bool + Sync,
) {
    let (mut closest, mut any) = (Vec::new(), Vec::new());
    let mut rates = [0.0f64; 4];
    for _ in 0..ROUNDS {
        let times = [
            seconds(|| bench.trace_closest(&bench.closest)),
            seconds(|| run(bench, &bench.closest, &closest_of)),
            seconds(|| bench.trace_any(&bench.any)),
            seconds(|| run(bench, &bench.any, &any_of)),
        ];
        closest.push(times[1] / times[0]);
        any.push(times[3] / times[2]);
        let counts = [&bench.closest, &bench.closest, &bench.any, &bench.any].map(Vec::len);
        for (rate, (time, count)) in rates.iter_mut().zip(times.into_iter().zip(counts)) {
            *rate = rate.max(1e-6 * count as f64 / time);
        }
    }
    println!(
        "{what}: closest {:.2} of Embree's speed (best {:.2} and {:.2} M/s), any {:.2} (best {:.2} and {:.2} M/s)",
        median(closest),
        rates[0],
        rates[1],
        median(any),
        rates[2],
        rates[3],
    );
}

/// Traces on the same threads, in pieces of the same size.
fn run(bench: &RayBench, rays: &[TestRay], one: impl Fn(&TestRay) -> bool + Sync) -> Vec<bool> {
    bench.install(|| rays.par_chunks(1024).flat_map_iter(|rays| rays.iter().map(&one)).collect())
}

fn seconds<T>(run: impl FnOnce() -> T) -> f64 {
    let start = Instant::now();
    let result = run();
    let time = start.elapsed().as_secs_f64();
    drop(result);
    time
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}
