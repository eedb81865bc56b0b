//! Hierarchies of deforming meshes: refitted while their trees are good, then rebuilt.

use lumencast_scene::{MorphTarget, Scene};

use super::*;
use crate::accel::triangle_bvh::{REBUILD_COST, cost};

/// Scattering triangles by `SMALL` keeps the tree good. `LARGE` does not, though rays still meet
/// many.
const SMALL: f32 = 0.05;
const LARGE: f32 = 2.0;

/// A mesh's vertices, with each triangle moved by up to half of `strength` along each axis.
fn strewn(mesh: &Mesh, strength: f32) -> Vec<Vertices> {
    let rest = &mesh.primitives[0].vertices;
    let moved = |(i, p): (u32, &Vec3)| p + strength * (random(6, i / 3) - 0.5);
    let positions = (0..).zip(&rest.positions).map(moved).collect();
    vec![Vertices { positions, ..rest.clone() }]
}

/// The nodes' children and the leaves' triangles, without positions.
fn shape(bvh: &TriangleBvh) -> (Vec<[u32; 8]>, Vec<[u32; 4]>) {
    let children = bvh.nodes.iter().map(|node| node.child).collect();
    (children, bvh.blocks.iter().map(|block| block.triangle).collect())
}

/// The bytes of all that rays read.
fn bits(bvh: &TriangleBvh) -> [&[u8]; 2] {
    [bytemuck::cast_slice(&bvh.nodes), bytemuck::cast_slice(&bvh.blocks)]
}

fn built(mesh: &Mesh, deformed: Option<&[Vertices]>) -> TriangleBvh {
    TriangleBvh::build(mesh, deformed, Trees::AsBuilt)
}

/// Trees of a mesh whose triangles are scattered after the first was built.
struct Strewn {
    rest: TriangleBvh,
    /// Refitted or rebuilt by the code under test.
    refitted: TriangleBvh,
    /// Refitted, never rebuilt.
    only_fitted: TriangleBvh,
    /// Built from the scattered triangles.
    fresh: TriangleBvh,
}

impl Strewn {
    fn new(mesh: &Mesh, strength: f32) -> Self {
        let moved = strewn(mesh, strength);
        let rest = built(mesh, None);
        let [mut refitted, mut only_fitted] = [rest.clone(), rest.clone()];
        refitted.refit(mesh, &moved);
        only_fitted.fit(mesh, &moved);
        Self { rest, refitted, only_fitted, fresh: built(mesh, Some(&moved)) }
    }

    /// Ratio of costs of the tree that was never rebuilt to the tree at rest.
    fn dearer(&self) -> f32 {
        cost(&self.only_fitted.nodes) / cost(&self.rest.nodes)
    }
}

/// If it were rebuilt, the tree would be another one.
#[test]
fn small_deformations_keep_the_tree() {
    let mesh = soup(500, 0.1);
    let Strewn { rest, mut refitted, fresh, .. } = Strewn::new(&mesh, SMALL);
    assert!(shape(&refitted) == shape(&rest), "the tree is kept");
    assert!(shape(&fresh) != shape(&rest), "had it been rebuilt, that would be seen");
    assert!(bits(&refitted) != bits(&rest), "boxes and triangles follow");
    assert_eq!(refitted.bounds(), fresh.bounds());
    // Boxes are neither too small nor too large: back at rest they equal those that were built.
    refitted.refit(&mesh, &[mesh.primitives[0].vertices.clone()]);
    assert!(bits(&refitted) == bits(&rest), "back at rest");
}

/// If it were never rebuilt, rays would visit several times as much.
#[test]
fn large_deformations_rebuild_the_tree() {
    let mesh = soup(500, 0.1);
    let strewn = Strewn::new(&mesh, LARGE);
    assert!(bits(&strewn.refitted) == bits(&strewn.fresh), "as if built now");
    assert!(shape(&strewn.refitted) != shape(&strewn.rest));
    let [fitted, fresh] = [&strewn.only_fitted, &strewn.fresh].map(|bvh| cost(&bvh.nodes));
    assert!(fitted > 3.0 * fresh && strewn.dearer() > 2.0 * REBUILD_COST, "{fitted} {fresh}");
}

/// With growing strength, a tree is kept up to [`REBUILD_COST`] and rebuilt beyond it. So it never
/// costs much more than a new one.
#[test]
fn trees_are_rebuilt_when_they_have_become_too_dear() {
    let mesh = soup(500, 0.1);
    let (mut kept, mut rebuilt, mut worst) = (0, 0, 0.0_f32);
    for n in 0..40 {
        let strewn = Strewn::new(&mesh, 0.02 * 1.2_f32.powi(n));
        let expected = match strewn.dearer() <= REBUILD_COST {
            true => (&strewn.only_fitted, &mut kept),
            false => (&strewn.fresh, &mut rebuilt),
        };
        *expected.1 += 1;
        assert!(bits(&strewn.refitted) == bits(expected.0), "{n}: {}", strewn.dearer());
        worst = worst.max(cost(&strewn.refitted.nodes) / cost(&strewn.fresh.nodes));
    }
    assert!(kept >= 5 && rebuilt >= 5, "{kept} kept, {rebuilt} rebuilt");
    assert!(worst < 2.5, "{worst}");
}

/// The cost counts against the cost when built, not against the moment before, so many small steps
/// add up.
#[test]
fn creeping_deformations_rebuild_the_tree_too() {
    let mesh = soup(500, 0.1);
    let mut crept = built(&mesh, None);
    let (mut before, mut rebuilt) = (cost(&crept.nodes), 0);
    let (first, mut only_fitted) = (before, crept.clone());
    for n in 1..=100 {
        let moved = strewn(&mesh, 0.02 * n as f32);
        only_fitted.fit(&mesh, &moved);
        let now = cost(&only_fitted.nodes);
        assert!(now < 1.2 * before, "{n}: no step would be enough");
        before = now;
        let old = shape(&crept);
        crept.refit(&mesh, &moved);
        rebuilt += u32::from(shape(&crept) != old);
    }
    assert!(before > 2.0 * REBUILD_COST * first, "{before} {first}");
    assert!((1..10).contains(&rebuilt), "{rebuilt}");
    assert!(cost(&crept.nodes) < 0.7 * before);
}

/// Rays at the triangles of a moment. The scene's first deforming instance must have one primitive.
fn aimed(moment: &Snapshot) -> Vec<Ray> {
    let of = |i: &Instance| i.deformation.clone().map(|d| (d, i.world_from_object));
    let (deformation, to_world) = moment.instances.iter().find_map(of).expect("one deforms");
    let positions = &deformation.vertices()[0].positions;
    let triangles = &deformation.mesh().primitives[0].triangles;
    let at = |n: u32| {
        let [a, b, c] =
            triangles[n as usize * 7919 % triangles.len()].map(|k| positions[k as usize]);
        let target = to_world.transform_point3((a + b + c) / 3.0);
        let origin = target + 4.0 * (random(17, n) - 0.5);
        ray(origin, target - origin)
    };
    (0..4000).map(at).collect()
}

fn hits(accel: &Accel, rays: &[Ray]) -> Vec<Option<Hit>> {
    rays.iter().map(|ray| closest(accel, ray, |_| true)).collect()
}

/// Number of rays that meet something else in one structure than in the other.
fn differing(a: &Accel, b: &Accel, rays: &[Ray]) -> usize {
    let [a, b] = [a, b].map(|accel| hits(accel, rays));
    a.iter().zip(&b).filter(|(a, b)| a != b).count()
}

fn morphed(mesh: &Arc<Mesh>, weight: f32) -> Arc<Snapshot> {
    let deformation = Deformation::new(mesh.clone(), vec![weight], None);
    snapshot(vec![Instance {
        node: NodeId(3),
        copy: 0,
        still: true,
        mesh_id: MeshId(0),
        mesh: mesh.clone(),
        deformation: Some(Arc::new(deformation)),
        world_from_object: placed_soups()[1].0,
    }])
}

/// A mesh whose only morph target scatters its triangles, by up to half of its weight along each
/// axis.
fn morphing() -> Arc<Mesh> {
    let mut mesh = (*soup(500, 0.1)).clone();
    let to = strewn(&mesh, 1.0).remove(0).positions;
    let primitive = &mut mesh.primitives[0];
    let apart = to.iter().zip(&primitive.vertices.positions).map(|(to, from)| *to - *from);
    let target = MorphTarget { positions: apart.collect(), normals: vec![], tangents: vec![] };
    primitive.morph_targets = vec![target];
    Arc::new(mesh)
}

/// One cache for all moments finds, to the bit, what a new one finds at each. Its tree is kept,
/// rebuilt, or both in turns. A structure of an earlier moment stays unchanged while somebody
/// traces it.
#[test]
fn one_cache_follows_a_deformation() {
    let mesh = morphing();
    for kernel in kernels() {
        let mut cache = AccelCache::default();
        let mut last: Option<(Accel, Vec<Ray>, Vec<Option<Hit>>)> = None;
        let mut shapes = Vec::new();
        for weight in [0.0, 0.02, 0.05, LARGE, 0.0] {
            let moment = morphed(&mesh, weight);
            let [now, fresh] =
                [&mut cache, &mut AccelCache::default()].map(|cache| cache.update(&moment, kernel));
            let rays = aimed(&moment);
            let found = hits(&now, &rays);
            assert!(found == hits(&fresh, &rays), "{kernel:?} at {weight}");
            assert!(found.iter().all(Option::is_some), "all are aimed at something");
            shapes.push(shape(&now.placed[0].bvh));
            if let Some((old, rays, found)) = last.take() {
                let other = differing(&old, &now, &rays);
                assert!(other > 3000, "{other} would be wrong, were nothing done at {weight}");
                assert!(hits(&old, &rays) == found, "what is in flight is left alone");
            }
            last = Some((now, rays, found));
        }
        assert!(shapes[0] == shapes[1] && shapes[1] == shapes[2], "kept");
        assert!(shapes[2] != shapes[3] && shapes[3] != shape(&built(&mesh, None)), "rebuilt");
    }
}

/// A hierarchy that nobody traces is refitted in place, not copied.
#[test]
fn trees_are_fitted_in_place() {
    let (mesh, mut cache) = (morphing(), AccelCache::default());
    let mut place = |weight| {
        let accel = cache.update(&morphed(&mesh, weight), Kernel::detect());
        (Arc::as_ptr(&accel.placed[0].bvh), accel)
    };
    let (first, _) = place(0.0);
    let (second, in_flight) = place(0.02);
    assert_eq!(second, first);
    let (third, _) = place(0.05);
    assert_ne!(third, second, "this one is traced");
    drop(in_flight);
    assert_eq!(place(0.02).0, third);
}

/// The same for an animated scene: the curtain of the tomb, moved by the draught.
#[test]
fn one_cache_follows_the_curtain_of_the_tomb() {
    let mut scene = Scene::open("tomb").expect("a built-in scene");
    // Large objects are left out to save time.
    let mut moment = |seconds| {
        assert!(scene.advance(seconds));
        let mut moment = (*scene.snapshot()).clone();
        moment.instances.retain(|i| i.deformation.is_some() || i.mesh.triangle_count() < 5000);
        assert!(moment.instances.len() > 5, "columns and pedestals too");
        Arc::new(moment)
    };
    let (mut cache, kernel) = (AccelCache::default(), Kernel::detect());
    let mut last = cache.update(&moment(0.5), kernel);
    for seconds in [0.03, 1.5, 3.0] {
        let moment = moment(seconds);
        let [now, fresh] =
            [&mut cache, &mut AccelCache::default()].map(|cache| cache.update(&moment, kernel));
        let rays = aimed(&moment);
        assert_eq!(differing(&now, &fresh, &rays), 0, "after {seconds}");
        let other = differing(&last, &now, &rays);
        assert!(other > 2000, "{other} of the rays would be wrong, were nothing done");
        last = now;
    }
}

/// Triangles that are not finite for a moment do not affect others, and come back. Refitting alone
/// does not bring back triangles that the tree was built without.
#[test]
fn triangles_come_back_from_nowhere() {
    let mesh = soup(500, 0.1);
    let rest = [mesh.primitives[0].vertices.clone()];
    let rays = aimed(&morphed(&mesh, 0.0));
    let accel = |bvh: &TriangleBvh| {
        let placed = (0, placed_soups()[1].0, Arc::new(bvh.clone()));
        Accel::new([placed], Kernel::detect())
    };
    let mut lost = 0;
    for (odd, every) in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY]
        .into_iter()
        .flat_map(|odd| [1, 3, 50, 499].map(|every| (odd, every)))
    {
        let mut gone = rest.clone();
        for n in (0..500).step_by(every) {
            gone[0].positions[3 * n + n / every % 3][n % 3] = odd;
        }
        let mut refitted = built(&mesh, None);
        for step in [&gone, &rest, &gone, &gone, &rest] {
            refitted.refit(&mesh, step);
            let fresh = built(&mesh, Some(step));
            let other = differing(&accel(&refitted), &accel(&fresh), &rays);
            assert_eq!(other, 0, "every {every}th {odd}");
        }
        let mut only_fitted = built(&mesh, Some(&gone));
        only_fitted.fit(&mesh, &rest);
        lost += differing(&accel(&only_fitted), &accel(&built(&mesh, None)), &rays);
    }
    assert!(lost > 1000, "{lost}");
}
