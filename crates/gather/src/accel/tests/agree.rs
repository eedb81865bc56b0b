//! All kernels agree up to rounding.

use glam::Vec3A;

use super::lanes::{boxes, has, random_node, setup, triangles, with_zeros};
use super::*;
use crate::accel::triangle_bvh::Block;
use crate::accel::walk::{BoxHits, Setup, TriangleHits};

/// Half an ulp of 1, the most by which one operation rounds, relative to its result.
const ETA: f64 = 0.5 * f32::EPSILON as f64;
/// Tolerances of t (in ulps) and of u and v, for triangles that are seen well: those for which
/// [`Seen`] allows no more, half of the hits here. Up to 15 of the ulps are the roundings of t's
/// last steps, fused or not. The rest comes from fused and rounded shearing. With AVX2 the largest
/// differences are 6 ulps and 9.2e-7. For all triangles they reach half of what [`Seen`] allows for
/// t, and 0.3 of it for u and v.
const ULPS: f64 = 24.0;
const WEIGHTS: f64 = 4e-6;

/// The numbers t, u and v of a hit.
type Answer = [f32; 3];

/// A triangle as a ray sees it, in f64, with the greatest difference that two kernels may have
/// there. It is a running error analysis (Higham 2002, "Accuracy and stability of numerical
/// algorithms", section 3.3), to first order.
///
/// Kernels compute a corner's place relative to the origin alike. They shear it, x − s z: one
/// rounds the product, another fuses it, and both round the difference. In all kernels an edge
/// function is a difference of two products of those. The sum is taken of three edge functions. A
/// weight is an edge function divided by the sum, or multiplied with its inverse. The sum of z
/// times the weights, with products rounded or fused, gives t.
#[derive(Clone, Copy, Debug)]
struct Seen {
    edges: DVec3,
    edge_slack: DVec3,
    t: f64,
    t_slack: f64,
    weight_slack: f64,
}

impl Seen {
    fn new(corners: [Vec3; 3], ray: &Setup) -> Self {
        // Sheared x and y, and z, with the difference that kernels may have there.
        let corners = corners.map(|corner| {
            let [x, y, z] = ray.axes.map(|axis| f64::from(corner[axis] - ray.origin[axis]));
            let by = DVec3::new(f64::from(ray.shear[0]) * z, f64::from(ray.shear[1]) * z, 0.0);
            let place = DVec3::new(x, y, z) - by;
            (place, ETA * (by.abs() + 2.0 * place.abs()))
        });
        let edge = |from: usize, to: usize| {
            let ((a, a_slack), (b, b_slack)) = (corners[from], corners[to]);
            let edge = a.x * b.y - a.y * b.x;
            let inherited = a_slack.x * b.y.abs()
                + a.x.abs() * b_slack.y
                + a_slack.y * b.x.abs()
                + a.y.abs() * b_slack.x;
            let own = (a.x * b.y).abs() + (a.y * b.x).abs() + edge.abs();
            (edge, inherited + 2.0 * ETA * own)
        };
        let [(u, u_slack), (v, v_slack), (w, w_slack)] = [edge(2, 1), edge(0, 2), edge(1, 0)];
        let (edges, edge_slack) = (DVec3::new(u, v, w), DVec3::new(u_slack, v_slack, w_slack));
        // Both sums have three terms.
        let (sum, slack) = (edges.element_sum(), edge_slack.element_sum());
        let least = (sum.abs() - slack).max(0.0);
        let weights = (edges / sum).abs();
        // One kernel divides; another takes two operations instead.
        let weight_slack = (edge_slack + weights * slack) / least + 7.0 * ETA * weights;
        let depths = DVec3::from(corners.map(|(place, _)| place.z));
        let z = edges.dot(depths) / sum;
        let inherited = edge_slack.dot((depths - z).abs()) / least;
        // These are eight roundings of one kernel and seven of the other.
        let own = 15.0 * ETA * weights.dot(depths.abs());
        let scale = f64::from(ray.shear[2]);
        Self {
            edges,
            edge_slack,
            t: z * scale,
            t_slack: (inherited + own) * scale.abs(),
            weight_slack: weight_slack.max_element(),
        }
    }

    /// Whether rounding may decide if the triangle is met. It may where the ray passes an edge, or
    /// begins or ends at the triangle, within the difference that kernels may have.
    fn is_tie(&self, t_max: f32) -> bool {
        let ends = [self.t, self.t - f64::from(t_max)];
        self.edges.abs().cmple(self.edge_slack).any()
            || ends.iter().any(|end| end.abs() <= self.t_slack)
    }

    /// Whether the ray passes inside all edges, within the difference that kernels may have.
    fn may_be_met(&self) -> bool {
        let (edges, slack) = (self.edges, self.edge_slack);
        edges.cmpge(-slack).all() || edges.cmple(slack).all()
    }

    /// Whether rounding alone explains the difference of two answers.
    fn explains(&self, a: Option<Answer>, b: Option<Answer>, t_max: f32) -> bool {
        let (Some(a), Some(b)) = (a, b) else { return a == b || self.is_tie(t_max) };
        let slack = [self.t_slack, self.weight_slack, self.weight_slack];
        (0..3).all(|k| (f64::from(a[k]) - f64::from(b[k])).abs() <= slack[k])
    }

    /// Whether [`ULPS`] and [`WEIGHTS`] are the tolerance.
    fn is_seen_well(&self) -> bool {
        self.weight_slack <= WEIGHTS && self.t_slack <= ULPS * ulp(self.t)
    }
}

/// The distance to the next f32 above a number of this size.
fn ulp(of: f64) -> f64 {
    let of = (of as f32).abs();
    f64::from(of.next_up()) - f64::from(of)
}

fn answer(hits: &TriangleHits, lane: usize) -> Option<Answer> {
    has(hits.mask, lane).then(|| [hits.t[lane], hits.u[lane], hits.v[lane]])
}

/// Blocks of triangles under rays at a triangle's interior and at an edge, which end there or
/// behind.
#[test]
fn triangles_differ_by_rounding_only() {
    for kernel in kernels() {
        let (mut met, mut ties, mut decided, mut well) = (0, 0, 0, 0);
        for i in 0..40_000 {
            let corner =
                |lane: u64, k: u64| random(60 + 3 * lane + k, i) + Vec3::splat(0.2 * lane as f32);
            let corners = [0, 1, 2, 3].map(|lane| [0, 1, 2].map(|k| corner(lane, k)));
            let mut block = Block::of([].into_iter());
            corners.iter().enumerate().for_each(|(n, c)| block.set(n, c.map(Vec3A::from)));
            let ([a, b, c], s) = (corners[i as usize % 4], random(51, i));
            let along = a.lerp(b, s.x);
            let target = if i % 3 == 0 { along } else { along.lerp(c, s.y) };
            let origin = 4.0 * random(52, i) - 1.5;
            let t_max = if i % 2 == 0 { f32::INFINITY } else { 1.0 };
            let ray = setup(origin, with_zeros(target - origin, i));
            let found = [Kernel::Portable, kernel].map(|k| triangles(k, &block, &ray, t_max));
            for (lane, &corners) in corners.iter().enumerate() {
                let seen = Seen::new(corners, &ray);
                let explains = |a, b| seen.explains(a, b, t_max);
                let [a, b] = [0, 1].map(|k| answer(&found[k], lane));
                assert!(explains(a, b), "{kernel:?} {i}: {a:?}, {b:?} of {seen:?}");
                decided += u32::from(!seen.is_tie(t_max));
                ties += u32::from(a.is_some() != b.is_some());
                let (Some(a), Some([t, u, v])) = (a, b) else { continue };
                met += 1;
                if !seen.is_seen_well() || seen.is_tie(t_max) {
                    continue;
                }
                well += 1;
                // The comparison must see these faults.
                let off = t + (4.0 * ULPS * ulp(seen.t)) as f32;
                let by = 4.0 * WEIGHTS as f32;
                for fault in [None, Some([off, u, v]), Some([t, u + by, v]), Some([t, u, v - by])] {
                    assert!(!explains(Some(a), fault), "{fault:?} passes for {a:?} of {seen:?}");
                }
            }
        }
        assert!(met > 10_000 && well > 5000, "{met} {well}");
        // Most of the 160,000 cases are no ties, so ties excuse little.
        assert!(decided > 140_000, "{decided}");
        assert!(kernel == Kernel::Portable || ties > 1000, "{ties}");
    }
}

/// All kernels test boxes by the same operations, none fused: a difference, a product, minima and
/// maxima, and one widening.
#[test]
fn boxes_agree_to_the_bit() {
    let same = |a: &BoxHits, b: &BoxHits| a.mask == b.mask && a.t == b.t;
    for kernel in kernels() {
        let (mut met, mut caught) = (0, [0; 2]);
        for i in 0..20_000 {
            let node = random_node(i);
            let origin = 6.0 * random(52, i) - 2.0;
            let ray = setup(origin, with_zeros(random(51, i) + 0.5 - origin, i));
            let t_max = if i % 2 == 0 { f32::INFINITY } else { 1.0 };
            let [a, b] = [Kernel::Portable, kernel].map(|k| boxes(k, &node, &ray, t_max));
            assert!(same(&a, &b), "{kernel:?} {i}: {:?} {:?}, {:?} {:?}", a.mask, a.t, b.mask, b.t);
            met += a.mask.count_ones();
            // The comparison must see these faults: one number off by an ulp, one lane more or
            // less.
            let lane = i as usize % 8;
            let mut off = BoxHits { mask: b.mask, t: b.t };
            off.t[lane] = off.t[lane].next_up();
            caught[0] += u32::from(!same(&a, &off));
            let other = BoxHits { mask: b.mask ^ (1 << lane), t: b.t };
            caught[1] += u32::from(!same(&a, &other));
        }
        assert!(met > 5000, "{met}");
        assert_eq!(caught, [20_000; 2]);
    }
}

/// Whole scenes: overlapping scattered triangles, and a closed ball at whose edges and corners rays
/// are aimed.
#[test]
fn kernels_agree() {
    let (turned, ball) = (Affine3A::from_rotation_y(0.4), ball(24, 0.1));
    let p = &ball.primitives[0];
    let edges: Vec<_> =
        p.triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]).collect();
    let at_edge = |i: u32, from: Vec3| {
        let [a, b] = edges[i as usize * 7 % edges.len()].map(|k| p.vertices.positions[k as usize]);
        turned.transform_point3(a.lerp(b, random(8, i).x)) - from
    };
    let among = |i: u32, from: Vec3| random(8, i) - from;
    for kernel in kernels() {
        let (soups, balls) = (placed_soups(), [(turned, ball.clone())]);
        let (met, other, well) = compare(&soups, kernel, among);
        assert!(met > 1500 && other == 0 && well > 500, "{kernel:?}: {met} {other} {well}");
        let (met, other, well) = compare(&balls, kernel, at_edge);
        assert!(met > 7000 && well > 3000, "{kernel:?}: {met} {well}");
        assert!(kernel == Kernel::Portable || other > 100, "{other} at edges named differently");
    }
}

/// Traces rays in a scene with both kernels. Returns four counts: rays that meet something, those
/// that meet another triangle with one kernel than with the other, faults planted and faults seen.
fn compare(
    meshes: &[(Affine3A, Arc<Mesh>)],
    kernel: Kernel,
    direction: impl Fn(u32, Vec3) -> Vec3,
) -> (u32, u32, u32) {
    let both = [Kernel::Portable, kernel].map(|kernel| accel(meshes, kernel));
    let (mut met, mut other, mut well) = (0, 0, 0);
    for i in 0..8000 {
        let origin = 3.0 * random(7, i) - 1.0;
        let ray = ray(origin, direction(i, origin));
        let found = both.each_ref().map(|accel| closest(accel, &ray, |_| true));
        let see = |hit: Hit| (hit, seen_by(&ray, &both[0], meshes, &hit));
        let agree = |found: [Option<Hit>; 2]| match found.map(|hit| hit.map(see)) {
            [Some(a), Some(b)] => is_same_surface(a, b),
            one => one.iter().flatten().all(|(_, seen)| seen.is_tie(f32::INFINITY)),
        };
        assert!(agree(found), "{kernel:?} {i}: {found:?}");
        let [Some(a), Some(b)] = found else { continue };
        met += 1;
        other += u32::from(name(&a) != name(&b));
        let seen = see(b).1;
        if name(&a) != name(&b) || !seen.is_seen_well() || seen.is_tie(f32::INFINITY) {
            continue;
        }
        well += 1;
        let (t, v) = (b.t + (4.0 * ULPS * ulp(seen.t)) as f32, b.v + 4.0 * WEIGHTS as f32);
        // At the outline a neighbour may be met too, so the fault names a triangle farther off.
        let count = meshes[b.instance as usize].1.triangle_count() as u32;
        let triangle = (b.triangle + count / 2) % count;
        for fault in [None, Some(Hit { t, ..b }), Some(Hit { v, ..b }), Some(Hit { triangle, ..b })]
        {
            assert!(!agree([Some(a), fault]), "{fault:?} passes for {a:?}");
        }
    }
    (met, other, well)
}

/// How the ray sees the triangle of a hit, in its instance's space.
fn seen_by(ray: &Ray, accel: &Accel, meshes: &[(Affine3A, Arc<Mesh>)], hit: &Hit) -> Seen {
    let placed = accel.placed.iter().find(|p| p.instance == hit.instance).expect("placed");
    let primitive = &meshes[hit.instance as usize].1.primitives[hit.primitive as usize];
    let corners = primitive.triangles[hit.triangle as usize];
    let m = &placed.object_from_world;
    let (origin, direction) = (m.transform_point3(ray.origin), m.transform_vector3(ray.direction));
    Seen::new(corners.map(|k| primitive.vertices.positions[k as usize]), &setup(origin, direction))
}

fn name(hit: &Hit) -> [u32; 3] {
    [hit.instance, hit.primitive, hit.triangle]
}

/// Whether two kernels' hits are the same up to rounding. They may be of one triangle. They may
/// also be of two: the nearer one is met so barely that a kernel may miss it, or rounding decides
/// which is nearer.
fn is_same_surface((a, of_a): (Hit, Seen), (b, of_b): (Hit, Seen)) -> bool {
    if name(&a) == name(&b) {
        let [a, b] = [a, b].map(|hit| Some([hit.t, hit.u, hit.v]));
        return of_a.explains(a, b, f32::INFINITY);
    }
    let is_there = |hit: Hit, seen: Seen| {
        seen.may_be_met() && (f64::from(hit.t) - seen.t).abs() <= seen.t_slack
    };
    let nearer = if of_a.t < of_b.t { of_a } else { of_b };
    let at_once = (of_a.t - of_b.t).abs() <= of_a.t_slack + of_b.t_slack;
    is_there(a, of_a) && is_there(b, of_b) && (at_once || nearer.is_tie(f32::INFINITY))
}
