//! Scenes that nobody meant. Whatever they hold, every coefficient and every pixel is a number, and
//! what has a closed form nevertheless has that value.

use std::f32::consts::PI;
use std::sync::Arc;

use glam::{Affine2, Affine3A, Quat, UVec2, Vec2, Vec3};
use lumencast_gather::path_trace::MaterialModel;
use lumencast_gather::reference::{
    Film, PictureSettings, ProbeEstimate, ProbeSettings, Renderer, probe_sh,
};
use lumencast_scene::{
    AlphaMode, Environment, Filter, Image, LightKind, Material, MaterialId, Mesh, MeshId,
    Primitive, Projection, PunctualLight, Snapshot, TextureRef, Vertices, View, Wrap,
};
use lumencast_testkit::scenes::{Stage, lambert};

const BLACK: Vec3 = Vec3::ZERO;
/// ∫ Y₀₀ dω = 2√π: the first coefficient of radiance 1 from everywhere.
const C0: f32 = 3.544_907_7;
const MODELS: [MaterialModel; 2] = [MaterialModel::Full, MaterialModel::Lambert];

fn probe(scene: &Arc<Snapshot>, at: Vec3, materials: MaterialModel) -> ProbeEstimate {
    let settings = ProbeSettings { samples: 256, lattices: 8, materials, ..Default::default() };
    probe_sh(scene, &[at], &settings).unwrap().remove(0)
}

fn picture(scene: &Arc<Snapshot>, view: View, materials: MaterialModel) -> Vec<Vec3> {
    let settings =
        PictureSettings { size: UVec2::new(24, 16), materials, ..PictureSettings::default() };
    let mut film = Film::new(settings.size, 4);
    Renderer::new(scene, view, settings).unwrap().pass(&mut film, 4, &|_| true).unwrap();
    film.picture()
}

fn is_light(radiance: &[Vec3]) -> bool {
    radiance.iter().all(|v| v.is_finite() && v.cmpge(Vec3::ZERO).all())
}

fn is_estimate(e: &ProbeEstimate) -> bool {
    is_light(&e.sh[..1])
        && e.sh.iter().all(|c| c.is_finite())
        && is_light(&e.standard_error)
        && (0.0..=1.0).contains(&e.dark_back_fraction)
}

/// Gathers and draws at every place, with both models of materials, and scans what comes.
#[track_caller]
fn scan(name: &str, stage: &Stage, eyes: &[Vec3]) {
    let scene = stage.snapshot();
    for (&eye, materials) in eyes.iter().flat_map(|eye| MODELS.map(|m| (eye, m))) {
        let e = probe(&scene, eye, materials);
        assert!(is_estimate(&e), "{name}, {materials:?}, probe at {eye}: {e:?}");
        for target in [eye + Vec3::new(0.3, -1.0, 0.2), eye + Vec3::X] {
            let Some(view) = View::look_at(eye, target, 2.0) else { continue };
            let picture = picture(&scene, view, materials);
            assert!(is_light(&picture), "{name}, {materials:?}, picture from {eye}: {picture:?}");
        }
    }
}

#[test]
fn scans_find_what_they_look_for() {
    for bad in [f32::NAN, f32::INFINITY, -1e-9] {
        assert!(!is_light(&[Vec3::ONE, Vec3::new(0.0, bad, 0.0)]), "{bad}");
    }
    let mut stage = Stage::default();
    stage.environment(Environment::Constant { radiance: Vec3::ONE });
    let sound = probe(&stage.snapshot(), Vec3::ZERO, MaterialModel::Full);
    assert!(is_estimate(&sound));
    let mut bad = sound.clone();
    bad.sh[5].z = f32::NAN;
    assert!(!is_estimate(&bad));
    assert!(!is_estimate(&ProbeEstimate { dark_back_fraction: f32::NAN, ..sound }));
}

/// Each triangle with three vertices of its own.
fn triangles(corners: &[[Vec3; 3]], material: MaterialId) -> Primitive {
    let positions: Vec<_> = corners.iter().flatten().copied().collect();
    let count = corners.len() as u32;
    Primitive {
        triangles: (0..count).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect(),
        vertices: Vertices {
            normals: vec![Vec3::Y; positions.len()],
            positions,
            ..Vertices::default()
        },
        material,
        ..Primitive::default()
    }
}

/// A point, lines along and across the axes, and what rounding makes of areas too small for f32.
fn without_area() -> Vec<[Vec3; 3]> {
    let p = Vec3::new(0.3, -0.2, 0.1);
    let d = Vec3::new(0.7, 0.1, -0.4);
    vec![
        [p; 3],
        [p, p, p + d],
        [p, p + d, p],
        [p, p + Vec3::X, p + 2.0 * Vec3::X],
        [p - d, p, p + d],
        [p, p + 1e-30 * d, p + 1e-30 * Vec3::X],
        [Vec3::ZERO, Vec3::X * 1e-38, Vec3::Y * 1e-38],
        [Vec3::ZERO, Vec3::X * f32::from_bits(1), Vec3::Y * f32::from_bits(1)],
    ]
}

fn point_light(intensity: f32) -> PunctualLight {
    PunctualLight {
        kind: LightKind::Point { radius: 0.0 },
        color: Vec3::ONE,
        intensity,
        range: None,
    }
}

fn sun(illuminance: f32) -> PunctualLight {
    PunctualLight {
        kind: LightKind::Directional { angle: 0.0 },
        color: Vec3::ONE,
        intensity: illuminance,
        range: None,
    }
}

/// A room of two metres with a lamp and a point light.
fn lit_room() -> Stage {
    let mut stage = Stage::default();
    let wall = stage.material(lambert(Vec3::new(0.7, 0.5, 0.3), BLACK));
    let lamp = stage.material(lambert(BLACK, Vec3::splat(20.0)));
    stage.room(Vec3::ZERO, Vec3::splat(2.0), wall);
    stage.quad(Vec3::new(-0.3, 0.98, -0.3), 0.6 * Vec3::X, 0.6 * Vec3::Z, lamp);
    stage.light(point_light(2.0), Vec3::new(0.5, 0.4, -0.5), Vec3::X);
    stage
}

fn agree(a: &ProbeEstimate, b: &ProbeEstimate) -> bool {
    (0..a.sh.len()).all(|k| {
        let (ea, eb) = (a.standard_error[k], b.standard_error[k]);
        let tolerance = 6.0 * (ea * ea + eb * eb).map(f32::sqrt) + 1e-4 * b.sh[0];
        (a.sh[k] - b.sh[k]).abs().cmple(tolerance).all()
    })
}

#[test]
fn triangles_without_area_change_nothing() {
    let (at, p) = (Vec3::new(-0.4, 0.1, 0.2), Vec3::new(-0.3, -0.5, -0.3));
    let with = |corners: &[[Vec3; 3]]| {
        let mut stage = lit_room();
        let bright = stage.material(Material {
            double_sided: true,
            ..lambert(Vec3::splat(0.5), Vec3::splat(20.0))
        });
        stage.primitive(triangles(corners, bright), Affine3A::IDENTITY);
        stage
    };
    for materials in MODELS {
        let [without, same, lamp] =
            [vec![], without_area(), vec![[p, p + 0.6 * Vec3::Z, p + 0.6 * Vec3::X]]]
                .map(|corners| probe(&with(&corners).snapshot(), at, materials));
        assert!(agree(&same, &without), "{materials:?}: {same:?}\n{without:?}");
        assert!(!agree(&lamp, &without), "this check takes another lamp too");
    }
    scan("no area", &with(&without_area()), &[at, Vec3::new(0.3, -0.2, 0.1)]);
}

#[test]
fn emitters_without_area_give_no_light() {
    let mut stage = Stage::default();
    let white = stage.material(lambert(Vec3::ONE, BLACK));
    let bright = stage.material(lambert(BLACK, Vec3::splat(1e12)));
    stage.room(Vec3::ZERO, Vec3::splat(2.0), white);
    stage.primitive(triangles(&without_area(), bright), Affine3A::IDENTITY);
    for materials in MODELS {
        let e = probe(&stage.snapshot(), Vec3::new(-0.4, 0.1, 0.2), materials);
        assert_eq!(e.sh, vec![BLACK; 9]);
    }
    scan("dark", &stage, &[Vec3::new(-0.4, 0.1, 0.2)]);
}

/// Needles: a metre long, and wide from what f32 can tell to what it cannot.
#[test]
fn needles() {
    let mut stage = lit_room();
    let bright = stage.material(lambert(Vec3::splat(0.5), Vec3::ONE));
    let needle = |k: i32| {
        let at = Vec3::new(0.1 * k as f32 - 0.8, -0.5, 0.3);
        [at, at + Vec3::Y, at + 0.5 * Vec3::Y + 10f32.powi(-5 * k) * Vec3::X]
    };
    let needles: Vec<_> = (0..9).map(needle).collect();
    stage.primitive(triangles(&needles, bright), Affine3A::IDENTITY);
    scan("needles", &stage, &[Vec3::ZERO, needles[1][0], needles[8][2]]);
}

/// Walls drawn twice are as one wall, and let none of the light outside in.
#[test]
fn coincident_walls_are_as_one() {
    let (albedo, emission) = (Vec3::new(0.5, 0.8, 0.2), Vec3::new(1.0, 2.0, 3.0));
    let room = |walls: u32, outside: f32, gap: f32| {
        let mut stage = Stage::default();
        let wall = stage.material(lambert(albedo, BLACK));
        for k in 0..walls {
            let size = Vec3::splat(2.0) + gap * k as f32;
            stage.room(Vec3::ZERO, size, wall);
        }
        stage.light(point_light(1.0), Vec3::new(0.2, 0.1, 0.3), Vec3::X);
        stage.environment(Environment::Constant { radiance: outside * emission });
        stage
    };
    let at = Vec3::new(-0.4, 0.1, 0.2);
    for materials in MODELS {
        let one = probe(&room(1, 0.0, 0.0).snapshot(), at, materials);
        // A gap of one in the last place is as good as none.
        for gap in [0.0, f32::EPSILON] {
            let five = probe(&room(5, 1e6, gap).snapshot(), at, materials);
            assert!(agree(&five, &one), "{materials:?}: {five:?}\n{one:?}");
        }
        let mut open = room(1, 0.0, 0.0);
        open.light(point_light(0.05), Vec3::ZERO, Vec3::X);
        assert!(!agree(&probe(&open.snapshot(), at, materials), &one), "5 % more passes too");
    }
    scan("five walls", &room(5, 1e6, 0.0), &[at, Vec3::ONE, Vec3::X]);
}

/// A lamp, a mirror, glass and paper in one place, fronts to either side: which is met is anyone's
/// guess, but no light comes of it.
#[test]
fn coincident_materials_make_no_light() {
    let emission = Vec3::splat(20.0);
    let mut stage = Stage::default();
    let paper = stage.material(lambert(Vec3::splat(0.5), BLACK));
    let lamp = stage.material(lambert(BLACK, emission));
    let mirror = stage.material(Material { roughness: 0.0, ..Material::default() });
    let glass = stage.material(Material {
        metallic: 0.0,
        roughness: 0.0,
        transmission: 1.0,
        double_sided: true,
        ..Material::default()
    });
    stage.room(Vec3::ZERO, Vec3::splat(2.0), paper);
    for material in [lamp, mirror, glass, paper] {
        let (corner, x, z) = (Vec3::new(-0.5, 0.2, -0.5), Vec3::X, Vec3::Z);
        stage.quad(corner, x, z, material).quad(corner, z, x, material);
    }
    // No more than if all that one sees were the lamp, lit and mirrored for ever: L/(1 − ρ).
    let most = 2.0 * C0 * emission;
    for materials in MODELS {
        for at in [Vec3::new(0.1, -0.3, 0.0), Vec3::new(0.1, 0.7, 0.0)] {
            let e = probe(&stage.snapshot(), at, materials);
            assert!(e.sh[0].cmple(most).all(), "{materials:?} at {at}: {e:?}");
        }
    }
    scan("four in one", &stage, &[Vec3::new(0.1, -0.3, 0.0), Vec3::new(0.0, 0.2, 0.0)]);
}

/// Probes and cameras in walls, on them, at their corners and where a lamp is.
#[test]
fn eyes_inside_walls() {
    let mut stage = lit_room();
    let outside = stage.material(lambert(Vec3::splat(0.5), BLACK));
    stage.sphere(Vec3::ZERO, 3.0, 16, outside);
    stage.environment(Environment::Constant { radiance: Vec3::ONE });
    stage.light(sun(1e5), Vec3::ZERO, Vec3::NEG_ONE);
    stage.light(point_light(5.0), Vec3::new(1.0, 0.3, 0.3), Vec3::X);
    let within = Vec3::new(2.0, 0.5, 0.0);
    let e = probe(&stage.snapshot(), within, MaterialModel::Full);
    assert_eq!((e.sh[0], e.dark_back_fraction), (BLACK, 1.0));
    let eyes = [
        within,
        Vec3::X,
        Vec3::ONE,
        Vec3::new(1.0, -1.0, 0.2),
        Vec3::new(0.0, 0.98, 0.0),
        Vec3::new(0.0, 3.0, 0.0),
        Vec3::new(0.5, 0.4, -0.5),
        Vec3::new(1.0, 0.3, 0.3),
        Vec3::splat(1e9),
    ];
    scan("walls", &stage, &eyes);
}

/// Radiance of a Lambert triangle with sides of 1000 km, tilted or not, under the sun.
#[test]
fn a_triangle_of_a_thousand_kilometres_has_no_acne() {
    let albedo = Vec3::new(0.2, 0.5, 0.8);
    let side = 1e6;
    for tilt in [0.0, 0.4] {
        let turn = Quat::from_rotation_z(tilt) * Quat::from_rotation_x(0.3 * tilt);
        let normal = turn * Vec3::Y;
        let mut stage = Stage::default();
        let ground = stage.material(lambert(albedo, BLACK));
        let corners = [
            turn * Vec3::new(-0.5 * side, 0.0, 0.3 * side),
            turn * Vec3::new(0.5 * side, 0.0, 0.3 * side),
            turn * Vec3::new(0.0, 0.0, -0.6 * side),
        ];
        let mut ground = triangles(&[corners], ground);
        ground.vertices.normals = vec![normal; 3];
        stage.primitive(ground, Affine3A::IDENTITY);
        let to_sun = Vec3::new(0.5, 1.0, 0.2).normalize();
        stage.light(sun(1000.0), Vec3::ZERO, -to_sun);
        let expected = albedo * 1000.0 * normal.dot(to_sun) / PI;
        let agrees =
            |seen: &Vec3, expected: Vec3| (*seen - expected).abs().cmple(1e-3 * expected).all();
        for place in [Vec3::ZERO, Vec3::new(1e5, 0.0, 5e4)] {
            for (height, ahead) in [(2.0, 1.0), (1000.0, 1000.0), (20.0, 400.0)] {
                let eye = turn * (place + height * Vec3::Y);
                let target = turn * (place + ahead * Vec3::Z);
                let view = View::look_at(eye, target, 0.05).unwrap();
                for materials in MODELS {
                    let picture = picture(&stage.snapshot(), view, materials);
                    let all = |expected| picture.iter().all(|seen| agrees(seen, expected));
                    assert!(all(expected), "tilt {tilt}, {eye}: {picture:?}, {expected}");
                    assert!(!all(1.003 * expected));
                }
            }
        }
        let edge = corners[0].lerp(corners[1], 0.3) + normal;
        scan("a thousand kilometres", &stage, &[normal, corners[2], edge]);
    }
}

/// Where the loader still lets numbers through: vertices of 10¹⁷ m, scales of 10⁹ and none at all.
#[test]
fn sizes_beyond_reason() {
    let mesh = |stage: &mut Stage, material| {
        let corners = [[Vec3::ZERO, Vec3::X, Vec3::Z], [Vec3::Y, Vec3::X, Vec3::Z]];
        let number = MeshId(1_000);
        let primitives = vec![triangles(&corners, material)];
        let mesh = Arc::new(Mesh { primitives, ..Mesh::default() });
        for scale in [
            Vec3::ZERO,
            Vec3::new(1.0, 0.0, 1.0),
            Vec3::new(0.0, 1.0, 0.0),
            Vec3::splat(1e-9),
            Vec3::splat(1e-20),
            Vec3::new(-1.0, 1.0, 1.0),
            Vec3::new(1e9, 1e-9, 1.0),
            Vec3::splat(1e9),
            Vec3::splat(1e17),
            Vec3::splat(1e26),
        ] {
            stage.instance(number, mesh.clone(), Affine3A::from_scale(scale));
        }
    };
    let mut stage = lit_room();
    let bright = stage.material(lambert(Vec3::splat(0.5), Vec3::ONE));
    mesh(&mut stage, bright);
    stage.light(sun(1e5), Vec3::ZERO, Vec3::NEG_ONE);
    scan("sizes", &stage, &[Vec3::new(-0.5, 0.2, -0.3), Vec3::ZERO, Vec3::splat(1e9)]);
}

/// The brightest that the loader lets through, all at once, at every extreme of the materials.
#[test]
fn lights_and_materials_at_their_limits() {
    const MOST: f32 = 1e12;
    for (metallic, roughness, transmission, ior) in [
        (1.0, 0.0, 0.0, 1.5),
        (0.0, 0.0, 1.0, 0.0),
        (0.0, 1.0, 0.5, 1.0),
        (0.5, 1e-4, 0.5, 1e6),
        (0.0, 0.0, 0.0, 1.5),
    ] {
        let mut stage = Stage::default();
        let wall = Material {
            metallic,
            roughness,
            transmission,
            ior,
            specular_color: Vec3::splat(MOST),
            double_sided: true,
            alpha_mode: AlphaMode::Blend,
            base_color: Vec3::ONE.extend(0.999),
            ..Material::default()
        };
        let wall = stage.material(wall);
        let lamp = stage.material(lambert(Vec3::ONE, Vec3::splat(MOST)));
        stage.room(Vec3::ZERO, Vec3::splat(2.0), wall);
        stage.quad(Vec3::new(-0.3, 1.0 - 1e-6, -0.3), 0.6 * Vec3::X, 0.6 * Vec3::Z, lamp);
        stage.light(sun(MOST), Vec3::ZERO, Vec3::NEG_ONE);
        stage.light(point_light(MOST), Vec3::new(0.5, -1.0 + 1e-5, -0.5), Vec3::X);
        let spot = LightKind::Spot { inner: 0.0, outer: 1e-3, radius: 0.0 };
        let spot = PunctualLight { kind: spot, ..point_light(MOST) };
        stage.light(spot, Vec3::new(0.5, 0.4, -0.5), Vec3::NEG_Y);
        let name = format!("metallic {metallic}, roughness {roughness}, index {ior}");
        scan(&name, &stage, &[Vec3::ZERO, Vec3::new(0.4, -0.999, -0.5)]);
    }
}

fn texture(width: u32, height: u32, texels: Vec<[u8; 4]>) -> TextureRef {
    TextureRef {
        image: Arc::new(Image { name: String::new(), width, height, texels }),
        tex_coord: 0,
        texture_from_mesh: Affine2::IDENTITY,
        wrap: [Wrap::Repeat; 2],
        filter: Filter::Linear,
    }
}

/// A closed room whose every texture has one texel: L (1 + ρ + ρ² + ρ³).
#[test]
fn textures_of_one_texel() {
    let one = |texel| Some(texture(1, 1, vec![texel]));
    let albedo = ((188.0f32 / 255.0 + 0.055) / 1.055).powf(2.4);
    let mut stage = Stage::default();
    let wall = stage.material(Material {
        base_color_texture: one([188, 188, 188, 255]),
        metallic_roughness_texture: one([255, 255, 0, 255]),
        normal_texture: one([128, 128, 255, 255]),
        emissive_texture: one([255; 4]),
        transmission_texture: one([0; 4]),
        specular_texture: one([0; 4]),
        specular_color_texture: one([255; 4]),
        alpha_mode: AlphaMode::Mask(0.5),
        ..lambert(Vec3::ONE, Vec3::splat(3.0))
    });
    stage.room(Vec3::ZERO, Vec3::splat(2.0), wall);
    let e = probe(&stage.snapshot(), Vec3::new(0.3, 0.2, -0.1), MaterialModel::Full);
    let agrees = |albedo: f32| {
        let radiance = 3.0 * (1.0 + albedo + albedo.powi(2) + albedo.powi(3));
        let tolerance = 5.0 * e.standard_error[0] + 1e-3 * C0 * radiance;
        (e.sh[0] - C0 * radiance).abs().cmple(tolerance).all()
    };
    assert!(agrees(albedo), "{e:?}");
    assert!(!agrees(188.0 / 255.0), "this check takes linear texels too");
    scan("one texel", &stage, &[Vec3::ZERO]);
}

/// Only the last texel of 16 384 × 16 384 shines. Its pages are never touched but there.
#[test]
fn a_texture_of_16k_is_met_at_its_last_texel() {
    const SIDE: u32 = 16_384;
    let mut texels = vec![[0; 4]; (SIDE * SIDE) as usize];
    *texels.last_mut().unwrap() = [255; 4];
    let map = TextureRef { filter: Filter::Nearest, ..texture(SIDE, SIDE, texels) };
    let mut stage = Stage::default();
    let lamp = stage
        .material(Material { emissive_texture: Some(map), ..lambert(BLACK, Vec3::splat(5.0)) });
    // One texel a metre, so that the last one spans (−1, −1) to (0, 0).
    let side = SIDE as f32;
    stage.quad(Vec3::new(-side, -side, 0.0), Vec3::X * side, Vec3::Y * side, lamp);
    let look = |at: Vec2| {
        let world_from_camera = Affine3A::from_translation(at.extend(1.0));
        let projection =
            Projection::Orthographic { half_width: 0.15, half_height: 0.1, near: 0.0, far: 9.0 };
        picture(&stage.snapshot(), View { world_from_camera, projection }, MaterialModel::Full)
    };
    assert!(look(Vec2::splat(-0.5)).iter().all(|v| *v == Vec3::splat(5.0)));
    assert!(look(Vec2::new(-1.5, -0.5)).iter().all(|v| *v == BLACK));
    assert!(look(Vec2::splat(0.5 - side)).iter().all(|v| *v == BLACK));
}

/// Texture coordinates that no texture has.
#[test]
fn texture_coordinates_beyond_reason() {
    let mut stage = lit_room();
    for wrap in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp] {
        let map = TextureRef { wrap: [wrap; 2], ..texture(2, 1, vec![[255; 4], [9, 99, 199, 50]]) };
        let material = stage.material(Material {
            base_color_texture: Some(map.clone()),
            normal_texture: Some(map.clone()),
            emissive_texture: Some(map),
            alpha_mode: AlphaMode::Blend,
            ..lambert(Vec3::ONE, Vec3::ONE)
        });
        let mut part = triangles(&[[Vec3::ZERO, Vec3::X, Vec3::Z]], material);
        part.uv[0] = vec![Vec2::splat(1e17), Vec2::new(-1e17, 3e9), Vec2::new(-3e9, 0.5)];
        part.vertices.tangents = vec![Vec3::Y.extend(1.0); 3];
        stage.primitive(part, Affine3A::IDENTITY);
    }
    scan("coordinates", &stage, &[Vec3::new(0.2, 0.5, 0.2)]);
}

/// A million cubes of one mesh stand in a sky of radiance 1. They are white, so that the sky's
/// light, scattered often enough, is all that is seen, but for what the bounces cut off.
#[test]
fn a_million_instances() {
    const EACH: i32 = 100;
    let mut stage = Stage::default();
    let white = stage.material(lambert(Vec3::ONE, BLACK));
    let mut cube = Stage::default();
    cube.room(Vec3::ZERO, Vec3::splat(-0.2), white);
    let primitives =
        cube.snapshot().instances.iter().flat_map(|wall| wall.mesh.primitives.clone()).collect();
    let mesh = Arc::new(Mesh { primitives, ..Mesh::default() });
    for i in 0..EACH.pow(3) {
        let place = glam::IVec3::new(i % EACH, i / EACH % EACH, i / EACH / EACH).as_vec3();
        stage.instance(MeshId(0), mesh.clone(), Affine3A::from_translation(place));
    }
    stage.environment(Environment::Constant { radiance: Vec3::ONE });
    let scene = stage.snapshot();
    let outside = Vec3::new(-20.0, 49.5, 49.5);
    let view = View::look_at(outside, Vec3::splat(49.5), 1.0).unwrap();
    let seen = picture(&scene, view, MaterialModel::Full);
    assert!(is_light(&seen) && seen.iter().all(|v| v.x < 1.0 + 1e-4));
    let mean = seen.iter().map(|v| v.x).sum::<f32>() / seen.len() as f32;
    assert!((0.3..0.95).contains(&mean), "cubes are seen, and lit: {mean}");
    let settings = ProbeSettings { samples: 256, lattices: 2, ..ProbeSettings::default() };
    let e = probe_sh(&scene, &[Vec3::splat(49.5)], &settings).unwrap().remove(0);
    assert!(is_estimate(&e), "{e:?}");
}
