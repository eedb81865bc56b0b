mod in_surfaces;
mod sized_lights;

use std::f32::consts::PI;
use std::sync::Arc;

use glam::{Vec2, Vec3};
use lumencast_light::Order;
use lumencast_scene::{Environment, HdrImage, LightKind, Material, PunctualLight, Scene, Snapshot};
use lumencast_testkit::scenes::{Stage, lambert};

use super::group::LOST;
use super::integrator::Integrator;
use super::paths::{Look, Paths};
use super::*;
use crate::sampling::{Sampler, luminance};
use crate::{Budget, Draws, Receiver};

const BLACK: Vec3 = Vec3::ZERO;

/// Mean radiance along one ray and its standard error, over independent groups of samples.
fn look(scene: &Arc<Snapshot>, origin: Vec3, direction: Vec3, paths: Paths<'_>) -> (Vec3, Vec3) {
    let world = World::new(
        scene.clone(),
        MaterialModel::Full,
        Kernel::detect(),
        &mut WorldCache::default(),
    );
    let mut integrator = Integrator::new(&world, paths);
    let (groups, samples) = (32, 512);
    let means: Vec<Vec3> = (0..groups)
        .map(|group| {
            let look = |s| Look {
                origin,
                direction,
                pdf: f32::INFINITY,
                sampler: Sampler::new(4, group, s),
            };
            let seen = integrator.radiance((0..samples).map(look));
            seen.map(|seen| seen.radiance()).sum::<Vec3>() / samples as f32
        })
        .collect();
    let mean = means.iter().sum::<Vec3>() / groups as f32;
    let variance =
        means.iter().map(|m| (m - mean) * (m - mean)).sum::<Vec3>() / (groups - 1) as f32;
    (mean, (variance / groups as f32).map(f32::sqrt))
}

#[track_caller]
fn check((mean, error): (Vec3, Vec3), expected: Vec3, wrong: Vec3) {
    let tolerance = 5.0 * error + 2e-4 * expected.max_element();
    assert!(
        (mean - expected).abs().cmple(tolerance).all(),
        "{mean} ± {error}, expected {expected}"
    );
    assert!(
        !(mean - wrong).abs().cmple(tolerance).all(),
        "this check takes {wrong} too: ± {error}"
    );
}

fn down() -> Vec3 {
    Vec3::new(0.3, -1.0, 0.2).normalize()
}

/// Adds a plane at y = 0 below the ray from (0, 1, 0) along `down`; returns the point where the ray
/// meets it.
fn floor(stage: &mut Stage, material: Material) -> Vec3 {
    let material = stage.material(material);
    stage.quad(Vec3::new(-50.0, 0.0, 50.0), Vec3::X * 100.0, Vec3::NEG_Z * 100.0, material);
    Vec3::new(0.3, 0.0, 0.2)
}

fn look_down(stage: &Stage, bounces: u32) -> (Vec3, Vec3) {
    look(&stage.snapshot(), Vec3::Y, down(), Paths::new(bounces))
}

/// Form factor from a point to a rectangle parallel to its surface with one corner above it
/// (Howell, configuration C-11).
fn corner_form_factor(x: f32, y: f32) -> f32 {
    let part = |x: f32, y: f32| x / (1.0 + x * x).sqrt() * (y / (1.0 + x * x).sqrt()).atan();
    (part(x, y) + part(y, x)) / (2.0 * PI)
}

#[test]
fn rectangle_over_a_lambert_plane() {
    let (albedo, emission) = (Vec3::new(0.8, 0.5, 0.2), Vec3::new(3.0, 2.0, 1.0));
    let (a, b, height) = (0.4, 0.7, 0.5);
    // The lamp is above the ray's start, so the ray does not meet it.
    let mut stage = Stage::default();
    let at = floor(&mut stage, lambert(albedo, BLACK)) + (1.0 + height) * Vec3::Y;
    let lamp = stage.material(lambert(BLACK, emission));
    stage.quad(at - Vec3::new(a, 0.0, b), 2.0 * a * Vec3::X, 2.0 * b * Vec3::Z, lamp);
    let form = 4.0 * corner_form_factor(a / (1.0 + height), b / (1.0 + height));
    let expected = albedo * emission * form;
    let solid = 4.0 * a * b / (1.0 + height).powi(2) / PI;
    check(look_down(&stage, 1), expected, albedo * emission * solid);
}

/// A black panel of many triangles with one bright texel: L cos θ cos θ' A/πd². The texel lies
/// where samples at the centre and near the corners of its triangle miss it.
#[test]
fn bright_texel_of_a_panel() {
    use lumencast_scene::{Filter, Image, Primitive, TextureRef, Vertices};
    let (side, cells, height) = (64u32, 16u32, 2.0);
    let mut texels = vec![[0, 0, 0, 255]; (side * side) as usize];
    texels[(5 * side + 51) as usize] = [255; 4];
    let image = Image { name: String::new(), width: side, height: side, texels };
    let texture = TextureRef {
        image: Arc::new(image),
        tex_coord: 0,
        texture_from_mesh: glam::Affine2::IDENTITY,
        wrap: Default::default(),
        filter: Filter::Nearest,
    };
    let mut stage = Stage::default();
    let at = floor(&mut stage, lambert(Vec3::ONE, BLACK));
    let panel = lambert(BLACK, Vec3::splat(4000.0));
    let material = stage.material(Material { emissive_texture: Some(texture), ..panel });
    let corner = at + Vec3::new(-1.0, height, -1.0);
    let nodes =
        || (0..=cells).flat_map(|z| (0..=cells).map(move |x| Vec2::new(x as f32, z as f32)));
    let uv: Vec<Vec2> = nodes().map(|node| node / cells as f32).collect();
    let positions = uv.iter().map(|p| corner + 2.0 * Vec3::new(p.x, 0.0, p.y)).collect();
    let normals = vec![Vec3::NEG_Y; uv.len()];
    let row = cells + 1;
    let first = (0..cells).flat_map(|z| (0..cells).map(move |x| z * row + x));
    let triangles = first.flat_map(|i| [[i, i + 1, i + row + 1], [i, i + row + 1, i + row]]);
    let primitive = Primitive {
        triangles: triangles.collect(),
        vertices: Vertices { positions, normals, tangents: Vec::new() },
        uv: [uv, Vec::new()],
        material,
        ..Primitive::default()
    };
    stage.primitive(primitive, glam::Affine3A::IDENTITY);
    let texel = 2.0 / side as f32;
    let d = corner + Vec3::new(51.5 * texel, 0.0, 5.5 * texel) - at;
    let cos = d.normalize().y;
    let expected = 4000.0 / PI * cos * cos * texel * texel / d.length_squared();
    check(look_down(&stage, 1), Vec3::splat(expected), Vec3::splat(1.2 * expected));
}

#[test]
fn point_light_falls_by_cosine_and_square() {
    let albedo = Vec3::splat(0.5);
    let mut stage = Stage::default();
    let at = floor(&mut stage, lambert(albedo, BLACK));
    let light = PunctualLight {
        kind: LightKind::Point { radius: 0.0 },
        color: Vec3::ONE,
        intensity: 20.0,
        range: None,
    };
    let place = Vec3::new(1.5, 2.0, -0.5);
    stage.light(light, place, Vec3::X);
    let d = place - at;
    let without_cosine = albedo / PI * 20.0 / d.length_squared();
    check(look_down(&stage, 1), without_cosine * d.normalize().y, without_cosine);
}

/// Rough and smooth metals and dielectrics in a closed emitting room, direct light only. BSDF
/// sampling, next-event estimation and both together must agree. A room is the hardest case for the
/// weights, since both ways find every direction.
#[test]
fn both_ways_of_finding_light_together_count_once() {
    for (metallic, roughness) in [(1.0, 0.1), (1.0, 0.6), (0.0, 0.4)] {
        let glossy = Material { metallic, roughness, double_sided: true, ..Material::default() };
        let emission = Vec3::splat(2.0);
        let mut room = Stage::default();
        floor(&mut room, glossy.clone());
        let walls = room.material(lambert(BLACK, emission));
        room.room(Vec3::new(0.0, 45.0, 0.0), Vec3::splat(98.0), walls);
        // A constant environment gives the same light, and only BSDF sampling finds it.
        let mut open = Stage::default();
        floor(&mut open, glossy.clone());
        open.environment(Environment::Constant { radiance: emission });
        let (expected, error) = look_down(&open, 1);
        let (mean, e) = look_down(&room, 1);
        let tolerance = 5.0 * (e * e + error * error).map(f32::sqrt) + 2e-3 * expected;
        assert!(
            (mean - expected).abs().cmple(tolerance).all(),
            "{metallic} {roughness}: {mean} ± {e}, {expected} ± {error}"
        );
        assert!((mean - 1.1 * expected).abs().cmpgt(tolerance).all(), "too coarse a check");
    }
}

/// An environment picture of a sun in a dim sky over a Lambert surface: ∫ L cos dω/π by quadrature.
#[test]
fn picture_of_a_sun_over_a_lambert_plane() {
    let (width, height) = (64u32, 32u32);
    let mut texels = vec![Vec3::splat(0.1); (width * height) as usize];
    texels[(6 * width + 40) as usize] = Vec3::splat(3000.0);
    let mut irradiance = 0.0;
    for (k, t) in texels.iter().enumerate().take((width * height / 2) as usize) {
        let (top, bottom) = (k as u32 / width, k as u32 / width + 1);
        let sin2 = |row: u32| (PI * row as f32 / height as f32).sin().powi(2);
        // ∫ cos θ sin θ dθ dφ over the texel.
        irradiance += t.x * (sin2(bottom) - sin2(top)) / 2.0 * 2.0 * PI / width as f32;
    }
    let image = Some(Arc::new(HdrImage { width, height, texels }));
    let mut stage = Stage::default();
    floor(&mut stage, lambert(Vec3::splat(0.7), BLACK));
    stage.environment(Environment::Image {
        uri: String::new(),
        intensity: 1.0,
        rotation: 0.3,
        image,
    });
    let expected = Vec3::splat(0.7 * irradiance / PI);
    check(look_down(&stage, 1), expected, 1.02 * expected);
}

/// The clamp leaves direct light alone: emission, and for a camera also punctual light scattered
/// once.
#[test]
fn clamp_holds_scattered_light_and_leaves_the_rest() {
    let mut stage = Stage::default();
    floor(&mut stage, lambert(Vec3::ONE, Vec3::splat(100.0)));
    let sun = PunctualLight {
        kind: LightKind::Directional { angle: 0.0 },
        color: Vec3::ONE,
        intensity: 1e5,
        range: None,
    };
    stage.light(sun, BLACK, Vec3::NEG_Y);
    for (clamp_from, expected) in [(1, 107.0), (2, 100.0 + 1e5 / PI)] {
        let paths = Paths { clamp: 7.0, clamp_from, ..Paths::new(1) };
        let (mean, _) = look(&stage.snapshot(), Vec3::Y, down(), paths);
        let off = (mean - Vec3::splat(expected)).abs().max_element();
        assert!(off < 1e-5 * expected, "from {clamp_from}: {mean}");
    }
}

/// Thin glass shows what is behind it, without refraction.
#[test]
fn thin_glass_shows_what_is_behind() {
    let mut stage = Stage::default();
    let glass =
        Material { metallic: 0.0, roughness: 0.0, transmission: 1.0, ..Material::default() };
    floor(&mut stage, glass);
    let (sky, ground) = (Vec3::splat(1.0), Vec3::new(0.0, 3.0, 0.0));
    stage.environment(Environment::Sky { zenith: sky, horizon: ground, ground });
    let cos = -down().y;
    let fresnel = 0.04 + 0.96 * (1.0 - cos).powi(5);
    // The mirrored ray sees the gradient at sin(elevation) = cos.
    let expected = (1.0 - fresnel) * ground + fresnel * ground.lerp(sky, cos);
    check(look_down(&stage, 1), expected, ground);
}

/// Directions above the shading normal's horizon but below the triangle's carry no light.
#[test]
fn shading_normals_make_no_light() {
    use lumencast_scene::{Image, TextureRef};
    let slanted =
        Image { name: String::new(), width: 1, height: 1, texels: vec![[240, 128, 170, 255]] };
    let map = TextureRef {
        image: Arc::new(slanted),
        tex_coord: 0,
        texture_from_mesh: glam::Affine2::IDENTITY,
        wrap: Default::default(),
        filter: Default::default(),
    };
    let mut stage = Stage::default();
    floor(&mut stage, Material { normal_texture: Some(map), ..lambert(Vec3::ONE, BLACK) });
    stage.environment(Environment::Sky { zenith: BLACK, horizon: BLACK, ground: Vec3::splat(1e3) });
    let (mean, _) = look_down(&stage, 1);
    assert_eq!(mean, BLACK);
}

fn job(scene: &Arc<Snapshot>, seed: u64) -> Job {
    let probe = |k: u8| Receiver::probe(Vec3::new(0.1 * f32::from(k), 0.5, 0.0));
    let receivers: Vec<_> = (0..9).map(probe).collect();
    let budget = |receiver| Budget { receiver, samples: 1 + 40 * receiver, draws: Draws::Own };
    let job = Job::with_budgets(scene.clone(), receivers, (0..9).map(budget).collect());
    Job { order: Order::L3, bounces: 2, seed, ..job }
}

fn lit_room() -> Arc<Snapshot> {
    let mut stage = Stage::default();
    let wall = stage.material(Material {
        metallic: 0.3,
        roughness: 0.5,
        ..lambert(Vec3::splat(0.7), Vec3::splat(0.1))
    });
    stage.room(BLACK, Vec3::splat(4.0), wall).sphere(Vec3::new(0.0, -1.0, 0.0), 0.5, 12, wall);
    stage.light(lamp(0.0), Vec3::ONE, Vec3::X);
    stage.snapshot()
}

fn lamp(radius: f32) -> PunctualLight {
    PunctualLight {
        kind: LightKind::Point { radius },
        color: Vec3::ONE,
        intensity: 3.0,
        range: None,
    }
}

/// Paths are followed many at a time, and each finds what it finds alone.
#[test]
fn paths_do_not_depend_on_each_other() {
    let scene = lit_room();
    let world =
        World::new(scene, MaterialModel::Full, Kernel::detect(), &mut WorldCache::default());
    let paths = Paths { roulette_from: 2, ..Paths::new(4) };
    let look = |sample| {
        let mut sampler = Sampler::new(3, 0, sample);
        let direction = crate::sampling::sphere(sampler.square());
        Look { origin: Vec3::new(0.5, 0.2, 0.0), direction, pdf: f32::INFINITY, sampler }
    };
    let mut integrator = Integrator::new(&world, paths);
    let together: Vec<_> = integrator.radiance((0..100).map(look)).collect();
    let rays = integrator.rays;
    for (sample, seen) in (0..).zip(together) {
        let alone = Integrator::new(&world, paths).radiance([look(sample)]).next();
        assert_eq!(alone, Some(seen), "{sample}");
    }
    assert_eq!(integrator.radiance([]).len(), 0);
    assert_eq!(integrator.rays, rays, "nothing asked for, nothing done");
}

/// Light that is not finite counts as zero, to protect fields. Sound scenes lose no light this way.
#[test]
fn sound_scenes_lose_no_light() {
    let lost = |scene: Arc<Snapshot>, origin: Vec3| {
        let mut cache = WorldCache::default();
        let world = World::new(scene, MaterialModel::Full, Kernel::detect(), &mut cache);
        let mut integrator = Integrator::new(&world, Paths::new(4));
        let look = |sample| {
            let mut sampler = Sampler::new(9, 0, sample);
            let direction = crate::sampling::sphere(sampler.square());
            Look { origin, direction, pdf: f32::INFINITY, sampler }
        };
        LOST.set(0);
        let seen: Vec3 = integrator.radiance((0..4096).map(look)).map(|s| s.radiance()).sum();
        assert!(seen.is_finite() && seen.min_element() > 0.0, "{seen}");
        LOST.get()
    };
    for name in ["cornell", "door", "tomb"] {
        let mut scene = Scene::builtin(name).unwrap();
        let middle = scene.volumes()[0].grid.center;
        assert_eq!(lost(scene.snapshot(), middle), 0, "{name}");
    }
    assert_eq!(lost(every_material(), BLACK), 0);
    let mut stage = Stage::default();
    let material = stage.material(lambert(Vec3::splat(0.5), Vec3::new(f32::INFINITY, 1.0, 1.0)));
    let shines = stage.material(lambert(Vec3::splat(0.5), Vec3::ONE));
    stage.room(BLACK, Vec3::splat(4.0), shines).sphere(Vec3::ONE, 0.5, 12, material);
    assert!(lost(stage.snapshot(), BLACK) > 0, "nothing is counted");
}

/// A closed room with a ball of every material under every kind of light.
fn every_material() -> Arc<Snapshot> {
    let mut stage = Stage::default();
    let wall = stage.material(lambert(Vec3::splat(0.7), Vec3::ZERO));
    let glow = stage.material(lambert(Vec3::ZERO, Vec3::splat(3.0)));
    stage.room(BLACK, Vec3::splat(4.0), wall).sphere(Vec3::new(0.0, 1.5, 0.0), 0.1, 8, glow);
    let mut at = 0..;
    for roughness in [0.0, 1e-3, 0.3, 1.0] {
        for (metallic, transmission) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (0.5, 0.5)] {
            let material = stage.material(Material {
                metallic,
                roughness,
                transmission,
                ..Material::default()
            });
            let turn = at.next().unwrap_or(0) as f32 * std::f32::consts::TAU / 16.0;
            let middle = 1.5 * Vec3::new(turn.cos(), 0.4 * (2.0 * turn).sin(), turn.sin());
            stage.sphere(middle, 0.25, 12, material);
        }
    }
    stage.light(lamp(0.0), Vec3::ONE, Vec3::X);
    stage.light(lamp(0.05), Vec3::new(-1.0, 1.2, 0.3), Vec3::X);
    stage.snapshot()
}

fn tracer(threads: usize) -> CpuPathTracer {
    CpuPathTracer::new(Options { threads: NonZeroUsize::new(threads), ..Options::default() })
        .unwrap()
}

#[test]
fn results_do_not_depend_on_threads() {
    let scene = lit_room();
    let gather = |threads, seed| {
        let mut tracer = tracer(threads);
        let ticket = tracer.submit(job(&scene, seed));
        tracer.wait(ticket).unwrap().sums
    };
    let one = gather(1, 5);
    assert_eq!(one, gather(3, 5));
    assert_ne!(one, gather(3, 6));
    assert!(one.iter().zip(0..).all(|(s, k)| s.count == 1 + 40 * k && s.sum.len() == 16));
}

/// A receiver draws the same samples, whichever others a job has and in whatever order.
#[test]
fn a_subset_draws_the_samples_of_the_whole() {
    let whole = job(&lit_room(), 5);
    let gather = |budgets: Vec<Budget>| {
        let mut tracer = tracer(2);
        let ticket = tracer.submit(Job { budgets, ..whole.clone() });
        tracer.wait(ticket).unwrap().sums
    };
    let all = gather(whole.budgets.clone());
    let some: Vec<Budget> = [7, 2, 5].map(|receiver| whole.budgets[receiver]).into();
    let found = gather(some.clone());
    for (budget, found) in some.iter().zip(found.iter()) {
        assert_eq!(found, all.at(budget.receiver as usize));
    }
    let other = Budget { receiver: 7, ..whole.budgets[2] };
    assert_ne!(gather(vec![other]).at(0), found.at(1), "another place");
}

/// A budget that always draws the same does so in every job, at every index.
#[test]
fn the_same_draws_outlast_jobs() {
    let scene = lit_room();
    let place = Receiver::point(Vec3::new(0.3, 0.5, 0.0), Vec3::Y);
    let gather = |receivers: Vec<Receiver>, draws: Draws, seed: u64| {
        let last = receivers.len() as u32 - 1;
        let budgets = vec![Budget { receiver: last, samples: 100, draws }];
        let job = Job { seed, ..Job::with_budgets(scene.clone(), receivers, budgets) };
        let mut tracer = tracer(2);
        let ticket = tracer.submit(job);
        tracer.wait(ticket).unwrap().sums
    };
    let elsewhere = Receiver::probe(Vec3::ZERO);
    let same = |sequence, first| Draws::Same { sequence, first };
    let found = gather(vec![place], same(3, 0), 1);
    assert_eq!(found, gather(vec![elsewhere, place], same(3, 0), 2));
    assert_ne!(found, gather(vec![place], same(4, 0), 1), "another sequence");
    assert_ne!(found, gather(vec![place], same(3, 100), 1), "another part");
    assert_ne!(found, gather(vec![place], Draws::Own, 1), "the job's");
}

/// Parts of a shared sequence leave less noise in a mean over receivers than sequences of their own;
/// what a receiver finds alone is as noisy.
#[test]
fn receivers_that_share_a_sequence_are_sampled_well_together() {
    let scene = lit_room();
    let receivers = vec![Receiver::point(Vec3::new(0.3, 0.5, 0.0), Vec3::Y); 64];
    let samples = 4;
    let deviations = |shares: bool| {
        let budget = |receiver| {
            let draws = Draws::Shared { sequence: 5, first: samples * receiver };
            Budget { receiver, samples, draws: if shares { draws } else { Draws::Own } }
        };
        let budgets: Vec<Budget> = (0..64).map(budget).collect();
        let mut tracer = tracer(2);
        let mut found = Vec::new();
        for seed in 0..32 {
            let job = Job::with_budgets(scene.clone(), receivers.clone(), budgets.clone());
            let ticket = tracer.submit(Job { seed, bounces: 1, ..job });
            let sums = tracer.wait(ticket).unwrap().sums;
            found.push(sums.iter().map(|s| luminance(s.sum[0]) / s.count as f32).collect());
        }
        let alone = deviation(found.iter().map(|all: &Vec<f32>| all[7]));
        (alone, deviation(found.iter().map(|all| all.iter().sum::<f32>() / 64.0)))
    };
    let (own, shared) = (deviations(false), deviations(true));
    assert!(shared.1 < 0.5 * own.1, "{own:?}, {shared:?}");
    assert!((0.5..2.0).contains(&(shared.0 / own.0)), "{own:?}, {shared:?}");
}

/// Standard deviation.
fn deviation(values: impl Iterator<Item = f32> + Clone) -> f32 {
    let count = values.clone().count() as f32;
    let mean = values.clone().sum::<f32>() / count;
    (values.map(|value| (value - mean).powi(2)).sum::<f32>() / count).sqrt()
}

#[test]
fn jobs_run_beside_each_other_and_can_be_given_up() {
    let scene = lit_room();
    let mut tracer = tracer(2);
    let mut huge = job(&scene, 1);
    huge.budgets = vec![Budget { receiver: 0, samples: 20_000_000, draws: Draws::Own }];
    let endless = tracer.submit(huge.clone());
    let queued = tracer.submit(job(&scene, 2));
    let wanted = tracer.submit(job(&scene, 3));
    assert!(matches!(tracer.poll(endless), Progress::Working(share) if share < 1.0));
    tracer.cancel(queued);
    tracer.cancel(endless);
    assert!(tracer.wait(wanted).is_some());
    assert!(matches!(tracer.poll(wanted), Progress::Unknown), "a result is given once");
    assert!(matches!(tracer.poll(endless), Progress::Unknown));
    assert!(tracer.wait(queued).is_none());
    // Dropping the tracer must not wait for the rest of this job.
    tracer.submit(huge);
    drop(tracer);
}

#[test]
fn empty_jobs_end() {
    let mut tracer = tracer(1);
    let mut empty = job(&Stage::default().snapshot(), 1);
    empty.budgets.clear();
    let ticket = tracer.submit(empty);
    assert!(tracer.wait(ticket).unwrap().sums.is_empty());
}

#[test]
fn lambert_model_takes_only_base_colour() {
    let mut stage = Stage::default();
    let odd = Material {
        base_color: Vec3::splat(0.5).extend(0.1),
        metallic: 1.0,
        roughness: 0.1,
        alpha_mode: lumencast_scene::AlphaMode::Blend,
        ..Material::default()
    };
    floor(&mut stage, odd);
    stage.environment(Environment::Constant { radiance: Vec3::ONE });
    let model = MaterialModel::Lambert;
    let world = World::new(stage.snapshot(), model, Kernel::detect(), &mut WorldCache::default());
    let paths = Paths::new(1);
    let mut integrator = Integrator::new(&world, paths);
    for (origin, direction) in [(Vec3::Y, down()), (Vec3::NEG_Y, -down())] {
        let look =
            |s| Look { origin, direction, pdf: f32::INFINITY, sampler: Sampler::new(1, 1, s) };
        for seen in integrator.radiance((0..64).map(look)) {
            assert!((seen.radiance() - Vec3::splat(0.5)).abs().max_element() < 1e-5);
        }
    }
}
