//! Probes fitted to surfaces: what is read there afterwards, judged by light gathered there.

use std::sync::Arc;

use glam::{Quat, UVec3, Vec3};
use lumencast_gather::path_trace::{CpuPathTracer, Options};
use lumencast_gather::{Budget, Draws, Gather, Job, Receiver, Sums, SumsAt};
use lumencast_light::{FieldId, Grid, Light, Offset, Order, ProbeVolume};
use lumencast_scene::{Environment, LightKind, Material, PunctualLight, Snapshot};
use lumencast_solve::fit::{FitSettings, Part, Surroundings, fit};
use lumencast_testkit::scenes::{Stage, lambert};

const POINTS: u32 = 64;

fn gather(job: Job) -> Sums {
    let mut tracer = CpuPathTracer::new(Options::default()).unwrap();
    let ticket = tracer.submit(job);
    tracer.wait(ticket).unwrap().sums
}

fn irradiance(sums: &SumsAt<'_>) -> Vec3 {
    sums.mean().next().unwrap()
}

/// A volume as it is gathered, and what is seen from its probes.
fn look(scene: &Arc<Snapshot>, grid: Grid, bounces: u32) -> (ProbeVolume, Surroundings) {
    let probes: Arc<[Receiver]> = grid.positions().map(Receiver::probe).collect();
    let mut volume = ProbeVolume::dark(FieldId(0), grid, Order::L2);
    let sums = gather(Job { bounces, ..Job::new(scene.clone(), probes.clone(), 4096) });
    for (probe, sums) in sums.iter().enumerate() {
        for (c, mean) in volume.probe_mut(probe).iter_mut().zip(sums.mean()) {
            *c = mean;
        }
    }
    let job = Job { bounces: 0, surfaces: true, ..Job::new(scene.clone(), probes, POINTS) };
    (volume, Surroundings::new(&gather(job)))
}

/// What a volume's surroundings receive.
fn known(scene: &Arc<Snapshot>, around: &Surroundings, bounces: u32) -> Vec<Option<Vec3>> {
    let receivers: Vec<Receiver> = around.receivers().collect();
    let counting = (0..receivers.len() as u32).filter(|point| around.counts(*point as usize));
    let budgets: Vec<Budget> =
        counting.map(|receiver| Budget { receiver, samples: 256, draws: Draws::Own }).collect();
    let job = Job::with_budgets(scene.clone(), receivers, budgets.clone());
    let lit = gather(Job { bounces, ..job });
    let mut known = vec![None; around.points().len()];
    for (budget, sums) in budgets.iter().zip(lit.iter()) {
        known[budget.receiver as usize] = Some(irradiance(&sums));
    }
    known
}

/// The fit of a single volume to what is known of its surroundings, beginning from `start`.
fn fit_one(
    start: &ProbeVolume,
    gathered: &ProbeVolume,
    around: &Surroundings,
    known: impl Fn(usize) -> Option<Vec3>,
) -> ProbeVolume {
    let irradiance = (0..around.points().len()).map(known).collect();
    let mut light = Light::new(vec![start.clone()]);
    fit(&mut light, &[Part { gathered, around, irradiance }], &FitSettings::default());
    light.volumes().next().expect("a volume").clone()
}

/// The volume fitted to what its surroundings receive.
fn fitted(
    scene: &Arc<Snapshot>,
    volume: &ProbeVolume,
    around: &Surroundings,
    bounces: u32,
) -> ProbeVolume {
    let known = known(scene, around, bounces);
    fit_one(volume, volume, around, |point| known[point])
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
    let lamp = PunctualLight {
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
    let receivers: Vec<_> = (0..100).map(|i| Receiver::point(at(i), normal)).collect();
    let lit = gather(Job::new(scene.clone(), receivers, 4096));
    let (mut squares, mut sum) = (0.0, 0.0);
    for (i, sums) in (0..100).zip(lit.iter()) {
        let read = volume.sample(at(i), normal).irradiance(normal).y;
        squares += (read - irradiance(&sums).y).powi(2) / 100.0;
        sum += irradiance(&sums).y / 100.0;
    }
    [squares.sqrt(), sum]
}

#[test]
fn light_does_not_leak_through_a_wall_within_a_cell() {
    let scene = rooms();
    let (gathered, around) = look(&scene, grid_of_rooms(), 3);
    let volume = fitted(&scene, &gathered, &around, 3);
    let [leaked, nothing] = wall(&scene, &gathered, Vec3::X);
    let [left, _] = wall(&scene, &volume, Vec3::X);
    let [before, bright] = wall(&scene, &gathered, Vec3::NEG_X);
    let [after, _] = wall(&scene, &volume, Vec3::NEG_X);
    assert_eq!(nothing, 0.0);
    assert!(leaked > 0.1 * bright, "without a fit it leaks: {leaked} beside {bright}");
    assert!(left < 0.1 * leaked, "{left} of {leaked} is left");
    assert!(after < 0.5 * before, "{after} of {before} is left");
}

/// Two volumes that meet in the wall are fitted together, since clients read them together: the floor
/// beside the wall, where both count, comes nearer on either side.
#[test]
fn volumes_that_meet_in_a_wall_are_fitted_together() {
    let scene = rooms();
    let whole = grid_of_rooms();
    let part = |from: f32, to: f32| Grid {
        center: Vec3::X * 0.5 * (from + to),
        size: whole.size.with_x(to - from),
        resolution: UVec3::new(3, 2, 3),
        ..whole
    };
    let grids = [part(-3.0, 0.2), part(0.2, 3.0)];
    let looks: Vec<_> = (0..)
        .zip(grids)
        .map(|(id, grid)| {
            let (mut volume, around) = look(&scene, grid, 3);
            volume.id = FieldId(id);
            (volume, around)
        })
        .collect();
    let gathered = Light::new(looks.iter().map(|(volume, _)| volume.clone()));
    let mut light = gathered.clone();
    let parts: Vec<Part<'_>> = light
        .volumes()
        .map(|volume| {
            let (gathered, around) = &looks[volume.id.0 as usize];
            Part { gathered, around, irradiance: known(&scene, around, 3) }
        })
        .collect();
    fit(&mut light, &parts, &FitSettings::default());
    let at = |i: u32| {
        let x = 0.2 + if i < 30 { -0.4 } else { 0.1 } + 0.3 * (i % 5) as f32 / 4.0;
        Vec3::new(x, -1.0, 0.45 * (i % 30 / 5) as f32 - 1.1)
    };
    let receivers: Vec<_> = (0..60).map(|i| Receiver::point(at(i), Vec3::Y)).collect();
    let lit = gather(Job::new(scene.clone(), receivers, 1024));
    let lit: Vec<SumsAt<'_>> = lit.iter().collect();
    let bright = (0..30).map(|i| irradiance(&lit[i]).y).sum::<f32>() / 30.0;
    assert!(bright > 0.0 && lit[30..].iter().all(|sums| irradiance(sums) == Vec3::ZERO));
    // As it is displayed.
    let code = |irradiance: f32| (irradiance.max(0.0) / bright).powf(1.0 / 2.2);
    let off = |light: &Light| {
        let squares = (0..60).map(|i| {
            let read = code(light.irradiance(at(i), Vec3::Y).y);
            (read - code(irradiance(&lit[i as usize]).y)).powi(2)
        });
        (squares.sum::<f32>() / 60.0).sqrt()
    };
    assert!(off(&gathered) > 0.1, "without a fit it leaks");
    assert!(off(&light) < off(&gathered), "{} {}", off(&light), off(&gathered));
}

/// Bands that only specular light reads are those that were gathered; the others, the fit's of L2.
#[test]
fn higher_bands_stay() {
    let scene = rooms();
    let (low, around) = look(&scene, grid_of_rooms(), 1);
    let fitted_low = fitted(&scene, &low, &around, 1);
    for order in [Order::L3, Order::L4] {
        let mut gathered = ProbeVolume::dark(FieldId(0), low.grid, order);
        for probe in 0..low.grid.probe_count() {
            let light = gathered.probe_mut(probe);
            light.fill(Vec3::splat(0.3));
            light[..9].copy_from_slice(low.probe(probe));
        }
        let dark = ProbeVolume::dark(FieldId(0), low.grid, order);
        let known = |point: usize| {
            let at = around.points()[point]?;
            Some(fitted_low.sample(at.position, at.normal).irradiance(at.normal))
        };
        let volume = fit_one(&dark, &gathered, &around, known);
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
        let volume = fitted(&scene, &gathered, &around, 3);
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
    let volume = fitted(&scene, &gathered, &around, 0);
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
    let mut other = gathered.clone();
    other.coefficients.fill(Vec3::ONE);
    assert_eq!(fit_one(&other, &gathered, &around, |_| None), gathered);
    let scene = rooms();
    let (mut gathered, around) = look(&scene, grid_of_rooms(), 3);
    gathered.coefficients.fill(Vec3::ZERO);
    for irradiance in [Vec3::ZERO, Vec3::NAN] {
        assert_eq!(fit_one(&gathered, &gathered, &around, |_| Some(irradiance)), gathered);
    }
}

/// In units of another mean, as bright as the sun and as dim as the stars.
#[test]
fn light_may_have_any_scale() {
    let scene = rooms();
    let (gathered, around) = look(&scene, grid_of_rooms(), 1);
    let lit = known(&scene, &around, 1);
    let fit_scaled = |scale: f32| {
        let mut gathered = gathered.clone();
        gathered.coefficients.iter_mut().for_each(|c| *c *= scale);
        fit_one(&gathered, &gathered, &around, |point| Some(lit[point]? * scale))
    };
    let one = fit_scaled(1.0);
    let largest = one.coefficients.iter().map(|c| c.abs().max_element()).fold(0.0, f32::max);
    // Powers of two, by which nothing is rounded.
    for scale in [-40, 40].map(|power| 2f32.powi(power)) {
        for (c, expected) in fit_scaled(scale).coefficients.iter().zip(&one.coefficients) {
            assert!((c / scale - expected).abs().max_element() < 1e-4 * largest);
        }
    }
}

/// From 1 m above a floor whose front is below, and 2 m below a ceiling whose front is below too.
#[test]
fn surfaces_are_where_samples_meet_them() {
    let mut stage = Stage::default();
    let grey = stage.material(lambert(Vec3::ONE, Vec3::ZERO));
    for y in [-1.0, 2.0] {
        stage.quad(Vec3::new(-50.0, y, -50.0), Vec3::X * 100.0, Vec3::Z * 100.0, grey);
    }
    let job = Job::new(stage.snapshot(), [Receiver::probe(Vec3::ZERO)], 500);
    assert!(gather(Job { bounces: 0, ..job.clone() }).at(0).surfaces.is_empty(), "nobody asked");
    let found = gather(Job { bounces: 0, surfaces: true, ..job });
    let sums = found.at(0);
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
    let around = Surroundings::new(&found);
    assert_eq!((0..500).filter(|point| around.counts(*point)).count(), 0);
}
