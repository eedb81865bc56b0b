//! Light of the field: where it is read and what it becomes, beside `light`'s own reading on the
//! processor and beside numerical integration.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use crate::common::{SIZE, drawn, renderer};
use glam::{Affine2, DVec3, Quat, UVec2, UVec3, Vec2, Vec3};
use lumencast_light::{FieldId, Grid, Light, Offset, Order, ProbeVolume, Sh, sh::basis};
use lumencast_scene::{
    Filter, Image, LightKind, Material, PunctualLight, Snapshot, TextureRef, View, Wrap,
};
use lumencast_shade::{Lighting, Materials, Renderer, Settings};
use lumencast_testkit::scenes::{Stage, lambert};

fn settings() -> Settings {
    Settings { size: SIZE, samples: 1, lighting: Lighting::INDIRECT, ..Settings::default() }
}

/// A floor of a material at y = 0, 6 m wide.
fn floor(material: Material) -> Arc<Snapshot> {
    let mut stage = Stage::default();
    let material = stage.material(material);
    stage.quad(Vec3::new(-3.0, 0.0, 3.0), Vec3::X * 6.0, Vec3::NEG_Z * 6.0, material);
    stage.snapshot()
}

/// Smooth light that differs from probe to probe and from coefficient to coefficient.
fn volume(id: u32, center: Vec3, turn: f32, cells: UVec3, order: Order) -> ProbeVolume {
    let grid = Grid {
        center,
        rotation: Quat::from_rotation_y(turn),
        size: Vec3::new(5.0, 2.0, 4.0),
        resolution: cells,
    };
    let mut volume = ProbeVolume::dark(FieldId(id), grid, order);
    for probe in 0..grid.probe_count() {
        let at = grid.position(grid.cell(probe));
        for (i, c) in volume.probe_mut(probe).iter_mut().enumerate() {
            let i = i as f32;
            let wave = |k: f32| (k + 0.7 * i + at.x + 0.5 * at.z + at.y).sin();
            let share = if i == 0.0 { 9.0 } else { 0.0 };
            *c = 1000.0 * (share + 2.0 * Vec3::new(wave(0.0), wave(1.0), wave(2.0)));
        }
    }
    volume
}

/// What every pixel of the floor should show, read from the field on the processor; the largest
/// difference from what the adapter draws, relative to the largest light.
fn worst(drawn_light: &Light, light: &Light) -> f32 {
    let albedo = Vec3::new(0.9, 0.6, 0.3);
    let scene = floor(lambert(albedo, Vec3::ZERO));
    let view = View::look_at(Vec3::new(1.0, 2.5, 3.0), Vec3::ZERO, 0.9).unwrap();
    let settings = Settings { pre_exposure: 1e-3, ..settings() };
    let mut renderer = renderer(&scene, &settings);
    renderer.set_light(drawn_light).unwrap();
    let picture = renderer.pictures(&[view], &settings).unwrap().remove(0);

    let (mut worst, mut largest) = (0.0f32, 0.0f32);
    for (i, pixel) in (0..).zip(&picture) {
        let at = (UVec2::new(i % SIZE.x, i / SIZE.x).as_vec2() + 0.5) / SIZE.as_vec2();
        let (origin, direction) = view.ray(at, SIZE.x as f32 / SIZE.y as f32);
        let point = origin - direction * (origin.y / direction.y);
        // Pixels that the floor's edge goes through belong to either side.
        if direction.y >= 0.0 || point.abs().max_element() > 2.95 {
            continue;
        }
        let irradiance = light.irradiance(point, Vec3::Y).max(Vec3::ZERO);
        let expected = albedo / std::f32::consts::PI * irradiance;
        largest = largest.max(expected.max_element());
        worst = worst.max((*pixel - expected).abs().max_element());
    }
    assert!(largest > 0.0, "the floor is seen");
    worst / largest
}

#[test]
fn read_as_on_the_processor() {
    const ORDERS: [Order; 4] = [Order::L1, Order::L2, Order::L3, Order::L4];
    for order in ORDERS {
        let light = Light::new(vec![volume(0, Vec3::Y * 0.5, 0.4, UVec3::new(5, 3, 4), order)]);
        for offset in [Offset::NONE, Offset::HALF_CELL, Offset::Metres(0.3)] {
            let light = light.clone().read_at(offset);
            let worst = worst(&light, &light);
            assert!(worst < 5e-3, "{order:?} {offset:?}: {worst}");
        }
        let elsewhere = light.clone().read_at(Offset::Metres(0.4));
        assert!(worst(&elsewhere, &light) > 0.01, "{order:?}: another offset is noticed");
    }
}

#[test]
fn volumes_of_many_kinds_meet() {
    let light = Light::new(vec![
        volume(0, Vec3::new(0.0, 0.5, 0.0), 0.0, UVec3::new(3, 2, 3), Order::L1),
        volume(1, Vec3::new(1.5, 0.2, 0.5), 0.7, UVec3::new(8, 4, 7), Order::L3),
        volume(2, Vec3::new(-2.0, 0.4, -1.0), -0.3, UVec3::new(9, 3, 9), Order::L2),
    ]);
    let all = worst(&light, &light);
    assert!(all < 5e-3, "{all}");
    // What was read is really that of these volumes.
    let fewer = Light::new(light.volumes().take(2).cloned());
    assert!(worst(&fewer, &light) > 0.05, "a volume that is missing is noticed");
    let mut other = light.clone();
    other.volumes_mut().nth(1).unwrap().coefficients.iter_mut().for_each(|c| *c *= 1.1);
    assert!(worst(&other, &light) > 0.01, "a tenth more light is noticed");
}

/// A field of one probe, which is the same everywhere.
fn uniform(sh: &Sh) -> Light {
    let grid = Grid {
        center: Vec3::ZERO,
        rotation: Quat::IDENTITY,
        size: Vec3::splat(10.0),
        resolution: UVec3::ONE,
    };
    let mut volume = ProbeVolume::dark(FieldId(0), grid, sh.order);
    volume.probe_mut(0).copy_from_slice(sh.values());
    Light::new(vec![volume])
}

/// Steps of quadrature, by the angle to the normal and around it.
const STEPS: [u32; 2] = [200, 128];

/// The middles of all parts of a hemisphere, as shares of the way to its border and of a turn.
fn parts() -> impl Iterator<Item = (f64, f64)> {
    let middle = |i: u32, n: u32| (f64::from(i) + 0.5) / f64::from(n);
    let [steps, around] = STEPS;
    (0..steps)
        .flat_map(move |i| (0..around).map(move |k| (middle(i, steps), TAU * middle(k, around))))
}

/// Mean of what `weight` makes of v·h and of the light's direction over the lobe of GGX seen from `v`,
/// ∫ D G / (4 n·v n·l) weight (n·l) dω, in its surface's own directions with the normal along y, by
/// quadrature over half vectors.
fn over_lobe(roughness: f64, v: DVec3, weight: impl Fn(f64, DVec3) -> f64) -> f64 {
    let alpha2 = roughness.powi(4);
    let lambda = |cos: f64| 0.5 * ((1.0 + alpha2 * (1.0 - cos * cos) / (cos * cos)).sqrt() - 1.0);
    let mut sum = 0.0;
    for (t, phi) in parts() {
        // Denser near the normal: cos θ_h = 1 − t³.
        let cos_h = 1.0 - t.powi(3);
        let solid_angle = TAU * 3.0 * t * t / f64::from(STEPS[0] * STEPS[1]);
        let d = alpha2 / (PI * (cos_h * cos_h * (alpha2 - 1.0) + 1.0).powi(2));
        let sin_h = (1.0 - cos_h * cos_h).sqrt();
        let h = DVec3::new(sin_h * phi.cos(), cos_h, sin_h * phi.sin());
        let v_h = v.dot(h);
        let l = 2.0 * v_h * h - v;
        if v_h <= 0.0 || l.y <= 0.0 {
            continue;
        }
        // D G / (4 n·v n·l) n·l dω_l, and dω_l = 4 v·h dω_h.
        let g = 1.0 / (1.0 + lambda(v.y) + lambda(l.y));
        sum += d * g * v_h / v.y * solid_angle * weight(v_h, l);
    }
    sum
}

/// A field's light from a direction; from one mirrored by the surface.
fn from(sh: &Sh, l: DVec3) -> f64 {
    f64::from(sh.radiance(l.as_vec3()).x)
}

fn from_behind(sh: &Sh, l: DVec3) -> f64 {
    from(sh, DVec3::new(l.x, -l.y, l.z))
}

/// What a surface makes of a field's light, seen from a direction.
type Integral = fn(sh: &Sh, roughness: f64, v: DVec3) -> f64;

/// ∫ f(v, l) L(l) (n·l) dω for a metal of F0 = 1.
fn of_metal(sh: &Sh, roughness: f64, v: DVec3) -> f64 {
    over_lobe(roughness, v, |_, l| from(sh, l))
}

/// Schlick's Fresnel term of glass, by the cosine with the half vector.
fn of_glass(cosine: f64) -> f64 {
    0.04 + 0.96 * (1.0 - cosine).powi(5)
}

fn of_gloss(sh: &Sh, roughness: f64, v: DVec3) -> f64 {
    over_lobe(roughness, v, |v_h, l| of_glass(v_h) * from(sh, l))
}

/// Of white plastic: gloss, and a diffuse lobe of which the surface takes what it reflects, on the way in
/// and out.
fn of_plastic(sh: &Sh, roughness: f64, v: DVec3) -> f64 {
    let mut diffuse = 0.0;
    for (t, phi) in parts() {
        // Areas of the disc below, and so cosines, are the same for all parts.
        let (sin, cos) = (t.sqrt(), (1.0 - t).sqrt());
        let l = DVec3::new(sin * phi.cos(), cos, sin * phi.sin());
        diffuse += (1.0 - of_glass(cos)) * from(sh, l) / f64::from(STEPS[0] * STEPS[1]);
    }
    let mean = 0.04 + 0.96 / 21.0;
    of_gloss(sh, roughness, v) + diffuse * (1.0 - of_glass(v.y)) / (1.0 - mean)
}

/// Of a thin clear sheet: gloss, and light from behind by the same lobe mirrored.
fn of_sheet(sh: &Sh, roughness: f64, v: DVec3) -> f64 {
    let through = |v_h, l| (1.0 - of_glass(v_h)) * from_behind(sh, l);
    of_gloss(sh, roughness, v) + over_lobe(roughness, v, through)
}

/// A bright sky with a brighter side: what a lobe sees depends on how wide it is and where it points.
fn sky(order: Order) -> Sh {
    let toward = Vec3::new(0.3, 0.9, 0.2).normalize();
    let mut sh = Sh::dark(order);
    for (c, b) in sh.values_mut().iter_mut().zip(basis(order, toward)) {
        *c = Vec3::splat(b);
    }
    sh.coefficients[0] += 1.5;
    sh
}

/// The largest error of what is drawn of a material, relative to its integral, over roughness; under a sky,
/// seen so many radians off the normal.
fn largest_error(
    renderer: &mut Renderer,
    material: &Material,
    integral: Integral,
    order: Order,
    angle: f32,
) -> f32 {
    let sh = sky(order);
    renderer.set_light(&uniform(&sh)).unwrap();
    let toward_eye = Vec3::new(0.0, angle.cos(), angle.sin());
    let view = View::look_at(6.0 * toward_eye, Vec3::ZERO, 0.05).unwrap();
    let error = |roughness: f32| {
        renderer.set_scene(&floor(Material { roughness, ..material.clone() }));
        let picture = renderer.pictures(&[view], &settings()).unwrap().remove(0);
        let middle = picture[(SIZE.y / 2 * SIZE.x + SIZE.x / 2) as usize].x;
        let expected = integral(&sh, roughness.into(), toward_eye.as_dvec3()) as f32;
        (middle / expected - 1.0).abs()
    };
    [0.1, 0.3, 0.5, 0.7, 0.85, 1.0].map(error).into_iter().fold(0.0, f32::max)
}

/// Whatever the order and from wherever it is seen, what is drawn is its integral: from straight above
/// within `above`, from the side within what is given for orders 1 to 4.
fn check(material: &Material, integral: Integral, above: f32, aside: [f32; 4]) {
    let mut renderer = renderer(&floor(material.clone()), &settings());
    for (order, aside) in [Order::L1, Order::L2, Order::L3, Order::L4].into_iter().zip(aside) {
        for degrees in [0.0_f32, 30.0, 60.0, 80.0] {
            let angle = degrees.to_radians();
            let error = largest_error(&mut renderer, material, integral, order, angle);
            let most = if degrees == 0.0 { above } else { aside };
            assert!(error < most, "{order:?}, {degrees}°: {error}");
        }
    }
}

/// Seen from straight above, and in light of L1, the lobe about its mean direction leaves out nothing;
/// seen from the side it is no longer round, which counts the more, the sharper light is.
#[test]
fn specular_light_is_the_integral() {
    let metal = Material { metallic: 1.0, ..Material::default() };
    check(&metal, of_metal, 0.005, [0.005, 0.06, 0.15, 0.21]);
}

/// The diffuse lobe is exact, whatever light is.
#[test]
fn light_on_plastic_is_the_integral() {
    let plastic = Material { metallic: 0.0, ..Material::default() };
    check(&plastic, of_plastic, 0.003, [0.02, 0.05, 0.05, 0.05]);
}

#[test]
fn light_through_a_sheet_is_the_integral() {
    let sheet = Material { metallic: 0.0, transmission: 1.0, ..Material::default() };
    check(&sheet, of_sheet, 0.005, [0.04, 0.12, 0.06, 0.11]);
}

/// In uniform light a white surface that absorbs nothing vanishes; rough metals lose what single
/// scattering loses, which the tracer's tests state.
#[test]
fn furnace() {
    let mut sh = Sh::dark(Order::L2);
    sh.coefficients[0] = Vec3::splat(1.0 / 0.282_094_8);
    let light = uniform(&sh);
    let view = View::look_at(Vec3::new(1.0, 2.5, 3.0), Vec3::ZERO, 0.9).unwrap();
    let smooth = Material { metallic: 0.0, roughness: 0.05, ..Material::default() };
    let rough = Material { roughness: 0.6, ..smooth.clone() };
    for (name, material, least) in [
        ("Lambert", lambert(Vec3::ONE, Vec3::ZERO), 0.998),
        ("smooth plastic", smooth, 0.99),
        ("rough plastic", rough, 0.96),
    ] {
        let scene = floor(material);
        let mut renderer = renderer(&scene, &settings());
        renderer.set_light(&light).unwrap();
        let picture = renderer.pictures(&[view], &settings()).unwrap().remove(0);
        let middle = picture[(SIZE.y / 2 * SIZE.x + SIZE.x / 2) as usize].x;
        assert!((least..1.003).contains(&middle), "{name}: {middle}");
    }
}

/// Light of which no coefficient fits a half, as a sun of 100,000 lux makes on white ground: a surface
/// of albedo ρ shows ρ times the radiance of a field that is the same everywhere. A field that is a
/// hundredth brighter is told from it; so is a picture that is stored without a pre-exposure, which halves
/// do not hold either.
#[test]
fn light_beyond_halves() {
    const ALBEDO: f32 = 0.8;
    // Y₀₀
    const CONSTANT: f32 = 0.282_094_8;
    let scene = floor(lambert(Vec3::splat(ALBEDO), Vec3::ZERO));
    let view = View::look_at(Vec3::new(1.0, 2.5, 3.0), Vec3::ZERO, 0.3).unwrap();
    let mut renderer = renderer(&scene, &settings());
    for order in [Order::L1, Order::L4] {
        for c0 in [7e4, 1e5 / std::f32::consts::PI / CONSTANT, 1e6] {
            assert!(c0 > 65_504.0, "{c0} fits");
            let color = c0 * CONSTANT * Vec3::new(1.0, 0.5, 1e-3);
            let mut worst = |share: f32, pre_exposure: f32| {
                let mut sh = Sh::dark(order);
                sh.coefficients[0] = share * color / CONSTANT;
                renderer.set_light(&uniform(&sh)).unwrap();
                let settings = Settings { pre_exposure, ..settings() };
                let picture = renderer.pictures(&[view], &settings).unwrap().remove(0);
                let error = |p: &Vec3| (*p / (ALBEDO * color) - 1.0).abs().max_element();
                // What is no number stays none.
                let larger = |a: f32, b: f32| if b <= a { a } else { b };
                picture.iter().map(error).fold(0.0, larger)
            };
            let error = worst(1.0, 1.0 / color.x);
            eprintln!("{order:?}, {c0}: {error}");
            assert!(error < 2e-3, "{order:?}, {c0}: {error}");
            assert!(worst(1.01, 1.0 / color.x) > 8e-3, "{order:?}, {c0}");
            if ALBEDO * color.x > 65_504.0 {
                let clipped = worst(1.0, 1.0);
                assert!(clipped.is_nan() || clipped > 0.1, "{order:?}, {c0}: {clipped}");
            }
        }
    }
}

/// A map whose texels let through 128/255 and all of the light, moved by half its width: on the floor
/// they lie the other way round. Only red has a say.
fn occlusion_map() -> TextureRef {
    let texels = vec![[128, 255, 255, 255], [255, 0, 0, 0]];
    TextureRef {
        image: Arc::new(Image { name: String::new(), width: 2, height: 1, texels }),
        tex_coord: 0,
        texture_from_mesh: Affine2::from_translation(Vec2::new(0.5, 0.0)),
        wrap: [Wrap::Repeat; 2],
        filter: Filter::Nearest,
    }
}

/// A material's occlusion takes from the field's light, as far as its strength says, and from no other.
#[test]
fn occlusion_takes_from_indirect_light_alone() {
    const ROUGHNESS: f32 = 0.3;
    let mut sh = Sh::dark(Order::L2);
    sh.coefficients[0] = Vec3::splat(3.0);
    let light = uniform(&sh);
    let view = View::look_at(Vec3::new(1.0, 2.5, 3.0), Vec3::ZERO, 0.9).unwrap();
    let mut renderer = renderer(&floor(Material::default()), &settings());
    renderer.set_light(&light).unwrap();
    let mut drawn = |material: &Material, settings: &Settings| {
        let mut stage = Stage::default();
        let material = stage.material(material.clone());
        stage.quad(Vec3::new(-3.0, 0.0, 3.0), Vec3::X * 6.0, Vec3::NEG_Z * 6.0, material);
        let kind = LightKind::Point { radius: 0.0 };
        let lamp = PunctualLight { kind, color: Vec3::ONE, intensity: 30.0, range: None };
        stage.light(lamp, Vec3::Y * 3.0, Vec3::NEG_Y);
        renderer.set_scene(&stage.snapshot());
        let picture = renderer.pictures(&[view], settings).unwrap().remove(0);
        assert!(picture.iter().any(|p| p.x > 0.0), "there is light");
        picture
    };
    let direct = Settings { lighting: Lighting::DIRECT, ..settings() };
    let without_maps = Settings { materials: Materials::Lambert, ..settings() };

    let diffuse = lambert(Vec3::splat(0.8), Vec3::ZERO);
    let metal = Material { metallic: 1.0, roughness: ROUGHNESS, ..Material::default() };
    for (name, material) in [("diffuse", diffuse), ("metal", metal)] {
        let left = |share: f32, n_v: f32| match name {
            "diffuse" => share,
            // Lagarde and de Rousiers 2014.
            _ => (n_v + share).powf((-16.0 * ROUGHNESS.powi(2) - 1.0).exp2()) - 1.0 + share,
        };
        for strength in [0.0, 0.5, 1.0] {
            let occluded = Material {
                occlusion_texture: Some(occlusion_map()),
                occlusion_strength: strength,
                ..material.clone()
            };
            for same in [&direct, &without_maps] {
                assert!(
                    drawn(&occluded, same) == drawn(&material, same),
                    "{name}, {strength}, {same:?}"
                );
            }
            let (open, occluded) = (drawn(&material, &settings()), drawn(&occluded, &settings()));
            if strength == 0.0 {
                assert!(occluded == open, "{name}: strength 0 changes light");
            }
            let mut seen = [0; 2];
            for (i, (pixel, open)) in (0..).zip(occluded.iter().zip(&open)) {
                let at = (UVec2::new(i % SIZE.x, i / SIZE.x).as_vec2() + 0.5) / SIZE.as_vec2();
                let (origin, direction) = view.ray(at, SIZE.x as f32 / SIZE.y as f32);
                let point = origin - direction * (origin.y / direction.y);
                // Away from the floor's edge and from where the texels meet.
                if direction.y >= 0.0 || point.abs().max_element() > 2.9 || point.x.abs() < 0.1 {
                    continue;
                }
                let is_occluded = point.x > 0.0;
                seen[usize::from(is_occluded)] += 1;
                let texel = if is_occluded { 128.0 / 255.0 } else { 1.0 };
                let share = 1.0 + strength * (texel - 1.0);
                let expected = left(share, -direction.normalize().y).min(1.0);
                let found = pixel.x / open.x;
                assert!(
                    (found - expected).abs() < 4e-3,
                    "{name}, strength {strength}, at {point}: {found}, expected {expected}"
                );
            }
            assert!(seen.iter().all(|n| *n > 500), "both texels are seen: {seen:?}");
        }
    }
}

/// Without a field there is no indirect light, and light that truncated expansions make negative is
/// none.
#[test]
fn no_light() {
    let view = View::look_at(Vec3::new(1.0, 2.5, 3.0), Vec3::ZERO, 0.9).unwrap();
    let scene = floor(lambert(Vec3::ONE, Vec3::ZERO));
    assert!(drawn(&scene, view, &settings()).iter().all(|p| *p == Vec3::ZERO));
    let mut sh = Sh::dark(Order::L2);
    sh.coefficients[0] = Vec3::splat(-3.0);
    let mut renderer = renderer(&scene, &settings());
    renderer.set_light(&uniform(&sh)).unwrap();
    let picture = renderer.pictures(&[view], &settings()).unwrap().remove(0);
    assert!(picture.iter().all(|p| *p == Vec3::ZERO));
}
