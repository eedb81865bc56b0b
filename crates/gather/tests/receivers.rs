//! What jobs may ask for beside the radiance of probes: irradiance of lumels, distances, and light
//! from before. Against closed forms, each of which must refuse a wrong answer.

use std::f32::consts::PI;
use std::sync::Arc;

use glam::{Quat, UVec2, UVec3, Vec2, Vec3};
use lumencast_gather::path_trace::{CpuPathTracer, Options};
use lumencast_gather::{Budget, Draws, Gather, Job, Receiver, Shading, Sums, SumsAt};
use lumencast_light::{
    ChartVertex, Charts, Field, FieldId, Grid, Layout, Light, Lightmap, Order, Place, ProbeVolume,
    Rectangle, Surface, SurfaceId, slope_by,
};
use lumencast_scene::{Environment, LightKind, Material, PunctualLight, Snapshot};
use lumencast_testkit::scenes::{Stage, lambert};

const BLACK: Vec3 = Vec3::ZERO;
/// ∫ Y₀₀ dω = 2√π.
const C0: f32 = 3.544_907_7;
const Y1: f32 = 0.488_602_5;

fn gather(job: Job) -> Sums {
    let mut tracer = CpuPathTracer::new(Options::default()).unwrap();
    let ticket = tracer.submit(job);
    tracer.wait(ticket).unwrap().sums
}

fn lumel(position: Vec3, normal: Vec3, footprint: [Vec3; 2]) -> Receiver {
    Receiver::Lumel { position, normal, footprint, shading: Shading::Own }
}

/// Irradiance of a lumel whose light comes straight from sources.
fn irradiance(scene: &Arc<Snapshot>, lumel: Receiver) -> f32 {
    let sums = gather(Job { bounces: 0, ..Job::new(scene.clone(), [lumel], 1 << 16) });
    let sums = sums.at(0);
    assert_eq!((sums.sum.len(), sums.squares.len(), sums.count), (1, 1, 1 << 16));
    assert_eq!(sums.dark_back_fraction, 0.0);
    sums.sum[0].x / sums.count as f32
}

#[track_caller]
fn check(found: f32, expected: f32, wrong: f32, tolerance: f32) {
    let near = |value: f32| (found - value).abs() <= tolerance * value.abs();
    assert!(near(expected), "{found}, expected {expected}");
    assert!(!near(wrong), "this check cannot fail: it takes {wrong} too");
}

/// Receivers with few samples are traced together: what each gets does not depend on who comes after
/// it, and all get what they asked for.
#[test]
fn neighbours_change_nothing() {
    let mut stage = Stage::default();
    let grey = stage.material(lambert(Vec3::splat(0.5), Vec3::ONE));
    stage.room(BLACK, Vec3::new(2.0, 3.0, 4.0), grey);
    stage.light(lamp(0.1, 10.0), Vec3::Y, Vec3::NEG_Y);
    let scene = stage.snapshot();
    let receiver = |i: u8| {
        let position = Vec3::new(0.03 * f32::from(i) - 0.9, 0.1, 0.0);
        let lumel = Receiver::point(position, Vec3::Y);
        if i.is_multiple_of(3) { Receiver::probe(position) } else { lumel }
    };
    let counts = [1, 5, 0, 63, 1, 64, 2, 130, 0, 7, 1, 1, 300, 3];
    let receivers: Arc<[Receiver]> = (0..counts.len() as u8).map(receiver).collect();
    let budgets: Vec<Budget> = (0..)
        .zip(counts)
        .map(|(receiver, samples)| Budget { receiver, samples, draws: Draws::Own })
        .collect();
    let job = |budgets: &[Budget]| {
        let job = Job::with_budgets(scene.clone(), receivers.clone(), budgets.to_vec());
        Job { surfaces: true, ..job }
    };
    let all = gather(job(&budgets));
    for (n, own) in all.iter().enumerate() {
        assert_eq!((own.count, own.surfaces.len()), (counts[n], counts[n] as usize));
        assert_eq!(gather(job(&budgets[..=n])).at(n), own, "receiver {n}");
    }
    let lit = all.iter().filter(|sums| sums.sum.iter().any(|c| c.x > 0.0)).count();
    assert_eq!(lit, counts.iter().filter(|n| **n > 0).count());
}

/// π, whichever way a lumel faces; a surface that it lies on takes nothing away, near the origin or
/// far from it, large or small.
#[test]
fn lumels_under_a_constant_sky() {
    for position in [BLACK, Vec3::new(1234.5, -67.8, 9e3)] {
        for normal in [Vec3::Y, Vec3::new(0.3, -0.8, 0.1).normalize()] {
            for size in [0.0, 0.01, 1.0] {
                let (u, v) = normal.any_orthonormal_pair();
                let mut stage = Stage::default();
                stage.environment(Environment::Constant { radiance: Vec3::ONE });
                let black = Material { double_sided: true, ..lambert(BLACK, BLACK) };
                let black = stage.material(black);
                stage.quad(position - 50.0 * (u + v), 100.0 * u, 100.0 * v, black);
                let lumel = lumel(position, normal, [size * u, size * v]);
                check(irradiance(&stage.snapshot(), lumel), PI, 2.0 * PI, 1e-5);
            }
        }
    }
}

/// A lamp of a hand's breadth, which one direction in some thousands meets: receivers reach for it, so
/// that few samples tell its light.
#[test]
fn small_lamps_are_reached_for() {
    let (size, height, radiance) = (0.05, 2.0, 1000.0);
    let mut stage = Stage::default();
    let lamp = stage.material(lambert(BLACK, Vec3::splat(radiance)));
    let corner = Vec3::new(-0.5 * size, height, -0.5 * size);
    stage.quad(corner, Vec3::X * size, Vec3::Z * size, lamp);
    // Hides the lamp from the second half of the receivers.
    let black = stage.material(Material { double_sided: true, ..lambert(BLACK, BLACK) });
    stage.quad(Vec3::new(3.0, 1.0, -5.0), Vec3::Z * 10.0, Vec3::X * 10.0, black);
    let at = |n: u32| Vec3::new(if n < 8 { 0.1 * n as f32 } else { 15.0 }, 0.0, 0.0);
    let samples = 64;
    let lumel = |position| Receiver::point(position, Vec3::Y);
    let pairs = (0..16).flat_map(|n| [lumel(at(n)), Receiver::probe(at(n))]);
    let receivers: Vec<_> = pairs.collect();
    let sums = gather(Job { bounces: 0, ..Job::new(stage.snapshot(), receivers, samples) });
    let sums: Vec<SumsAt<'_>> = sums.iter().collect();
    for (n, pair) in (0..16).zip(sums.chunks_exact(2)) {
        let to = Vec3::new(0.0, height, 0.0) - at(n);
        let cosine = to.normalize().y;
        // Small enough to be a point: L A cos θ/d² of solid angle.
        let intensity = radiance * size * size * cosine / to.length_squared();
        let [lumel, c0] = [0, 1].map(|k| pair[k].sum[0].x / samples as f32);
        if n < 8 {
            check(lumel, intensity * cosine, 1.2 * intensity, 0.03);
            check(c0, intensity * 0.282_095, intensity, 0.03);
        } else {
            assert_eq!((lumel, c0), (0.0, 0.0), "{n}");
        }
    }
}

/// Irradiance of unit radiance from a rectangle, of which one corner lies straight above: `a` and `b`
/// are its sides over its height, as are their signs.
fn corner(a: f32, b: f32) -> f32 {
    let part = |a: f32, b: f32| {
        let root = (1.0 + a * a).sqrt();
        a / root * (b / root).atan()
    };
    0.5 * (part(a, b) + part(b, a))
}

/// A rectangle of light above a floor, from a point, and over all of a footprint.
#[test]
fn lumels_under_a_rectangle_of_light() {
    let (half, height) = (0.3, 0.5);
    let mut stage = Stage::default();
    let lamp = stage.material(lambert(BLACK, Vec3::ONE));
    let side = 2.0 * half;
    stage.quad(Vec3::new(-half, height, -half), Vec3::X * side, Vec3::Z * side, lamp);
    let scene = stage.snapshot();
    let at = |x: f32, z: f32| {
        let ends = |p: f32| [(half - p) / height, (half + p) / height];
        let corners = ends(x).map(|a| ends(z).map(|b| corner(a, b)));
        corners.iter().flatten().sum::<f32>()
    };
    let place = Vec3::new(0.25, 0.0, 0.1);
    let point = at(place.x, place.z);
    check(irradiance(&scene, lumel(place, Vec3::Y, [BLACK; 2])), point, 1.02 * point, 3e-3);

    let footprint = [Vec3::new(1.0, 0.0, 0.4), Vec3::new(0.0, 0.0, 0.8)];
    let steps = || (0..200).map(|i| (i as f32 + 0.5) / 200.0 - 0.5);
    let mean = steps().flat_map(|u| {
        steps().map(move |v| place + u * footprint[0] + v * footprint[1]).map(|p| at(p.x, p.z))
    });
    let mean = mean.sum::<f32>() / 4e4;
    check(irradiance(&scene, lumel(place, Vec3::Y, footprint)), mean, point, 1e-2);
}

/// A low rectangle of light beside a point, and a sky over it: irradiance on the surface's normal, its
/// slope, and irradiance on tilted normals.
#[test]
fn lumels_of_tilted_normals() {
    let (corner, along, up) = (Vec3::new(0.8, 0.05, -0.5), Vec3::Z, Vec3::new(0.2, 0.6, 0.0));
    let facing = along.cross(up).normalize();
    let mut stage = Stage::default();
    let lamp = stage.material(lambert(BLACK, Vec3::ONE));
    stage.quad(corner, along, up, lamp);
    let of_lamp = stage.snapshot();
    let mut stage = Stage::default();
    stage.environment(Environment::Constant { radiance: Vec3::ONE });
    let of_sky = stage.snapshot();
    let steps = || (0..400).map(|i| (i as f32 + 0.5) / 400.0);
    let integral = |of: &dyn Fn(Vec3) -> Vec3| -> Vec3 {
        let parts = steps().flat_map(|u| steps().map(move |v| corner + u * along + v * up));
        let area = along.cross(up).length() / 160_000.0;
        parts
            .map(|at| {
                let to = at.normalize();
                area * facing.dot(-to).max(0.0) / at.length_squared() * of(to)
            })
            .sum()
    };
    let gathered = |scene: &Arc<Snapshot>, shading| -> Vec<Vec3> {
        let point = Receiver::point_shaded(BLACK, Vec3::Y, shading);
        let job = Job { bounces: 0, ..Job::new(scene.clone(), [point], 1 << 17) };
        gather(job).at(0).mean().collect()
    };
    let own = integral(&|to| Vec3::splat(to.y)).x;
    let slope = integral(&|to| slope_by(to, Vec3::Y));
    let found = gathered(&of_lamp, Shading::Tilted);
    assert_eq!(found.len(), 4);
    check(found[0].x, own, slope.x, 3e-3);
    check(found[1].x, slope.x, own, 3e-3);
    check(found[2].x, slope.y, own, 2e-2);
    assert!(found[3].x.abs() < 3e-3 * slope.x, "{}", found[3].x);
    let [irradiance, x, y, z] = gathered(&of_sky, Shading::Tilted)[..] else { panic!() };
    check(irradiance.x, PI, 2.0 * PI, 3e-3);
    check(y.x, 0.5 * PI, PI, 5e-3);
    assert!(x.x.abs() < 1e-2 && z.x.abs() < 1e-2, "{x} {z}");
    for tilt in [0.5f32, -0.5] {
        let shading = Vec3::new(tilt.sin(), tilt.cos(), 0.0);
        let right = integral(&|to| Vec3::splat(shading.dot(to).max(0.0))).x;
        check(gathered(&of_lamp, Shading::By(shading))[0].x, right, own, 5e-3);
        let right = 0.5 * PI * (1.0 + tilt.cos());
        check(gathered(&of_sky, Shading::By(shading))[0].x, right, PI, 5e-3);
    }
}

/// Above an endless plane at height h, distances counted up to D: below they are h/cos θ.
#[test]
fn distances_have_their_moments() {
    let (h, far) = (2.0f32, 10.0f32);
    let mut stage = Stage::default();
    let floor = stage.material(lambert(Vec3::ONE, BLACK));
    stage.quad(Vec3::new(-50.0, 0.0, 50.0), Vec3::X * 100.0, Vec3::NEG_Z * 100.0, floor);
    let probe = Receiver::probe(Vec3::Y * h);
    let lumel = lumel(Vec3::Y * h, Vec3::NEG_Y, [BLACK; 2]);
    let job = Job { bounces: 0, ..Job::new(stage.snapshot(), [probe, lumel], 1 << 16) };
    assert!(gather(job.clone()).at(0).distances.is_empty(), "nobody asked");
    let sums = gather(Job { distances: Some(far), ..job });
    let sums: Vec<SumsAt<'_>> = sums.iter().collect();
    let mean = |receiver: usize, k: usize, moment: usize| {
        sums[receiver].distances[k][moment] / sums[receiver].count as f32
    };
    assert_eq!((sums[0].distances.len(), sums[1].distances.len()), (9, 1));
    // ∫ min(h/μ, D)ⁿ μᵏ dμ from 0 to 1, by n and k.
    let (d1, d1_mu) = (h + h * (far / h).ln(), h - h * h / (2.0 * far));
    let (d2, d2_mu) = (2.0 * h * far - h * h, h * h * (0.5 + (far / h).ln()));
    let y0 = C0 / (4.0 * PI);
    check(mean(0, 0, 0), 2.0 * PI * y0 * (far + d1), C0 * d1, 2e-3);
    check(mean(0, 0, 1), 2.0 * PI * y0 * (far * far + d2), C0 * d2, 2e-3);
    check(mean(0, 1, 0), 2.0 * PI * Y1 * (0.5 * far - d1_mu), 2.0 * PI * Y1 * d1_mu, 2e-3);
    check(mean(1, 0, 0), 2.0 * PI * d1_mu, 2.0 * PI * d1, 3e-3);
    check(mean(1, 0, 1), 2.0 * PI * d2_mu, 2.0 * PI * d2, 3e-3);
}

/// Eight probes in a box about the origin.
fn grid(size: Vec3) -> Grid {
    Grid { center: BLACK, rotation: Quat::IDENTITY, size, resolution: UVec3::splat(2) }
}

/// What a job found for the probes of a [`grid`].
fn field<'a>(size: Vec3, sums: impl Iterator<Item = SumsAt<'a>>) -> Arc<Light> {
    let mut volume = ProbeVolume::dark(FieldId(0), grid(size), Order::L2);
    for (i, sums) in sums.enumerate() {
        for (c, mean) in volume.probe_mut(i).iter_mut().zip(sums.mean()) {
            *c = mean;
        }
    }
    Arc::new(Light::new(vec![volume]))
}

/// The same radiance everywhere.
fn uniform(radiance: f32) -> Arc<Light> {
    let mut sum = [BLACK; 9];
    sum[0] = Vec3::splat(C0 * radiance);
    let sums = SumsAt { sum: &sum, count: 1, ..SumsAt::default() };
    field(Vec3::ONE, std::iter::repeat_n(sums, 8))
}

fn lamp(radius: f32, intensity: f32) -> PunctualLight {
    PunctualLight { kind: LightKind::Point { radius }, color: Vec3::ONE, intensity, range: None }
}

/// In a closed room each job adds a bounce to the last one's light, whether it begins at the walls or
/// at a lamp: in the end 1/(1 − ρ) of what was there first.
#[test]
fn bounces_add_up_from_job_to_job() {
    let (albedo, radius, size) = (0.7, 2.0, Vec3::splat(2.0));
    for emission in [1.0, 0.0] {
        let mut stage = Stage::default();
        let wall = stage.material(lambert(Vec3::splat(albedo), Vec3::splat(emission)));
        stage.sphere(BLACK, -radius, 64, wall);
        let intensity = 3.0 * (1.0 - emission);
        stage.light(lamp(0.0, intensity), BLACK, Vec3::X);
        let first = emission + albedo * intensity / (PI * radius * radius);
        let probes: Arc<[_]> = grid(size).positions().map(Receiver::probe).collect();
        let light = (0..30).fold(uniform(0.0), |before, seed| {
            let job = Job { bounces: 0, seed, ..Job::new(stage.snapshot(), probes.clone(), 256) };
            field(size, gather(Job { previous: Some(before), ..job }).iter())
        });
        let found = light.sample(&Place::in_space(BLACK)).unwrap().coefficients[0].x;
        check(found, C0 * first / (1.0 - albedo), C0 * first * (1.0 + albedo), 5e-3);
    }
}

/// White and smooth surfaces in a field of 1 under a sky of 1 cannot be seen, and those that the field
/// lights alone reflect nothing but it.
#[test]
fn the_last_surface_reflects_the_light_from_before() {
    let smooth = Material { metallic: 0.0, roughness: 0.0, ..Material::default() };
    for material in
        [lambert(Vec3::ONE, BLACK), smooth.clone(), Material { transmission: 1.0, ..smooth }]
    {
        let mut stage = Stage::default();
        stage.environment(Environment::Constant { radiance: Vec3::ONE });
        let material = stage.material(material);
        stage.quad(Vec3::new(-50.0, 0.0, 50.0), Vec3::X * 100.0, Vec3::NEG_Z * 100.0, material);
        let at = Receiver::probe(Vec3::Y);
        let seen = |radiance| {
            let previous = Some(uniform(radiance));
            let job = Job { bounces: 0, previous, ..Job::new(stage.snapshot(), [at], 4096) };
            gather(job).at(0).mean().next().unwrap().x
        };
        check(seen(1.0), C0, seen(0.9), 3e-3);
    }
}

/// A surface that has lumels reflects their light, and no other.
#[test]
fn the_last_surface_reflects_the_light_of_its_lumels() {
    let albedo = 0.6;
    let mut stage = Stage::default();
    let white = stage.material(lambert(Vec3::splat(albedo), BLACK));
    stage.quad(Vec3::new(-2e3, 0.0, 2e3), Vec3::X * 4e3, Vec3::NEG_Z * 4e3, white);
    let scene = stage.snapshot();
    let floor = &scene.instances[0];
    let primitive = &floor.mesh.primitives[0];
    let vertex = |source: u32| ChartVertex {
        source,
        rectangle: 0,
        at: Vec2::new(1.0 + 6.0 * (source % 2) as f32, 1.0 + 6.0 * (source / 2) as f32),
    };
    let charts = Charts {
        sizes: vec![UVec2::splat(8)],
        vertices: (0..primitive.vertices.positions.len() as u32).map(vertex).collect(),
        triangles: primitive.triangles.clone(),
    };
    let reflected = |back: bool, irradiance: f32| {
        let surface = Surface {
            id: SurfaceId { node: floor.node.0, back, ..SurfaceId::default() },
            charts: Arc::new(charts.clone()),
            rectangles: vec![Rectangle::default()],
        };
        let mut lumels = Lightmap::dark(FieldId(3), Arc::new(Layout::new(8, 1, vec![surface])));
        lumels.irradiance.fill(Vec3::splat(irradiance));
        let previous = Some(Arc::new(Light::new([Field::Lightmap(lumels)])));
        let at = Receiver::probe(Vec3::Y);
        let job = Job { bounces: 0, previous, ..Job::new(scene.clone(), [at], 4096) };
        gather(job).at(0).mean().next().unwrap().x
    };
    // The floor fills half of all directions.
    let expected = 0.5 * C0 * albedo * 7.0 / PI;
    check(reflected(false, 7.0), expected, reflected(false, 6.0), 5e-3);
    check(reflected(false, 7.0), expected, reflected(true, 7.0), 5e-3);
}

/// A lamp with a size lights the last surface as it lights those before: ρI cos³θ/πh² under it.
#[test]
fn the_last_surface_is_lit_by_lamps_with_a_size() {
    let (albedo, height, intensity) = (0.6, 0.7, 50.0);
    let mut stage = Stage::default();
    let floor = stage.material(lambert(Vec3::splat(albedo), BLACK));
    stage.quad(Vec3::new(-2e3, 0.0, 2e3), Vec3::X * 4e3, Vec3::NEG_Z * 4e3, floor);
    stage.light(lamp(0.6, intensity), Vec3::Y * height, Vec3::X);
    let previous = Some(uniform(0.0));
    let at = Receiver::probe(Vec3::Y * height);
    let job = Job { bounces: 0, previous, ..Job::new(stage.snapshot(), [at], 1 << 15) };
    let found = gather(job).at(0).mean().next().unwrap().x;
    let peak = albedo * intensity / (PI * height * height);
    // ∫ cos³θ dω = 2π/4.
    let expected = C0 / (4.0 * PI) * peak * 0.5 * PI;
    check(found, expected, 0.95 * expected, 1e-2);
}
