//! White furnace: how much a surface reflects where equal radiance arrives from every direction.

use glam::DVec3;
use lumencast_testkit::vectors::GgxAlbedo;

use super::*;

/// The directional albedo by sampling, with its standard error. `fault` multiplies the contribution
/// of each direction.
fn albedo(bsdf: &Bsdf, v: Vec3, fault: impl Fn(&Chosen) -> f32) -> (DVec3, DVec3) {
    const GROUPS: u32 = 16;
    const SAMPLES: u32 = 4096;
    let (mut sum, mut squares) = (DVec3::ZERO, DVec3::ZERO);
    for group in 0..GROUPS {
        let mut mean = DVec3::ZERO;
        for i in 0..SAMPLES {
            let mut r = Sampler::new(11, group, i);
            let choice = r.number();
            let Some(chosen) = bsdf.sample(v, choice, r.square()) else { continue };
            mean += (chosen.weight * fault(&chosen)).as_dvec3() / f64::from(SAMPLES);
        }
        sum += mean;
        squares += mean * mean;
    }
    let n = f64::from(GROUPS);
    let variance = (squares / n - (sum / n).powf(2.0)).max(DVec3::ZERO) / (n - 1.0);
    (sum / n, variance.map(f64::sqrt))
}

fn no_fault(_: &Chosen) -> f32 {
    1.0
}

/// Lambert and every smooth white surface reflect exactly what arrives. The test must reject a
/// surface whose cosine counts twice.
#[test]
fn smooth_white_surfaces_keep_all_light() {
    let white = |s: Substance| Substance { base_color: Vec3::ONE, roughness: 0.0, ..s };
    let smooth = substances().into_iter().map(|(name, s)| (name, Bsdf::new(&white(s))));
    // A tinted specular colour makes it less than white: the diffuse lobe loses the largest
    // channel.
    let smooth = smooth.filter(|(name, _)| *name != "tinted specular");
    for (name, bsdf) in smooth.chain([("Lambert", Bsdf::lambert(Vec3::ONE))]) {
        let keeps = |v, fault: &dyn Fn(&Chosen) -> f32| {
            let (mean, error) = albedo(&bsdf, v, fault);
            let tolerance = DVec3::splat(1e-3) + 5.0 * error;
            ((mean - 1.0).abs().cmple(tolerance).all(), mean, error)
        };
        for v in views() {
            let (sound, mean, error) = keeps(v, &no_fault);
            assert!(sound, "{name} at {v}: {mean} ± {error}");
        }
        assert!(!keeps(views()[1], &|c| c.direction.z.abs()).0, "{name}: passes with cosine twice");
    }
}

/// No surface reflects more than arrives. Dielectrics of low index and middling roughness may
/// exceed it by 0.18 %: their diffuse lobe loses only what the smooth surface would reflect.
#[test]
fn no_surface_reflects_more_than_arrives() {
    const MOST: f64 = 1.002;
    for (name, s) in substances() {
        for roughness in [0.05, 0.2, 0.5, 1.0] {
            let bsdf = Bsdf::new(&Substance { roughness, ..s });
            for v in views() {
                let (mean, error) = albedo(&bsdf, v, no_fault);
                let most = DVec3::splat(MOST) + 5.0 * error;
                assert!(mean.cmple(most).all(), "{name}, roughness {roughness}, at {v}: {mean}");
            }
        }
    }
    // The mix of glTF's sample code, 1 − F(v·h), reflects far more, so the check can fail.
    let bsdf = Bsdf::new(&Substance { roughness: 0.05, ..substances()[0].1 });
    let v = views()[3];
    let naive = |c: &Chosen| {
        let l = c.direction;
        let change = 1.0 - bsdf.reflectance(v.dot((v + l).normalize())) - bsdf.coupling(v, l);
        1.0 + change * FRAC_1_PI * l.z / (c.pdf * c.weight.y)
    };
    assert!(albedo(&bsdf, v, naive).0.y > 1.2);
}

/// The number of entries of `vectors/ggx_albedo.json` that a metal and a black dielectric disagree
/// with. The entries are albedos of single-scatter GGX, integrated by other code.
fn disagreements(
    alpha_of: impl Fn(f32) -> f32,
    fault: impl Fn(&Bsdf, Vec3, &Chosen) -> f32,
) -> (usize, String) {
    let table = GgxAlbedo::load();
    let (mut wrong, mut said) = (0, String::new());
    for (i, &roughness) in table.roughness.iter().enumerate() {
        for (j, &cos) in table.cos.iter().enumerate() {
            let v = Vec3::new(0.0, (1.0 - cos * cos).sqrt(), cos);
            for (metallic, base_color, f0) in [
                (1.0, Vec3::new(1.0, 0.6, 0.2), DVec3::new(1.0, 0.6, 0.2)),
                (0.0, Vec3::ZERO, DVec3::splat(0.04)),
            ] {
                let substance = Substance { metallic, base_color, ..substances()[0].1 };
                let bsdf = Bsdf { alpha: alpha_of(roughness), ..Bsdf::new(&substance) };
                let (mean, error) = albedo(&bsdf, v, |c| fault(&bsdf, v, c));
                let expected = f0 * table.by_f0[i][j] + table.by_f90[i][j];
                let tolerance = 5.0 * error + 2e-4 * expected;
                if !(mean - expected).abs().cmple(tolerance).all() {
                    wrong += 1;
                    said += &format!("{roughness} {cos}: {mean} ± {error}, {expected}\n");
                }
            }
        }
    }
    (wrong, said)
}

#[test]
fn rough_surfaces_reflect_what_the_table_says() {
    let square = |roughness: f32| roughness * roughness;
    let (wrong, said) = disagreements(square, |_, _, _| 1.0);
    assert_eq!(wrong, 0, "\n{said}");

    // The check must see each of these textbook faults in many entries.
    let lambda = |d: Vec3, alpha: f32| {
        let tan2 = 1.0 / (d.z * d.z) - 1.0;
        0.5 * ((1.0 + alpha * alpha * tan2).sqrt() - 1.0)
    };
    let separable = |bsdf: &Bsdf, v: Vec3, c: &Chosen| {
        let (a, b) = (lambda(v, bsdf.alpha), lambda(c.direction, bsdf.alpha));
        (1.0 + a + b) / ((1.0 + a) * (1.0 + b))
    };
    let unshadowed = |bsdf: &Bsdf, v: Vec3, c: &Chosen| {
        1.0 + lambda(v, bsdf.alpha) + lambda(c.direction, bsdf.alpha)
    };
    let fresnel_of_n = |bsdf: &Bsdf, v: Vec3, c: &Chosen| {
        let v_dot_h = v.dot((v + c.direction).normalize());
        bsdf.fresnel(v.z).y / bsdf.fresnel(v_dot_h).y
    };
    for (fault, (wrong, _)) in [
        ("α not squared", disagreements(|roughness| roughness, |_, _, _| 1.0)),
        ("shadowing and masking apart", disagreements(square, separable)),
        ("no shadowing", disagreements(square, unshadowed)),
        ("Fresnel of n·v", disagreements(square, fresnel_of_n)),
    ] {
        assert!(wrong > 20, "{fault}: {wrong} entries");
    }
}
