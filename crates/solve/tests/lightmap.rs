//! Light at lumels, beside what is known in closed form.

use std::collections::HashSet;
use std::f32::consts::PI;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use glam::{Affine3A, Quat, UVec3, Vec3};
use lumencast_charts::{LaidOut, Sheet, laid_out, lumels_on_pages, sheets};
use lumencast_gather::path_trace::{CpuPathTracer, Options};
use lumencast_gather::{Gather, Job, Receiver, Shading};
use lumencast_light::{FieldId, Grid, Light, Lightmap, Order, Place, ProbeVolume, SurfaceId};
use lumencast_scene::{
    Edit, Environment, LightKind, LightmapSpec, Material, PunctualLight, Scene, Snapshot, Transform,
};
use lumencast_solve::blend::BlendSettings;
use lumencast_solve::{
    FitEffort, GatherOptions, LightmapSolver, Request, Solver, Turn, spread, with_backs,
};
use lumencast_testkit::scenes::{Stage, lambert};

/// All updates are averaged.
const MEAN: BlendSettings = BlendSettings { ratio: f32::MIN_POSITIVE, significance: f32::INFINITY };

fn tracer() -> CpuPathTracer {
    CpuPathTracer::new(Options::default()).expect("threads")
}

fn laid(scene: &Arc<Snapshot>) -> LaidOut {
    let fronts = sheets(scene, None, &|_| true).expect("charts").sheets;
    let all = with_backs(fronts, scene, &mut tracer()).expect("a look");
    laid_out(&all, LightmapSpec::Size(128)).expect("a layout")
}

fn lit(scene: &Arc<Snapshot>, bounces: u32, samples: u32) -> (LightmapSolver, LaidOut, Lightmap) {
    let laid_out = laid(scene);
    let (solver, lightmap) = solved(scene, &laid_out, bounces, samples, true);
    (solver, laid_out, lightmap)
}

/// Lumels that lie so, after so many samples each.
fn solved(
    scene: &Arc<Snapshot>,
    laid_out: &LaidOut,
    bounces: u32,
    samples: u32,
    filtered: bool,
) -> (LightmapSolver, Lightmap) {
    let mut solver = LightmapSolver::new(FieldId(3), scene, laid_out, MEAN);
    let mut tracer = tracer();
    let job = Job { bounces, ..solver.job(scene.clone(), samples) };
    let budgets = job.budgets.clone();
    let ticket = tracer.submit(job);
    solver.take(&tracer.wait(ticket).expect("light"), &budgets);
    let mut lightmap = solver.dark();
    solver.solve(filtered, &Light::default(), &mut lightmap);
    (solver, lightmap)
}

fn irradiances(scene: &Snapshot, lightmap: &Lightmap, count: usize) -> Vec<Vec3> {
    let places = spread(scene, &lightmap.layout, count);
    places
        .iter()
        .map(|p| lightmap.irradiance_at(&p.on.expect("a point")).expect("lumels"))
        .collect()
}

/// A closed room whose walls shine: on every lumel arrives π times the radiance, the sum of a geometric
/// series.
#[test]
fn a_furnace_is_as_bright_everywhere() {
    let mut stage = Stage::default();
    let wall = stage.material(lambert(Vec3::splat(0.5), Vec3::new(1.0, 2.0, 0.5)));
    stage.room(Vec3::ZERO, Vec3::new(4.0, 2.0, 3.0), wall);
    let scene = stage.snapshot();
    let (solver, _, lightmap) = lit(&scene, 12, 64);
    assert_eq!(solver.buried_count(), 0);
    let expected = PI * Vec3::new(1.0, 2.0, 0.5) / (1.0 - 0.5);
    for irradiance in irradiances(&scene, &lightmap, 1000) {
        let ratio = irradiance / expected;
        assert!((ratio - 1.0).abs().max_element() < 0.02, "{ratio}");
    }
}

/// A floor between a wall that shines and a dark sky: on tilted normals lumels with slopes come much
/// nearer to what arrives there, and on the surface's own they tell what those without tell.
#[test]
fn slopes_tell_what_arrives_on_tilted_normals() {
    let mut stage = Stage::default();
    let grey = stage.material(lambert(Vec3::splat(0.5), Vec3::ZERO));
    let lamp = stage.material(lambert(Vec3::ZERO, Vec3::new(4.0, 3.0, 2.0)));
    stage.environment(Environment::Constant { radiance: Vec3::splat(0.2) });
    stage.quad(Vec3::new(-1.0, 0.0, 1.0), 2.0 * Vec3::X, -2.0 * Vec3::Z, grey);
    stage.quad(Vec3::new(1.5, 0.2, -1.0), 2.0 * Vec3::Z, 1.5 * Vec3::Y, lamp);
    let scene = stage.snapshot();
    let laid_out = laid(&scene);
    let mut tracer = tracer();
    let mut gathered = |receivers: Vec<Receiver>, samples| {
        let job = Job { bounces: 0, ..Job::new(scene.clone(), receivers, samples) };
        let ticket = tracer.submit(job);
        tracer.wait(ticket).expect("light")
    };
    let mut solver = LightmapSolver::new(FieldId(3), &scene, &laid_out, MEAN).with_slopes(true);
    let job = solver.job(scene.clone(), 256);
    solver.take(&gathered(job.receivers.to_vec(), 256), &job.budgets);
    let mut lightmap = solver.dark();
    solver.solve(true, &Light::default(), &mut lightmap);
    let floor = |place: &Place| place.normal.y > 0.9;
    let places: Vec<Place> =
        spread(&scene, &lightmap.layout, 600).into_iter().filter(floor).collect();
    assert!(places.len() > 200);
    let tilted = |k: usize| {
        let (sin, cos) = (k as f32 * 2.4).sin_cos();
        Vec3::new(0.45 * sin, 1.0, 0.45 * cos).normalize()
    };
    let shaded = |(k, place): (usize, &Place)| {
        Receiver::point_shaded(place.position, place.normal, Shading::By(tilted(k)))
    };
    let right = gathered(places.iter().enumerate().map(shaded).collect(), 4096);
    let error = |lightmap: &Lightmap| {
        let squares = places.iter().enumerate().zip(right.sums.iter()).map(|((k, place), sums)| {
            let right = sums.mean().next().expect("irradiance");
            let on = place.on.expect("a point");
            let told = lightmap.irradiance_on(&on, place.normal, tilted(k)).expect("lumels");
            (told / right - 1.0).length_squared() / 3.0
        });
        (squares.sum::<f32>() / places.len() as f32).sqrt()
    };
    let (with, without) = (error(&lightmap), error(&lightmap.clone().with_slopes(false)));
    assert!(without > 0.15 && with < 0.3 * without, "{with}, without slopes {without}");
}

/// A floor so long that its lumels are larger than those of a rug on it, both beside a dark wall: noise
/// goes from all of them.
#[test]
fn lumels_of_two_sizes_are_filtered() {
    let mut stage = Stage::default();
    let grey = stage.material(lambert(Vec3::splat(0.5), Vec3::ZERO));
    let black = stage.material(lambert(Vec3::ZERO, Vec3::ZERO));
    stage.environment(Environment::Constant { radiance: Vec3::ONE });
    stage.quad(Vec3::ZERO, 4.0 * Vec3::Z, 400.0 * Vec3::X, grey);
    stage.quad(Vec3::new(200.0, 0.02, 1.0), 2.0 * Vec3::Z, 3.0 * Vec3::X, grey);
    stage.quad(Vec3::ZERO, 400.0 * Vec3::X, 5.0 * Vec3::Y, black);
    let scene = stage.snapshot();
    let fronts = sheets(&scene, None, &|_| true).expect("charts").sheets;
    let laid_out = laid_out(&fronts, LightmapSpec::Texel(0.05)).expect("a layout");
    let [floor, rug] = laid_out.layout.surfaces() else { panic!("two surfaces") };
    assert!(laid_out.texel_of(rug.id) == 0.05 && laid_out.texel_of(floor.id) > 0.35);
    let light = |samples, filtered| solved(&scene, &laid_out, 0, samples, filtered).1.irradiance;
    let (right, gathered, filtered) = (light(512, false), light(4, false), light(4, true));
    for surface in [floor, rug] {
        let lumels = lumels_on_pages(&laid_out.layout, surface);
        let lumels: Vec<usize> = lumels.map(|(lumel, _)| lumel).collect();
        let error = |light: &[Vec3]| {
            let squares = lumels.iter().map(|l| light[*l].distance_squared(right[*l]));
            (squares.sum::<f32>() / lumels.len() as f32).sqrt()
        };
        let (gathered, filtered) = (error(&gathered), error(&filtered));
        assert!(filtered < 0.4 * gathered, "{:?}: {gathered} to {filtered}", surface.id);
    }
}

/// A closed room whose walls shine, so brightly.
fn furnace(emission: f32) -> Snapshot {
    let mut stage = Stage::default();
    let wall = stage.material(lambert(Vec3::splat(0.5), Vec3::splat(emission)));
    stage.room(Vec3::ZERO, Vec3::new(4.0, 2.0, 3.0), wall);
    Snapshot::clone(&stage.snapshot())
}

/// Live light: a sixteenth of the lumels, gathered at first, lights all of them; and so it does when the
/// light has changed.
#[test]
fn a_glance_at_all_pages_lights_them() {
    let mut scene = Arc::new(furnace(1.0));
    let laid_out = laid(&scene);
    let mut solver = LightmapSolver::new(FieldId(0), &scene, &laid_out, BlendSettings::default());
    let mut tracer = tracer();
    let lumels = solver.lumel_count() as u64;
    let mut lightmap = solver.dark();
    let mut gather = |solver: &mut LightmapSolver,
                      lightmap: &mut Lightmap,
                      scene: &Arc<Snapshot>,
                      samples: u64| {
        let mut spent = 0;
        while spent < samples {
            let (job, budgets) = solver.next_job(scene.clone(), samples / 8);
            let job = Job { bounces: 12, seed: spent, ..job };
            spent += job.samples();
            let ticket = tracer.submit(job);
            solver.take(&tracer.wait(ticket).expect("light"), &budgets);
            solver.solve(true, &Light::default(), lightmap);
        }
    };
    let worst = |lightmap: &Lightmap, scene: &Snapshot, emission: f32| {
        let right = 2.0 * PI * emission;
        let read = irradiances(scene, lightmap, 2000);
        read.iter().map(|e| (e.x / right - 1.0).abs()).fold(0.0, f32::max)
    };
    // 16 samples of every sixteenth lumel, and of more along the borders of charts.
    gather(&mut solver, &mut lightmap, &scene, 2 * lumels);
    assert!(worst(&lightmap, &scene, 1.0) < 0.07, "{}", worst(&lightmap, &scene, 1.0));
    gather(&mut solver, &mut lightmap, &scene, 8 * lumels);
    assert!(worst(&lightmap, &scene, 1.0) < 0.04, "{}", worst(&lightmap, &scene, 1.0));

    scene = Arc::new(Snapshot { version: scene.version + 1, ..furnace(3.0) });
    solver.expect_change();
    assert!(worst(&lightmap, &scene, 3.0) > 0.5, "nothing has been gathered");
    gather(&mut solver, &mut lightmap, &scene, 2 * lumels);
    assert!(worst(&lightmap, &scene, 3.0) < 0.08, "{}", worst(&lightmap, &scene, 3.0));
}

/// However many blocks wait, no more are solved at a time than are asked for, and all of them in the end.
#[test]
fn blocks_are_solved_a_few_at_a_time() {
    const SIDE: usize = 256;
    const BLOCK: usize = 64;
    let scene = Arc::new(furnace(1.0));
    let all = sheets(&scene, None, &|_| true).expect("charts").sheets;
    let laid_out = laid_out(&all, LightmapSpec::Size(SIDE as u32)).expect("a layout");
    let mut solver = Solver::new(&[], GatherOptions::default()).expect("no volumes");
    solver.set_lightmap(&scene, Some(&laid_out));
    let field = solver.ids().next().expect("lumels");
    // Enough for a glance at all of them.
    let lumels = Some(4 * solver.lumel_count() as u64);
    let turn = Turn { previous: None, samples: 1, lumels, pass: 0 };
    let Request { job, asked } = solver.job(field, &scene, turn).expect("a job");
    let mut tracer = tracer();
    let ticket = tracer.submit(job);
    solver.take(&asked, &tracer.wait(ticket).expect("light"));
    let light =
        |solver: &Solver| solver.light().lightmaps().next().expect("lumels").irradiance.clone();
    let (mut before, mut solved) = (light(&solver), HashSet::new());
    for _ in 0..(SIDE / BLOCK).pow(2) {
        solver.solve_lightmaps(2);
        let after = light(&solver);
        let changed = (0..SIDE * SIDE).filter(|k| before[*k] != after[*k]);
        let changed: HashSet<_> = changed.map(|k| (k % SIDE / BLOCK, k / SIDE / BLOCK)).collect();
        assert!(changed.len() <= 2, "{changed:?}");
        solved.extend(changed);
        before = after;
    }
    assert!(solved.len() > 8, "{}", solved.len());
    let read = irradiances(&scene, solver.light().lightmaps().next().expect("lumels"), 500);
    assert!(read.iter().all(|irradiance| irradiance.x > 0.0));
}

/// Lumels that little is known of show the light of probes, until samples tell of all about them.
#[test]
fn lumels_begin_with_the_light_of_probes() {
    let scene = Arc::new(furnace(1.0));
    let laid_out = laid(&scene);
    let mut solver = LightmapSolver::new(FieldId(1), &scene, &laid_out, BlendSettings::default());
    let grid = Grid {
        center: Vec3::ZERO,
        rotation: Quat::IDENTITY,
        size: Vec3::splat(8.0),
        resolution: UVec3::ONE,
    };
    let mut volume = ProbeVolume::dark(FieldId(0), grid, Order::L1);
    for probe in 0..grid.probe_count() {
        volume.probe_mut(probe)[0] = Vec3::X / 0.282_094_8; // radiance 1, of red, from everywhere
    }
    let probes = Light::new([volume]);
    let mut lightmap = solver.dark();
    let read = |lightmap: &Lightmap| irradiances(&scene, lightmap, 500);
    solver.solve(true, &Light::default(), &mut lightmap);
    assert!(read(&lightmap).iter().all(|e| *e == Vec3::ZERO), "there are no probes");
    solver.solve(true, &probes, &mut lightmap);
    assert!(read(&lightmap).iter().all(|e| e.abs_diff_eq(PI * Vec3::X, 1e-3)));
    let mut tracer = tracer();
    let (mut lit, mut samples) = (0, 0);
    while lit < 500 {
        let (job, budgets) = solver.next_job(scene.clone(), 4096);
        samples += job.samples();
        let ticket = tracer.submit(Job { bounces: 12, ..job });
        solver.take(&tracer.wait(ticket).expect("light"), &budgets);
        solver.solve(true, &probes, &mut lightmap);
        let now = read(&lightmap).iter().filter(|e| e.z > 0.5 * PI).count();
        assert!(now >= lit, "light of lumels gives way to none");
        assert!(now == 0 || samples > solver.lumel_count() as u64, "glances tell less than probes");
        lit = now;
        let either = |e: &Vec3| e.x > 0.5 * PI;
        assert!(read(&lightmap).iter().all(either), "and nothing is dark meanwhile");
    }
}

/// Under an even sky: a plate that stands free has lumels on both sides and is as bright as the sky; a
/// closed box has none on its insides, though its material is double-sided.
#[test]
fn backs_have_lumels_where_light_arrives() {
    let mut stage = Stage::default();
    let both = Material { double_sided: true, ..lambert(Vec3::splat(0.5), Vec3::ZERO) };
    let both = stage.material(both);
    let single = stage.material(lambert(Vec3::splat(0.5), Vec3::ZERO));
    stage.quad(Vec3::new(10.0, 0.0, 0.0), Vec3::X, Vec3::Y, both);
    stage.room(Vec3::ZERO, Vec3::splat(-2.0), both);
    stage.quad(Vec3::new(-10.0, 0.0, 0.0), Vec3::X, Vec3::Y, single);
    stage.environment(Environment::Constant { radiance: Vec3::ONE });
    let scene = stage.snapshot();
    let (_, laid_out, lightmap) = lit(&scene, 2, 64);
    let backs = laid_out.layout.surfaces().iter().filter(|s| s.id.back);
    assert_eq!(backs.map(|s| s.id.node).collect::<Vec<_>>(), [0], "the plate's alone");
    // A convex thing's outside, and both sides of a plate, see nothing but the sky.
    for irradiance in irradiances(&scene, &lightmap, 500) {
        assert!((irradiance / PI - 1.0).abs().max_element() < 1e-3, "{irradiance}");
    }
}

/// Below a box that stands on a plate no light arrives, and none is measured: its lumels take that of
/// the plate about it, so that no dark seam shows where they meet.
#[test]
fn lumels_within_something_take_the_light_about_them() {
    let mut stage = Stage::default();
    let grey = stage.material(lambert(Vec3::splat(0.5), Vec3::ZERO));
    stage.quad(Vec3::new(-2.0, 0.0, -2.0), 4.0 * Vec3::Z, 4.0 * Vec3::X, grey);
    stage.room(Vec3::ZERO, Vec3::splat(-1.0), grey);
    stage.environment(Environment::Constant { radiance: Vec3::ONE });
    let scene = stage.snapshot();
    let (solver, _, lightmap) = lit(&scene, 0, 256);
    let share = solver.buried_count() as f32 / solver.lumel_count() as f32;
    // The box stands halfway in the plate: a sixteenth of the plate is within it.
    assert!((0.01..0.1).contains(&share), "{share}");
    let dark = irradiances(&scene, &lightmap, 2000).iter().filter(|e| e.x < 0.2 * PI).count();
    assert_eq!(dark, 0);
}

/// Behind a pane, and in a room whose walls are wound outwards, lumels see little but the backs of
/// double-sided surfaces. Light comes from these, so what arrives is shown.
#[test]
fn lumels_before_backs_that_are_lit_have_their_own_light() {
    let of_both_sides = |stage: &mut Stage| {
        let both = lambert(Vec3::splat(0.5), Vec3::ZERO);
        stage.material(Material { double_sided: true, ..both })
    };
    let mut pane = Stage::default();
    let both = of_both_sides(&mut pane);
    pane.quad(Vec3::new(-1.0, 0.0, -1.0), 2.0 * Vec3::Z, 2.0 * Vec3::X, both);
    pane.quad(Vec3::new(-0.5, 0.25, -0.5), Vec3::Z, Vec3::X, both);
    pane.environment(Environment::Constant { radiance: Vec3::ONE });
    let mut room = Stage::default();
    let both = of_both_sides(&mut room);
    room.room(Vec3::ZERO, Vec3::splat(-2.0), both);
    room.quad(Vec3::new(-0.5, 0.0, -0.5), Vec3::Z, Vec3::X, both);
    let lamp = PunctualLight {
        kind: LightKind::Point { radius: 0.0 },
        color: Vec3::ONE,
        intensity: 10.0,
        range: None,
    };
    room.light(lamp, Vec3::new(0.2, 0.7, 0.3), Vec3::Y);
    for (stage, from) in [(pane, Vec3::splat(-0.4)), (room, Vec3::splat(-0.5))] {
        let scene = stage.snapshot();
        let (_, _, lightmap) = lit(&scene, 3, 1024);
        let seen = |place: &Place| {
            place.normal.y > 0.9
                && place.position.y == 0.0
                && place.position.cmpge(from).all()
                && place.position.cmple(-from).all()
        };
        let places: Vec<Place> =
            spread(&scene, &lightmap.layout, 4000).into_iter().filter(seen).collect();
        assert!(places.len() > 50, "{}", places.len());
        let receivers: Vec<Receiver> =
            places.iter().map(|place| Receiver::point(place.position, place.normal)).collect();
        let mut tracer = tracer();
        let ticket = tracer.submit(Job { bounces: 3, ..Job::new(scene.clone(), receivers, 4096) });
        let right = tracer.wait(ticket).expect("light");
        for (place, right) in places.iter().zip(right.sums.iter()) {
            let right = right.mean().next().expect("irradiance").x;
            let told = lightmap.irradiance_at(&place.on.expect("a point")).expect("lumels").x;
            assert!((told / right - 1.0).abs() < 0.1, "{told}, not {right} at {}", place.position);
        }
    }
}

/// What is not finite does not count, nor what was never gathered.
#[test]
fn a_lightmap_without_light_is_dark() {
    let mut stage = Stage::default();
    let grey = stage.material(lambert(Vec3::splat(0.5), Vec3::ZERO));
    stage.primitive(plate(), Affine3A::from_scale(Vec3::new(1.0, 3.0, 1.0)));
    stage.quad(Vec3::ZERO, Vec3::X, Vec3::Y, grey);
    let scene = stage.snapshot();
    let laid_out = laid(&scene);
    let mut solver = LightmapSolver::new(FieldId(0), &scene, &laid_out, MEAN);
    let mut lightmap = solver.dark();
    solver.solve(true, &Light::default(), &mut lightmap);
    assert!(lightmap.irradiance.iter().all(|e| *e == Vec3::ZERO));
}

fn plate() -> lumencast_scene::Primitive {
    let mut stage = Stage::default();
    let grey = stage.material(lambert(Vec3::ONE, Vec3::ZERO));
    stage.quad(Vec3::ZERO, Vec3::X, Vec3::Z, grey);
    stage.snapshot().instances[0].mesh.primitives[0].clone()
}

/// Points are spread by area: a surface twice as large has twice as many.
#[test]
fn points_are_spread_by_area() {
    let mut stage = Stage::default();
    let grey = stage.material(lambert(Vec3::splat(0.5), Vec3::ZERO));
    stage.quad(Vec3::ZERO, Vec3::X, Vec3::Y, grey);
    stage.quad(Vec3::Z, 2.0 * Vec3::X, Vec3::Y, grey);
    let scene = stage.snapshot();
    let fronts: Vec<Sheet> = sheets(&scene, None, &|_| true).expect("charts").sheets;
    let layout = laid_out(&fronts, LightmapSpec::Size(64)).expect("a layout").layout;
    let places = spread(&scene, &layout, 3000);
    let first = places.iter().filter(|place| place.position.z == 0.0).count();
    assert_eq!((places.len(), first), (3000, 1000));
    let mean = places.iter().filter(|p| p.position.z == 0.0).map(|p| p.position).sum::<Vec3>();
    let mean = mean / first as f32;
    assert!((mean - Vec3::new(0.5, 0.5, 0.0)).abs().max_element() < 0.02, "{mean}");
    assert!(places.iter().all(|place| place.normal == Vec3::Z));
}

/// The floor of a lit room as one quad, or as so many tiles a side, each with charts of its own.
fn tiled(tiles: u32) -> Arc<Snapshot> {
    let mut stage = Stage::default();
    let grey = stage.material(lambert(Vec3::splat(0.5), Vec3::ZERO));
    let lamp = stage.material(lambert(Vec3::ZERO, Vec3::splat(10.0)));
    let tile = 4.0 / tiles as f32;
    for k in 0..tiles * tiles {
        let corner = tile * Vec3::new((k % tiles) as f32, 0.0, (k / tiles) as f32);
        stage.quad(corner, Vec3::Z * tile, Vec3::X * tile, grey);
    }
    stage.quad(Vec3::new(1.0, 3.0, 1.0), Vec3::X * 2.0, Vec3::Z * 2.0, lamp);
    stage.snapshot()
}

/// Noise is filtered across charts: a floor of tiles has no more of it than one that is whole.
#[test]
fn noise_is_filtered_across_charts() {
    let error = |tiles: u32| {
        let scene = tiled(tiles);
        let all = sheets(&scene, None, &|_| true).expect("charts").sheets;
        let laid_out = laid_out(&all, LightmapSpec::Texel(0.1)).expect("a layout");
        let light = |samples: u32| solved(&scene, &laid_out, 1, samples, true).1;
        let [noisy, right] = [8, 512].map(light);
        let places = spread(&scene, &laid_out.layout, 2000);
        let squares: f32 = places
            .iter()
            .filter(|place| place.position.y < 1.0)
            .map(|place| {
                let on = place.on.as_ref().expect("a surface");
                let [noisy, right] =
                    [&noisy, &right].map(|light| light.irradiance_at(on).expect("lumels").y);
                (noisy / right - 1.0).powi(2)
            })
            .sum();
        squares.sqrt()
    };
    let [whole, tiles] = [1, 16].map(error);
    assert!(tiles < 1.6 * whole, "{tiles} beside {whole}");
}

/// A plate that comes later and can be seen from both sides gets lumels on both; a closed box of the same
/// material on its outside alone.
#[test]
fn backs_of_what_comes_later_have_lumels() {
    let room = |is_furnished: bool, time: f64| {
        let mut stage = Stage::default();
        let grey = lambert(Vec3::splat(0.5), Vec3::ONE);
        let both = stage.material(Material { double_sided: true, ..grey.clone() });
        let wall = stage.material(grey);
        stage.room(Vec3::ZERO, Vec3::splat(4.0), wall);
        if is_furnished {
            stage.quad(Vec3::ZERO, Vec3::X, Vec3::Y, both);
            stage.room(Vec3::new(-1.0, 0.0, 0.0), Vec3::splat(-1.0), both);
        }
        Arc::new(Snapshot {
            time,
            version: u64::from(is_furnished),
            ..Snapshot::clone(&stage.snapshot())
        })
    };
    let empty = room(false, 0.0);
    let mut solver = Solver::new(&[], GatherOptions::default()).expect("no volumes");
    solver.set_lightmap(&empty, Some(&laid(&empty)));
    solver.follow(&empty);
    assert!(solver.newcomers(&empty).is_none());
    solver.follow(&room(true, 1.0));
    let rested = room(true, 4.0);
    let newcomers = solver.newcomers(&rested).expect("what has come");
    // Ticks' own work never waits for it among the threads that all share.
    let threads = AtomicUsize::new(0);
    let goes_on = || threads.fetch_max(rayon::current_num_threads(), Ordering::Relaxed) < 9;
    let placed = newcomers.place(None, &mut tracer(), &goes_on).expect("a layout");
    assert_eq!((placed.left_out, threads.into_inner()), (0, 1));
    let surfaces = placed.layout().surfaces();
    let sides = |node: u32| -> Vec<bool> {
        surfaces.iter().filter(|s| s.id.node == node).map(|s| s.id.back).collect()
    };
    let later = empty.instances.len();
    let nodes: Vec<u32> = rested.instances.iter().skip(later).map(|i| i.node.0).collect();
    assert_eq!(sides(nodes[0]), [false, true]);
    assert!(nodes[1..].iter().all(|node| sides(*node) == [false]));
}

/// What an edit turns to glass is lit by probes until it is none any more; what was black gets lumels once it
/// is grey and has rested.
#[test]
fn lumels_follow_materials() {
    let scene = |transmission: f32, color: f32, version: u64, time: f64| {
        let mut stage = Stage::default();
        let wall = stage.material(lambert(Vec3::splat(0.5), Vec3::ONE));
        let pane = lambert(Vec3::splat(0.5), Vec3::ZERO);
        let pane = stage.material(Material { transmission, ..pane });
        let plate = stage.material(lambert(Vec3::splat(color), Vec3::ZERO));
        stage.room(Vec3::ZERO, Vec3::splat(4.0), wall);
        stage.quad(Vec3::ZERO, Vec3::X, Vec3::Y, pane);
        stage.quad(-Vec3::ONE, Vec3::X, Vec3::Y, plate);
        Arc::new(Snapshot { time, version, ..Snapshot::clone(&stage.snapshot()) })
    };
    let first = scene(0.0, 0.0, 0, 0.0);
    let mut solver = Solver::new(&[], GatherOptions::default()).expect("no volumes");
    solver.set_lightmap(&first, Some(&laid(&first)));
    let nodes = |solver: &Solver| -> Vec<u32> {
        let lightmap = solver.light().lightmaps().next().expect("a lightmap");
        lightmap.layout.surfaces().iter().map(|surface| surface.id.node).collect()
    };
    assert!(solver.follow(&first).is_empty());
    assert_eq!(nodes(&solver), [0, 1, 2, 3, 4, 5, 6]);
    assert_eq!(solver.follow(&scene(0.5, 0.0, 1, 1.0)).len(), 1);
    assert_eq!(nodes(&solver), [0, 1, 2, 3, 4, 5]);
    assert_eq!(solver.follow(&scene(0.0, 0.0, 2, 2.0)).len(), 1);
    assert_eq!(nodes(&solver), [0, 1, 2, 3, 4, 5, 6]);
    let rested = |version, time| scene(0.0, 0.5, version, time);
    assert!(solver.newcomers(&scene(0.0, 0.0, 2, 9.0)).is_none());
    solver.follow(&rested(3, 10.0));
    assert!(solver.newcomers(&rested(3, 11.0)).is_none());
    let newcomers = solver.newcomers(&rested(3, 13.0)).expect("what was black");
    let placed = newcomers.place(None, &mut tracer(), &|| true).expect("a layout");
    assert_eq!(placed.layout().surfaces().last().map(|surface| surface.id.node), Some(7));
    // With as many primitives that show lumels, it is not tried again.
    solver.leave_without_lumels(&newcomers);
    solver.follow(&rested(4, 20.0));
    assert!(solver.newcomers(&rested(4, 30.0)).is_none());
}

/// A plate is carried elsewhere and lit there while lumels are placed for what has come: it has none until
/// its own are where it is.
#[test]
fn what_moves_while_newcomers_are_placed_waits_for_its_lumels() {
    let room = |at: Vec3, is_furnished: bool, time: f64| {
        let mut stage = Stage::default();
        let wall = stage.material(lambert(Vec3::splat(0.5), Vec3::ONE));
        stage.room(Vec3::ZERO, Vec3::splat(4.0), wall);
        let plate = stage.snapshot().instances.len();
        stage.quad(Vec3::ZERO, Vec3::X, Vec3::Y, wall);
        if is_furnished {
            stage.quad(-Vec3::Z, Vec3::X, Vec3::Y, wall);
        }
        let mut scene = Snapshot::clone(&stage.snapshot());
        (scene.time, scene.version) = (time, time as u64);
        scene.instances[plate].world_from_object = Affine3A::from_translation(at);
        let ids = scene.instances[plate..].iter().map(|i| i.node.0);
        let ids = ids.map(|node| SurfaceId { node, ..SurfaceId::default() }).collect::<Vec<_>>();
        (Arc::new(scene), ids)
    };
    let (empty, _) = room(Vec3::ZERO, false, 0.0);
    let mut solver = Solver::new(&[], GatherOptions::default()).expect("no volumes");
    solver.set_lightmap(&empty, Some(&laid(&empty)));
    let field = solver.ids().next().expect("a lightmap");
    solver.follow(&empty);
    solver.follow(&room(Vec3::ZERO, true, 1.0).0);
    let (rested, plates) = room(Vec3::ZERO, true, 4.0);
    let newcomers = solver.newcomers(&rested).expect("what has come");
    let placed = newcomers.place(None, &mut tracer(), &|| true).expect("a layout");

    let has = |solver: &Solver, plate: SurfaceId| {
        let lightmap = solver.light().lightmaps().next().expect("a lightmap");
        lightmap.layout.surface(plate).is_some()
    };
    let mut tracer = tracer();
    let mut gather_until = |solver: &mut Solver, plate: SurfaceId, scene: &Arc<Snapshot>| {
        for pass in 0..50 {
            let turn = Turn { previous: None, samples: 32, lumels: Some(1 << 18), pass };
            let Request { job, asked } = solver.job(field, scene, turn).expect("a job");
            let ticket = tracer.submit(job);
            solver.take(&asked, &tracer.wait(ticket).expect("light"));
            solver.follow(scene);
            if has(solver, plate) {
                return pass;
            }
            solver.solve(FitEffort { rounds: 1, steps: 1 });
        }
        panic!("the plate has no lumels after 50 jobs");
    };
    solver.follow(&room(Vec3::Z, true, 5.0).0);
    assert!(!has(&solver, plates[0]));
    let (carried, _) = room(Vec3::Z, true, 8.0);
    solver.follow(&carried);
    let jobs = gather_until(&mut solver, plates[0], &carried);
    assert!(jobs > 0, "what one job has gathered is not solved yet");

    solver.extend_lightmap(&carried, &newcomers, placed);
    assert!(!has(&solver, plates[0]), "its lumels are where it was");
    let (later, _) = room(Vec3::Z, true, 11.0);
    solver.follow(&later);
    for plate in plates {
        gather_until(&mut solver, plate, &later);
    }
}

/// A lamp that moves changes the light of cells by less than the noise of their lumels: it is followed
/// by a few samples a lumel, and what was known of light's pattern stays.
#[test]
fn a_lamp_that_moves_is_followed() {
    let mut scene = Scene::builtin("cornell").expect("a built-in scene");
    let before = scene.snapshot();
    let lamp = scene.nodes().find(|node| node.light.is_some()).expect("a lamp").id;
    let transform =
        Transform { translation: Some(Vec3::new(0.5, 1.5, 0.3)), ..Transform::default() };
    scene.apply(&Edit::MoveNode { node: lamp, transform }).expect("an edit");
    let after = scene.snapshot();
    let fronts = sheets(&before, None, &|_| true).expect("charts").sheets;
    let laid_out = laid_out(&fronts, LightmapSpec::Size(128)).expect("a layout");
    let mut tracer = tracer();
    let mut gathered = |job: Job| {
        let ticket = tracer.submit(Job { bounces: 2, ..job });
        tracer.wait(ticket).expect("light")
    };
    let mut converged = |scene: &Arc<Snapshot>| {
        let mut solver = LightmapSolver::new(FieldId(0), scene, &laid_out, MEAN);
        let job = Job { seed: 77, ..solver.job(scene.clone(), 512) };
        let budgets = job.budgets.clone();
        solver.take(&gathered(job), &budgets);
        let mut lightmap = solver.dark();
        solver.solve(true, &Light::default(), &mut lightmap);
        lightmap
    };
    let right = converged(&after);
    let mut solver = LightmapSolver::new(FieldId(0), &before, &laid_out, BlendSettings::default());
    let lumels = solver.lumel_count() as u64;
    let mut lightmap = solver.dark();
    let mut live = |solver: &mut LightmapSolver, scene: &Arc<Snapshot>, each: u64| {
        let mut spent = 0;
        while spent < each * lumels {
            let (job, budgets) = solver.next_job(scene.clone(), lumels / 4);
            spent += job.samples();
            solver.take(&gathered(Job { seed: spent, ..job }), &budgets);
            solver.solve(true, &Light::default(), &mut lightmap);
        }
        let read = |lightmap: &Lightmap| irradiances(scene, lightmap, 2000);
        let (read, right) = (read(&lightmap), read(&right));
        let off: f32 = read.iter().zip(&right).map(|(a, b)| (*a - *b).abs().element_sum()).sum();
        off / right.iter().map(|e| e.element_sum()).sum::<f32>()
    };
    let moved = live(&mut solver, &before, 200);
    solver.expect_change();
    let soon = live(&mut solver, &after, 2);
    let later = live(&mut solver, &after, 16);
    assert!(moved > 0.08, "{moved}");
    assert!(soon < 0.65 * moved && later < 0.4 * moved, "{moved}, {soon}, {later}");
}
