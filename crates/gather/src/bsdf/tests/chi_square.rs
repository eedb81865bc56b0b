//! Tests that `sample` chooses directions with the density that it states. It uses Pearson's χ²
//! over bins of the sphere; directions that are rejected have a bin of their own.

use std::f64::consts::{PI, TAU};

use glam::{DMat3, DVec3, Vec2, Vec3};

use super::*;
use crate::sampling::{mix, mix2, unit};

const SAMPLES: u32 = 1 << 16;
/// Probability that a correct BSDF fails anywhere in one test.
const SIGNIFICANCE: f64 = 0.01;
/// Number of bins by the angle from the mirror direction, and around it.
const RINGS: usize = 16;
const SECTORS: usize = 12;

/// Bins around the mirror direction, fine near it and coarse far from it. Transmitted directions
/// are mirrored back to the upper side and have bins of their own.
struct Bins {
    world_from_mirror: DMat3,
    /// Angle below which rings are about equally wide.
    width: f64,
}

impl Bins {
    fn new(v: Vec3, alpha: f32) -> Self {
        let mirror = Vec3::new(-v.x, -v.y, v.z).normalize();
        Self { world_from_mirror: frame(mirror).as_dmat3(), width: alpha.into() }
    }

    fn rings(&self) -> f64 {
        (1.0 + PI / self.width).ln()
    }

    /// Maps ring and sector, as real numbers, to a direction. The second value is the solid angle
    /// of one unit of both.
    fn direction(&self, ring: f64, sector: f64) -> (DVec3, f64) {
        let step = self.rings() / RINGS as f64;
        let polar = self.width * (ring * step).exp_m1();
        let (sin, cos) = polar.sin_cos();
        let (y, x) = (sector * TAU / SECTORS as f64).sin_cos();
        let jacobian = sin * (polar + self.width) * step * TAU / SECTORS as f64;
        (self.world_from_mirror * DVec3::new(sin * x, sin * y, cos), jacobian)
    }

    fn bin(&self, l: Vec3) -> usize {
        let side = usize::from(l.z < 0.0);
        let upper = DVec3::new(l.x.into(), l.y.into(), l.z.abs().into());
        let d = self.world_from_mirror.transpose() * upper;
        let polar = d.truncate().length().atan2(d.z);
        let ring = (polar / self.width).ln_1p() / self.rings() * RINGS as f64;
        let sector = d.y.atan2(d.x).rem_euclid(TAU) / TAU * SECTORS as f64;
        let ring = (ring as usize).min(RINGS - 1);
        let sector = (sector as usize).min(SECTORS - 1);
        (side * RINGS + ring) * SECTORS + sector
    }

    /// The density's integral over every bin.
    fn chances(&self, pdf: &impl Fn(Vec3) -> f32) -> Vec<f64> {
        (0..2 * RINGS * SECTORS)
            .map(|bin| {
                let (side, ring) = (bin / SECTORS / RINGS, bin / SECTORS % RINGS);
                let density = |r: f64, s: f64| {
                    let (d, jacobian) = self.direction(r, s);
                    if d.z <= 0.0 {
                        return 0.0;
                    }
                    let l = d.as_vec3();
                    f64::from(pdf(if side == 0 { l } else { through(l) })) * jacobian
                };
                integral(&density, [ring as f64, (bin % SECTORS) as f64], 1.0, 0)
            })
            .collect()
    }
}

/// Adaptive quadrature over a square by 3 × 3 Gauss-Legendre points. It splits the square into
/// quarters where the two disagree.
fn integral(f: &impl Fn(f64, f64) -> f64, corner: [f64; 2], side: f64, depth: u32) -> f64 {
    const ALWAYS: u32 = 2;
    const DEEPEST: u32 = 7;
    let gauss = |corner: [f64; 2], side: f64| {
        let offset = 0.5 * 0.6f64.sqrt();
        let points = [(0.5 - offset, 5.0 / 18.0), (0.5, 8.0 / 18.0), (0.5 + offset, 5.0 / 18.0)];
        let mut sum = 0.0;
        for (x, wx) in points {
            for (y, wy) in points {
                sum += wx * wy * f(corner[0] + side * x, corner[1] + side * y);
            }
        }
        sum * side * side
    };
    let half = 0.5 * side;
    let quarters = [[0.0, 0.0], [half, 0.0], [0.0, half], [half, half]]
        .map(|[x, y]| [corner[0] + x, corner[1] + y]);
    if depth >= ALWAYS {
        let whole = gauss(corner, side);
        let parts: f64 = quarters.iter().map(|q| gauss(*q, half)).sum();
        if (whole - parts).abs() < 1e-7 + 1e-4 * parts || depth == DEEPEST {
            return parts;
        }
    }
    quarters.iter().map(|q| integral(f, *q, half, depth + 1)).sum()
}

/// Probability that a sampler with density `pdf` deviates from it at least as much as `sample`
/// does.
fn p_value(
    bins: &Bins,
    pdf: impl Fn(Vec3) -> f32,
    sample: impl Fn(f32, Vec2) -> Option<Vec3>,
) -> f64 {
    let mut chances = bins.chances(&pdf);
    let total: f64 = chances.iter().sum();
    assert!(total < 1.0 + 1e-4, "the density integrates to {total}");
    chances.push((1.0 - total).max(0.0));
    let mut found = vec![0u32; chances.len()];
    for i in 0..SAMPLES {
        // χ² supposes independent numbers; `Sampler` spreads its numbers more evenly than chance.
        let number = |k: u64| unit(mix(mix2(k, i.into())) as u32);
        let direction = sample(number(0), Vec2::new(number(1), number(2)));
        found[direction.map_or(chances.len() - 1, |l| bins.bin(l))] += 1;
    }
    let mut pairs: Vec<(f64, u32)> =
        chances.iter().map(|p| p * f64::from(SAMPLES)).zip(found).collect();
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
    // χ² is a good approximation where at least five are expected, so rarer bins are merged.
    let (mut statistic, mut terms, mut pool) = (0.0, 0, (0.0, 0));
    for (expected, found) in pairs {
        pool = (pool.0 + expected, pool.1 + found);
        if pool.0 >= 5.0 {
            statistic += (f64::from(pool.1) - pool.0).powi(2) / pool.0;
            terms += 1;
            pool = (0.0, 0);
        }
    }
    assert!(terms > 1, "one bin tells nothing");
    upper_gamma(0.5 * f64::from(terms - 1), 0.5 * statistic)
}

/// Q(a, x), the regularised upper incomplete gamma function: by its series below a + 1, by Lentz's
/// continued fraction above (Press et al. 2007, "Numerical Recipes", section 6.2).
fn upper_gamma(a: f64, x: f64) -> f64 {
    if x <= 0.0 {
        return 1.0;
    }
    let scale = (a * x.ln() - x - ln_gamma(a)).exp();
    if x < a + 1.0 {
        let (mut term, mut sum, mut n) = (1.0 / a, 1.0 / a, a);
        while term > 1e-16 * sum {
            n += 1.0;
            term *= x / n;
            sum += term;
        }
        return 1.0 - scale * sum;
    }
    let mut b = x + 1.0 - a;
    let (mut c, mut d) = (1e300, 1.0 / b);
    let mut fraction = d;
    for i in 1..10_000 {
        let i = f64::from(i);
        let numerator = -i * (i - a);
        b += 2.0;
        d = 1.0 / (numerator * d + b);
        c = b + numerator / c;
        fraction *= c * d;
        if (c * d - 1.0).abs() < 1e-15 {
            break;
        }
    }
    scale * fraction
}

/// Stirling's series, after the argument is moved up to where the series is exact.
fn ln_gamma(mut a: f64) -> f64 {
    let mut down = 0.0;
    while a < 10.0 {
        down += a.ln();
        a += 1.0;
    }
    let series = 1.0 / (12.0 * a) - 1.0 / (360.0 * a.powi(3)) + 1.0 / (1260.0 * a.powi(5));
    (a - 0.5) * a.ln() - a + 0.5 * TAU.ln() + series - down
}

/// The p-value threshold of each of `tests` tests that together fail a correct BSDF with
/// probability SIGNIFICANCE (Šidák).
fn threshold(tests: usize) -> f64 {
    1.0 - (1.0 - SIGNIFICANCE).powf(1.0 / tests as f64)
}

fn surfaces() -> Vec<(String, Bsdf)> {
    let mut surfaces = vec![("Lambert".to_owned(), Bsdf::lambert(Vec3::ONE))];
    for (name, s) in substances() {
        for roughness in [0.0, 0.2, 0.5, 1.0] {
            let bsdf = Bsdf::new(&Substance { roughness, ..s });
            surfaces.push((format!("{name}, roughness {roughness}"), bsdf));
        }
    }
    surfaces
}

fn views_and_grazing() -> Vec<Vec3> {
    let mut all = views().to_vec();
    all.push(Vec3::new(0.6, -0.8, 0.02).normalize());
    all
}

#[test]
fn directions_are_chosen_as_densely_as_stated() {
    let (surfaces, views) = (surfaces(), views_and_grazing());
    let threshold = threshold(surfaces.len() * views.len());
    for (name, bsdf) in &surfaces {
        for &v in &views {
            let sample = |choice, u| bsdf.sample(v, choice, u).map(|c| c.direction);
            let p = p_value(&Bins::new(v, bsdf.alpha), |l| bsdf.eval(v, l).pdf, sample);
            assert!(p > threshold, "{name} at {v}: p = {p:e}");
        }
    }
}

/// Samplers with common faults: the test above rejects each.
#[test]
fn samplers_with_a_fault_are_refused() {
    let [plain, _, _, metal, ..] = &substances()[..] else { unreachable!() };
    let refused = |name: &str, bsdf: &Bsdf, v: Vec3, sample: &dyn Fn(f32, Vec2) -> Option<Vec3>| {
        let p = p_value(&Bins::new(v, bsdf.alpha), |l| bsdf.eval(v, l).pdf, sample);
        assert!(p < threshold(1000), "{name} at {v} passes: p = {p}");
    };
    let mirrored = |v: Vec3, h: Vec3| Some(2.0 * v.dot(h) * h - v).filter(|l| l.z > 0.0);
    for v in views_and_grazing() {
        let lambert = Bsdf::lambert(Vec3::ONE);
        let uniform = |_, u: Vec2| {
            let d = sphere(u);
            Some(Vec3::new(d.x, d.y, d.z.abs()))
        };
        refused("uniform for cosine", &lambert, v, &uniform);

        for roughness in [0.0, 0.2, 0.5, 1.0] {
            let bsdf = Bsdf::new(&Substance { roughness, ..metal.1 });
            let wider = Bsdf { alpha: 1.1 * bsdf.alpha, ..bsdf };
            let sample = |choice, u| wider.sample(v, choice, u).map(|c| c.direction);
            refused("α a tenth too large", &bsdf, v, &sample);
            // Narrow lobes and views from above have few normals that the viewer cannot see.
            if v.z < 0.9 && roughness >= 0.5 {
                // The fault: it samples all normals, seen by the viewer or not (Walter et al. 2007,
                // equation 35).
                let all_normals = |_, u: Vec2| {
                    let tan = bsdf.alpha * (u.x / (1.0 - u.x)).sqrt();
                    let azimuth = Vec2::from_angle(std::f32::consts::TAU * u.y);
                    mirrored(v, (tan * azimuth).extend(1.0).normalize())
                };
                refused("normals that are hidden", &bsdf, v, &all_normals);
            }
        }
        // At grazing angles nearly all light is in the specular lobe, so a biased choice would not
        // show.
        if v.z > 0.1 {
            let bsdf = Bsdf::new(&plain.1);
            let biased = |choice: f32, u| bsdf.sample(v, 0.95 * choice, u).map(|c| c.direction);
            refused("a lobe taken too often", &bsdf, v, &biased);
        }
    }
}

/// The upper 5 % points of χ², from tables.
#[test]
fn incomplete_gamma_is_that_of_tables() {
    for (freedom, point) in
        [(1.0, 3.841_458_82), (2.0, 5.991_464_55), (10.0, 18.307_038_1), (100.0, 124.342_113)]
    {
        let p = upper_gamma(0.5 * freedom, 0.5 * point);
        assert!((p - 0.05).abs() < 1e-8, "{freedom}: {p}");
    }
    assert!((upper_gamma(3.0, 1.0) - 2.5 * (-1.0f64).exp()).abs() < 1e-9);
}
