//! Hits against Embree's. `LUMENCAST_EMBREE` names its library; without it the tests skip and say so,
//! as does the one on Sponza without the scene. `cargo xtask test` fetches the library.

use std::path::{Path, PathBuf};

use glam::{DVec3, Vec3};
use lumencast_gather::measure::{RayBench, TestRay};
use lumencast_gather::path_trace::{Levels, Options, Trees};
use lumencast_scene::{Scene, View};
use lumencast_testkit::embree::{Embree, Quality};

const RAYS: u32 = 1_000_000;

#[expect(clippy::print_stderr, reason = "a skipped test says so")]
fn library() -> Option<PathBuf> {
    let library = std::env::var_os("LUMENCAST_EMBREE").map(PathBuf::from);
    if library.is_none() {
        eprintln!("skipped: LUMENCAST_EMBREE is not set");
    }
    library
}

#[expect(clippy::print_stderr, reason = "a skipped test says so")]
fn sponza() -> Option<Scene> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let scenes =
        std::env::var_os("LUMENCAST_SCENES").map_or(root.join("../shared/scenes"), PathBuf::from);
    let path = scenes.join("sponza/Sponza.glb");
    if !path.exists() {
        eprintln!("skipped: {} is not here", path.display());
        return None;
    }
    Some(Scene::load(&path).unwrap())
}

/// A number in [0, 1) (splitmix64's finaliser).
fn random(i: u64) -> f32 {
    let x = i.wrapping_mul(0x9e37_79b9_7f4a_7c15);
    let x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((x ^ (x >> 31)) >> 40) as f32 / (1 << 24) as f32
}

fn random_ray(i: u64, min: Vec3, max: Vec3) -> TestRay {
    let [a, b, c, d, e] = [0, 1, 2, 3, 4].map(|k| random(5 * i + k));
    let z = 1.0 - 2.0 * d;
    let ring = (1.0 - z * z).max(0.0).sqrt() * glam::Vec2::from_angle(std::f32::consts::TAU * e);
    TestRay {
        origin: min + Vec3::new(a, b, c) * (max - min),
        direction: ring.extend(z),
        t_max: f32::INFINITY,
    }
}

/// Where a ray meets a triangle's plane, and the least of the three weights there, in f64.
fn exactly(triangle: [Vec3; 3], ray: &TestRay) -> (f64, f64) {
    let [a, b, c] = triangle.map(|corner| corner.as_dvec3());
    let (origin, direction) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
    let (u, v): (DVec3, DVec3) = (b - a, c - a);
    let p = direction.cross(v);
    let scale = 1.0 / u.dot(p);
    let s = origin - a;
    let q = s.cross(u);
    let (beta, gamma) = (scale * s.dot(p), scale * direction.dot(q));
    (scale * v.dot(q), beta.min(gamma).min(1.0 - beta - gamma))
}

#[test]
fn a_million_random_rays_agree_on_sponza() {
    let (Some(scene), Some(library)) = (sponza(), library()) else { return };
    agree_but_for_ties(scene, Levels::One, &library);
}

/// Many instances, some of them deformed.
#[test]
fn a_million_random_rays_agree_in_the_tomb() {
    let Some(library) = library() else { return };
    agree_but_for_ties(Scene::open("tomb").unwrap(), Levels::Two, &library);
}

#[test]
fn a_million_random_rays_agree_in_the_tomb_as_a_whole() {
    let Some(library) = library() else { return };
    agree_but_for_ties(Scene::open("tomb").unwrap(), Levels::One, &library);
}

fn agree_but_for_ties(mut scene: Scene, levels: Levels, library: &Path) {
    let bounds = scene.bounds();
    let view = View::look_at(bounds.min, bounds.max, 1.0).unwrap();
    let options = Options { levels, ..Options::default() };
    let bench = RayBench::new(&scene.snapshot(), view, 0, &options, Trees::Improved).unwrap();
    let triangles = bench.triangles();
    let rays: Vec<_> =
        (0..u64::from(RAYS)).map(|i| random_ray(i, bounds.min, bounds.max)).collect();
    let ours = bench.trace_closest(&rays);
    let any = bench.trace_any(&rays);
    let disagreements = |triangles: &[[Vec3; 3]]| {
        let embree = Embree::new(library, triangles, Quality::Medium, true, 2).unwrap();
        let mut wrong = 0;
        for ((ray, ours), any) in rays.iter().zip(&ours).zip(&any) {
            let theirs = embree.closest(ray.origin, ray.direction, ray.t_max);
            assert_eq!(ours.is_some(), *any, "closest and any agree: {ray:?}");
            let of = |triangle: u32| exactly(triangles[triangle as usize], ray);
            let same = match (ours, theirs) {
                (None, None) => true,
                (Some(a), Some(b)) => {
                    // Embree has corners rounded in the world, we rays rounded in object space; at
                    // large triangles met at a grazing angle that moves the hit along the ray.
                    let [p, q, r] = triangles[b.triangle as usize];
                    let extent = p.distance(q).max(p.distance(r));
                    let cos = (q - p).cross(r - p).normalize_or_zero().dot(ray.direction).abs();
                    let tolerance = 1e-5 * (1.0 + b.t + extent) / cos;
                    let near = (a.t - b.t).abs() <= tolerance || b.t == 0.0;
                    // Two triangles at the same place, or an edge so near that rounding decides.
                    let ((t_a, edge_a), (t_b, edge_b)) = (of(a.triangle), of(b.triangle));
                    let nearer = if t_a < t_b { edge_a } else { edge_b };
                    near || a.triangle != b.triangle && nearer.abs() < 1e-4
                }
                (Some(a), None) => of(a.triangle).1.abs() < 1e-4,
                (None, Some(b)) => of(b.triangle).1.abs() < 1e-4,
            };
            wrong += u32::from(!same);
        }
        wrong
    };
    let hits = ours.iter().flatten().count();
    assert!(hits > RAYS as usize / 2, "only {hits} rays meet anything");
    assert_eq!(disagreements(&triangles), 0);
    // A triangle in a thousand moved by a centimetre is noticed.
    let mut moved = triangles;
    moved.iter_mut().step_by(1000).for_each(|t| *t = t.map(|c| c + Vec3::splat(0.01)));
    assert!(disagreements(&moved) > 100);
}
