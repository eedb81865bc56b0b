//! Probes fitted to surfaces: what is read there afterwards, judged by light gathered there.

use std::sync::Arc;

use glam::{Quat, UVec3, Vec3};
use lumencast_gather::fit::{FitSettings, Surroundings};
use lumencast_gather::path_trace::{CpuPathTracer, Options};
use lumencast_gather::{Gather, Job, Place, Receiver, Sums};
use lumencast_light::{Grid, Offset, Order, ProbeVolume, VolumeId};
use lumencast_scene::{Environment, Light, LightKind, Material, Snapshot};
use lumencast_testkit::scenes::{Stage, lambert};

const POINTS: u32 = 64;

fn gather(job: Job) -> Vec<Sums> {
    let mut tracer = CpuPathTracer::new(Options::default()).unwrap();
    let ticket = tracer.submit(job);
    tracer.wait(ticket).unwrap().sums
}

fn irradiance(sums: &Sums) -> Vec3 {
    sums.mean().next().unwrap()
}

/// A volume as it is gathered, and what is seen from its probes.
fn look(scene: &Arc<Snapshot>, grid: Grid, bounces: u32) -> (ProbeVolume, Surroundings) {
    let probes =
        |samples| grid.positions().map(|at| Receiver::probe(at, samples)).collect::<Vec<_>>();
    let mut volume = ProbeVolume::dark(VolumeId(0), grid, Order::L2);
    let sums = gather(Job { bounces, ..Job::new(scene.clone(), probes(4096)) });
    for (probe, sums) in sums.iter().enumerate() {
        for (c, mean) in volume.probe_mut(probe).iter_mut().zip(sums.mean()) {
            *c = mean;
        }
    }
    let job = Job { bounces: 0, surfaces: true, ..Job::new(scene.clone(), probes(POINTS)) };
    (volume, Surroundings::new(&gather(job)))
}

/// The volume fitted to what its surroundings receive.
fn fitted(
    scene: &Arc<Snapshot>,
    volume: &ProbeVolume,
    around: &Surroundings,
    bounces: u32,
    settings: &FitSettings,
) -> ProbeVolume {
    let (numbers, receivers): (Vec<usize>, Vec<Receiver>) = around.receivers(256).unzip();
    let lit = gather(Job { bounces, ..Job::new(scene.clone(), receivers) });
    let mut known = vec![None; around.points().len()];
    for (number, sums) in numbers.into_iter().zip(&lit) {
        known[number] = Some(irradiance(sums));
    }
    let mut result = volume.clone();
    around.fit(&mut result, volume, |point| known[point], settings);
    result
}

/// Two rooms with a wall between them that is thinner than a cell: a lamp shines in one, the other
/// one is dark.
fn rooms() -> Arc<Snapshot> {
    let mut stage = Stage::default();
    let grey = stage.material(lambert(Vec3::splat(0.6), Vec3::ZERO));
    let wall = lambert(Vec3::splat(0.6), Vec3::ZERO);
    let wall = stage.material(Material { double_sided: true, ..wall });
    stage.room(Vec3::ZERO, Vec3::new(6.0, 2.0, 3.0), grey);
    stage.quad(Vec3::new(0.2, -1.0, -1.5), Vec3::Y * 2.0, Vec3::Z * 3.0, wall);
    let lamp = Light {
        kind: LightKind::Point { radius: 0.0 },
        color: Vec3::ONE,
        intensity: 100.0,
        range: None,
    };
    stage.light(lamp, Vec3::new(-1.5, 0.4, 0.3), Vec3::NEG_Y);
    stage.snapshot()
}

fn grid_of_rooms() -> Grid {
    Grid {
        center: Vec3::ZERO,
        rotation: Quat::IDENTITY,
        size: Vec3::new(6.0, 2.0, 3.0),
        resolution: UVec3::new(5, 2, 3),
    }
}

/// Root of the mean square of what is read too much or too little at points of the wall's side
/// towards `normal`, and the mean of what should be read.
fn wall(scene: &Arc<Snapshot>, volume: &ProbeVolume, normal: Vec3) -> [f32; 2] {
    let at = |i: u32| Vec3::new(0.2, 0.18 * (i % 10) as f32 - 0.8, 0.28 * (i / 10) as f32 - 1.26);
    let receiver = |i: u32| Receiver {
        place: Place::Lumel { position: at(i), normal, footprint: [Vec3::ZERO; 2] },
        samples: 4096,
    };
    let lit = gather(Job::new(scene.clone(), (0..100).map(receiver).collect::<Vec<_>>()));
    let (mut squares, mut sum) = (0.0, 0.0);
    for (i, sums) in (0..100).zip(&lit) {
        let read = volume.sample(at(i), normal).irradiance(normal).y;
        squares += (read - irradiance(sums).y).powi(2) / 100.0;
        sum += irradiance(sums).y / 100.0;
    }
    [squares.sqrt(), sum]
}

#[test]
fn light_does_not_leak_through_a_wall_within_a_cell() {
    let scene = rooms();
    let (gathered, around) = look(&scene, grid_of_rooms(), 3);
    let volume = fitted(&scene, &gathered, &around, 3, &FitSettings::default());
    let [leaked, nothing] = wall(&scene, &gathered, Vec3::X);
    let [left, _] = wall(&scene, &volume, Vec3::X);
    let [before, bright] = wall(&scene, &gathered, Vec3::NEG_X);
    let [after, _] = wall(&scene, &volume, Vec3::NEG_X);
    assert_eq!(nothing, 0.0);
    assert!(leaked > 0.1 * bright, "without a fit it leaks: {leaked} beside {bright}");
    assert!(left < 0.1 * leaked, "{left} of {leaked} is left");
    assert!(after < 0.5 * before, "{after} of {before} is left");
}

/// Bands that only specular light reads are those that were gathered; the others, the fit's of L2.
#[test]
fn higher_bands_stay() {
    let scene = rooms();
    let (low, around) = look(&scene, grid_of_rooms(), 1);
    let fitted_low = fitted(&scene, &low, &around, 1, &FitSettings::default());
    for order in [Order::L3, Order::L4] {
        let mut gathered = ProbeVolume::dark(VolumeId(0), low.grid, order);
        for probe in 0..low.grid.probe_count() {
            let light = gathered.probe_mut(probe);
            light.fill(Vec3::splat(0.3));
            light[..9].copy_from_slice(low.probe(probe));
        }
        let mut volume = ProbeVolume::dark(VolumeId(0), low.grid, order);
        let irradiance = |point: usize| {
            let at = around.points()[point]?;
            Some(fitted_low.sample(at.position, at.normal).irradiance(at.normal))
        };
        around.fit(&mut volume, &gathered, irradiance, &FitSettings::default());
        let scale = mean(low.grid, &fitted_low);
        for probe in 0..low.grid.probe_count() {
            let (all, own) = (volume.probe(probe), gathered.probe(probe));
            assert_eq!(all[9..], own[9..], "{order:?}");
        }
        assert!((mean(low.grid, &volume) / scale - 1.0).abs() < 0.1, "{order:?}");
    }
}

fn mean(grid: Grid, volume: &ProbeVolume) -> f32 {
    (0..grid.probe_count()).map(|probe| volume.probe(probe)[0].y).sum::<f32>()
}

/// A fit for clients that read elsewhere is another one.
#[test]
fn it_is_fitted_for_where_clients_read() {
    let scene = rooms();
    let (gathered, around) = look(&scene, grid_of_rooms(), 3);
    let here = gathered.offset;
    for [own, other] in [[here, Offset::NONE], [Offset::NONE, here]] {
        let gathered = gathered.clone().read_at(own);
        let volume = fitted(&scene, &gathered, &around, 3, &FitSettings::default());
        assert_eq!(volume.offset, own);
        let right = wall(&scene, &volume, Vec3::NEG_X)[0];
        let wrong = wall(&scene, &volume.read_at(other), Vec3::NEG_X)[0];
        assert!(wrong > 2.0 * right, "{wrong} {right}");
    }
}

/// In light that is the same everywhere there is nothing to mend: every probe keeps its own.
#[test]
fn what_is_right_stays() {
    let mut stage = Stage::default();
    stage.environment(Environment::Constant { radiance: Vec3::ONE });
    let shining = Material { double_sided: true, ..lambert(Vec3::ZERO, Vec3::ONE) };
    let shining = stage.material(shining);
    stage.quad(Vec3::new(-1.0, -0.2, -1.0), Vec3::Z * 2.0, Vec3::X * 2.0, shining);
    let scene = stage.snapshot();
    let grid = Grid { size: Vec3::splat(3.0), resolution: UVec3::splat(3), ..grid_of_rooms() };
    let (gathered, around) = look(&scene, grid, 0);
    let volume = fitted(&scene, &gathered, &around, 0, &FitSettings::default());
    assert!(around.points().iter().flatten().count() > 100);
    for probe in 0..grid.probe_count() {
        for (c, g) in volume.probe(probe).iter().zip(gathered.probe(probe)) {
            assert!((c - g).abs().max_element() < 5e-3, "{probe}: {c} {g}");
        }
    }
}

#[test]
fn without_light_or_surfaces_it_is_what_was_gathered() {
    let (gathered, around) = look(&Stage::default().snapshot(), grid_of_rooms(), 3);
    let mut volume = gathered.clone();
    volume.coefficients.fill(Vec3::ONE);
    around.fit(&mut volume, &gathered, |_| None, &FitSettings::default());
    assert_eq!(volume, gathered);
    let scene = rooms();
    let (mut gathered, around) = look(&scene, grid_of_rooms(), 3);
    gathered.coefficients.fill(Vec3::ZERO);
    let mut volume = gathered.clone();
    around.fit(&mut volume, &gathered, |_| Some(Vec3::ZERO), &FitSettings::default());
    assert_eq!(volume, gathered);
    around.fit(&mut volume, &gathered, |_| Some(Vec3::NAN), &FitSettings::default());
    assert_eq!(volume, gathered);
}

/// From 1 m above a floor whose front is below, and 2 m below a ceiling whose front is below too.
#[test]
fn surfaces_are_where_samples_meet_them() {
    let mut stage = Stage::default();
    let grey = stage.material(lambert(Vec3::ONE, Vec3::ZERO));
    for y in [-1.0, 2.0] {
        stage.quad(Vec3::new(-50.0, y, -50.0), Vec3::X * 100.0, Vec3::Z * 100.0, grey);
    }
    let job = Job::new(stage.snapshot(), [Receiver::probe(Vec3::ZERO, 500)]);
    assert!(gather(Job { bounces: 0, ..job.clone() })[0].surfaces.is_empty(), "nobody asked");
    let sums = gather(Job { bounces: 0, surfaces: true, ..job }).remove(0);
    assert_eq!(sums.surfaces.len(), 500);
    let (mut above, mut below) = (0, 0);
    for at in sums.surfaces.iter().flatten() {
        if at.position.y > 0.0 {
            assert!((at.position.y - 2.0).abs() < 1e-4 && at.normal == Vec3::NEG_Y && at.front);
            above += 1;
        } else {
            assert!((at.position.y + 1.0).abs() < 1e-4 && at.normal == Vec3::Y && !at.front);
            below += 1;
        }
    }
    // Half of all directions each, but for those that pass the borders 50 m away.
    assert!((230..=250).contains(&above) && (235..=250).contains(&below), "{above} {below}");
    // A probe that sees so many backs is inside of something: its points do not count.
    let around = Surroundings::new(&[sums]);
    assert_eq!(around.receivers(1).count(), 0);
}
