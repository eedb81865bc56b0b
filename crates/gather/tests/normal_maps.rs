//! Materials that change how light is seen rather than how much arrives: normal maps turn the normal
//! that a surface is shaded by, and unlit surfaces only block. Every check is also given what a tracer
//! would find that got a sign or a factor wrong, and has to refuse it.

use std::f32::consts::PI;
use std::sync::Arc;

use glam::{Affine2, Affine3A, Mat3, Quat, UVec2, Vec2, Vec3};
use lumencast_gather::path_trace::MaterialModel;
use lumencast_gather::reference::{Film, Frame, PictureSettings, Renderer};
use lumencast_scene::{
    Environment, Filter, Image, LightKind, Material, Primitive, Projection, PunctualLight,
    Snapshot, TextureRef, Vertices, View,
};
use lumencast_testkit::scenes::{Stage, lambert};

const BLACK: Vec3 = Vec3::ZERO;
const ALBEDO: f32 = 0.6;
/// Lux, of the sun where there is one.
const SUN: f32 = 10.0;

/// A floor with a normal map of one texel, as it is meant to be or with a fault.
#[derive(Clone, Copy, Debug)]
struct Bumpy {
    /// The map's normal, coded.
    texel: [u8; 3],
    scale: f32,
    /// The object's tangent, and the sign of its bitangent.
    tangent: Vec3,
    sign: f32,
    /// Of a floor whose front is up before and after it.
    world_from_object: Mat3,
}

/// Normals of a map that lean 30° towards +x, towards +y, and between −x and +y: ½ is 191, cos 30° is
/// 238.
const TO_X: [u8; 3] = [191, 128, 238];
const TO_Y: [u8; 3] = [128, 191, 238];
const ASIDE: [u8; 3] = [64, 191, 218];

impl Bumpy {
    const PLAIN: Self = Self {
        texel: TO_X,
        scale: 1.0,
        tangent: Vec3::X,
        sign: 1.0,
        world_from_object: Mat3::IDENTITY,
    };

    fn stage(&self, material: Material) -> Stage {
        let [x, y, z] = self.texel;
        let image =
            Image { name: String::new(), width: 1, height: 1, texels: vec![[x, y, z, 255]] };
        let map = TextureRef {
            image: Arc::new(image),
            tex_coord: 0,
            texture_from_mesh: Affine2::IDENTITY,
            wrap: Default::default(),
            filter: Filter::Nearest,
        };
        let mut stage = Stage::default();
        let material = stage.material(Material {
            normal_texture: Some(map),
            normal_scale: self.scale,
            ..material
        });
        let corners = [[-9.0, 9.0], [9.0, 9.0], [9.0, -9.0], [-9.0, -9.0]].map(Vec2::from);
        let primitive = Primitive {
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            vertices: Vertices {
                positions: corners.iter().map(|p| Vec3::new(p.x, 0.0, p.y)).collect(),
                normals: vec![Vec3::Y; 4],
                tangents: vec![self.tangent.extend(self.sign); 4],
            },
            uv: [corners.to_vec(), Vec::new()],
            material,
            ..Primitive::default()
        };
        stage.primitive(primitive, Affine3A::from_mat3(self.world_from_object));
        stage
    }

    /// The normal that it is to be shaded by: glTF 2.0, sections 3.7.2.1 and 3.9.3, in the object's
    /// space, and from there to the world as normals go.
    fn normal(&self) -> Vec3 {
        let map = Vec3::from(self.texel.map(|code| 2.0 * f32::from(code) / 255.0 - 1.0));
        let bitangent = Vec3::Y.cross(self.tangent) * self.sign;
        let Vec3 { x, y, z } = map * Vec3::new(self.scale, self.scale, 1.0);
        let object = x * self.tangent + y * bitangent + z * Vec3::Y;
        (self.world_from_object.inverse().transpose() * object).normalize()
    }

    /// What it would be shaded by, were the bitangent made of tangent and normal in the world.
    fn normal_by_world(&self) -> Vec3 {
        let m = self.world_from_object;
        let unmirrored = Self { sign: self.sign * m.determinant().signum(), ..*self };
        unmirrored.normal()
    }
}

/// Towards suns, none in a plane of symmetry.
fn suns() -> [Vec3; 3] {
    [[0.4, 1.0, 0.3], [-0.5, 1.0, 0.2], [0.3, 1.0, -0.6]].map(|to| Vec3::from(to).normalize())
}

fn sun(stage: &mut Stage, towards: Vec3) {
    let kind = LightKind::Directional { angle: 0.0 };
    let light = PunctualLight { kind, color: Vec3::ONE, intensity: SUN, range: None };
    stage.light(light, BLACK, -towards);
}

fn settings() -> PictureSettings {
    PictureSettings { size: UVec2::splat(8), bounces: 1, ..PictureSettings::default() }
}

/// Parallel rays from above or below, aslant, all of which meet what is about the origin.
fn view(eye: Vec3) -> View {
    let projection =
        Projection::Orthographic { half_width: 0.01, half_height: 0.01, near: 0.0, far: 40.0 };
    View { projection, ..View::look_at(eye, BLACK, 1.0).unwrap() }
}

const ABOVE: Vec3 = Vec3::new(1.0, 6.0, 0.5);

/// Mean radiance of a picture, and its standard error.
fn seen(scene: &Arc<Snapshot>, eye: Vec3, settings: PictureSettings) -> (f32, f32) {
    let renderer = Renderer::new(scene, view(eye), settings).unwrap();
    let mut film = Film::new(settings.size, 16);
    while film.samples() < 16 {
        renderer.pass(&mut film, 16, &|_| true).unwrap();
    }
    let pixels: Vec<f32> = film.picture().iter().map(|v| v.x).collect();
    let n = pixels.len() as f32;
    let mean = pixels.iter().sum::<f32>() / n;
    let variance = pixels.iter().map(|v| (v - mean).powi(2)).sum::<f32>() / (n - 1.0);
    (mean, (variance / n).sqrt())
}

fn frame(scene: &Arc<Snapshot>, eye: Vec3) -> Frame {
    Renderer::new(scene, view(eye), settings()).unwrap().frame(0)
}

/// Radiance of such a floor under each of the suns, and its normal, as they are found.
fn lit(floor: &Bumpy, eye: Vec3) -> ([f32; 3], Vec3) {
    let two_sided = Material { double_sided: true, ..lambert(Vec3::splat(ALBEDO), BLACK) };
    let radiance = suns().map(|towards| {
        let mut stage = floor.stage(two_sided.clone());
        sun(&mut stage, if eye.y > 0.0 { towards } else { -towards });
        seen(&stage.snapshot(), eye, settings()).0
    });
    let frame = frame(&floor.stage(two_sided).snapshot(), eye);
    (radiance, frame.samples[0].surface.unwrap().normal)
}

/// Whether it is lit by the cosine to this normal, and states it as its own.
fn is_shaded_by((radiance, stated): ([f32; 3], Vec3), normal: Vec3) -> bool {
    let near = |towards: Vec3, radiance: f32| {
        let expected = ALBEDO * SUN * normal.dot(towards).max(0.0) / PI;
        (radiance - expected).abs() <= 1e-4 * SUN
    };
    suns().into_iter().zip(radiance).all(|(towards, radiance)| near(towards, radiance))
        && (stated - normal).abs().max_element() <= 1e-4
}

/// Of every tilt, sign and scale, with the tangent along x and elsewhere.
fn floors() -> Vec<Bumpy> {
    let mut floors = Vec::new();
    for texel in [TO_X, TO_Y, ASIDE] {
        for tangent in [Vec3::X, Vec3::new(0.6, 0.0, 0.8)] {
            for sign in [1.0, -1.0] {
                for scale in [1.0, 0.5, 1.6] {
                    floors.push(Bumpy { texel, scale, tangent, sign, ..Bumpy::PLAIN });
                }
            }
        }
    }
    floors
}

/// The cosine is that to the map's normal. A floor with a fault planted in it is refused.
#[test]
fn normal_maps_turn_the_normal() {
    for floor in floors() {
        let normal = floor.normal();
        let found = lit(&floor, ABOVE);
        assert!(is_shaded_by(found, normal), "{floor:?}: {found:?}, expected {normal}");
        let faults = [
            // A flipped bitangent, which is also a sign that is ignored.
            Bumpy { sign: -floor.sign, ..floor },
            // A scale that is ignored, and one that is taken twice.
            Bumpy { scale: if floor.scale == 1.0 { 1.1 } else { 1.0 }, ..floor },
            Bumpy { scale: if floor.scale == 1.0 { 0.9 } else { floor.scale.powi(2) }, ..floor },
            // A map that is ignored, and one whose x and y are exchanged.
            Bumpy { texel: [128, 128, 255], ..floor },
            Bumpy { texel: [floor.texel[1], floor.texel[0], floor.texel[2]], ..floor },
            // A tangent that is ignored.
            Bumpy {
                tangent: if floor.tangent == Vec3::X { Vec3::NEG_Z } else { Vec3::X },
                ..floor
            },
        ];
        for (n, fault) in faults.into_iter().enumerate() {
            // What leans along x alone does so whatever the bitangent.
            if n == 0 && floor.texel == TO_X {
                continue;
            }
            assert!(!is_shaded_by(lit(&fault, ABOVE), normal), "{floor:?} takes {fault:?} too");
        }
    }
}

/// 30° towards +x of tangent space is 30° in the world, without a formula between.
#[test]
fn a_tilted_floor_is_lit_as_it_leans() {
    let lean = Vec3::new(0.5, 0.75f32.sqrt(), 0.0);
    let found = lit(&Bumpy::PLAIN, ABOVE).1;
    // Codes of eight bits are off by up to 1/255.
    assert!(found.angle_between(lean) < 6e-3, "{found}");
    // glTF's y goes up in the picture: with x right and z toward the eye, floors have it along −z.
    let found = lit(&Bumpy { texel: TO_Y, ..Bumpy::PLAIN }, ABOVE).1;
    let lean = Vec3::new(0.0, 0.75f32.sqrt(), -0.5);
    assert!(found.angle_between(lean) < 6e-3, "{found}");
    assert!(found.angle_between(Vec3::Y) > 0.5, "the check has no teeth");
}

/// A mirrored instance is the mirror image, bumps and all. A bitangent that is made in the world, of
/// a mirrored tangent and normal, would point the wrong way.
#[test]
fn mirrored_instances_mirror_their_bumps() {
    let mirrored = [Vec3::new(-1.0, 1.0, 1.0), Vec3::new(1.0, 1.0, -1.0)].map(Mat3::from_diagonal);
    let turned = Mat3::from_quat(Quat::from_rotation_y(0.7));
    let transforms = [mirrored[0], mirrored[1], turned * mirrored[0], 3.0 * mirrored[1] * turned];
    for world_from_object in transforms {
        for floor in floors() {
            let floor = Bumpy { world_from_object, ..floor };
            let (normal, found) = (floor.normal(), lit(&floor, ABOVE));
            assert!(is_shaded_by(found, normal), "{floor:?}: {found:?}, expected {normal}");
            if floor.texel != TO_X {
                assert!(!is_shaded_by(found, floor.normal_by_world()), "{floor:?}");
                let fault = Bumpy { sign: -floor.sign, ..floor };
                assert!(!is_shaded_by(lit(&fault, ABOVE), normal), "{floor:?}");
            }
            let unmirrored = Bumpy { world_from_object: Mat3::IDENTITY, ..floor };
            assert!(!is_shaded_by(found, unmirrored.normal()), "{floor:?}");
        }
    }
}

/// Turned and stretched instances turn and stretch their bumps.
#[test]
fn bumps_go_with_their_instance() {
    let turned = Mat3::from_quat(Quat::from_rotation_y(0.7));
    let stretched = Mat3::from_diagonal(Vec3::new(2.0, 1.0, 0.5));
    for world_from_object in [turned, stretched, turned * stretched] {
        for floor in floors() {
            let floor = Bumpy { world_from_object, ..floor };
            let (normal, found) = (floor.normal(), lit(&floor, ABOVE));
            assert!(is_shaded_by(found, normal), "{floor:?}: {found:?}, expected {normal}");
            let left_behind = Bumpy { world_from_object: Mat3::IDENTITY, ..floor };
            assert!(!is_shaded_by(found, left_behind.normal()), "{floor:?}");
        }
    }
}

/// From behind, a two-sided surface shows the same bumps the other way round: where it rises towards
/// those in front, it falls away from those behind.
#[test]
fn backs_have_the_bumps_of_fronts() {
    for floor in floors() {
        let (radiance, stated) = lit(&floor, -ABOVE);
        let normal = floor.normal();
        assert!(is_shaded_by((radiance, -stated), normal), "{floor:?}: {radiance:?} {stated}");
        let upright = Vec3::new(-normal.x, normal.y, -normal.z);
        assert!(!is_shaded_by((radiance, -stated), upright), "{floor:?}");
    }
}

/// A mirror with a normal map shows what lies where the map's normal sends the ray: in a sky that
/// brightens with the sine of the elevation, 1 + 2 sin.
#[test]
fn mirrors_reflect_about_the_mapped_normal() {
    let mirror = Material { roughness: 0.0, ..Material::default() };
    let view = ABOVE.normalize();
    let shows = |normal: Vec3| 1.0 + 2.0 * (2.0 * normal.dot(view) * normal - view).y;
    // Above the horizon, for below it the floor hides what there is.
    let is_sky = |floor: &Bumpy| shows(floor.normal()) > 1.1;
    let floors: Vec<_> = floors().into_iter().filter(is_sky).collect();
    assert!(floors.len() >= 18, "{}", floors.len());
    for floor in floors {
        let mut stage = floor.stage(mirror.clone());
        let (horizon, zenith) = (Vec3::ONE, Vec3::splat(3.0));
        stage.environment(Environment::Sky { zenith, horizon, ground: BLACK });
        let (mean, error) = seen(&stage.snapshot(), ABOVE, settings());
        let agrees = |value: f32| (mean - value).abs() <= 5.0 * error + 2e-3;
        let expected = shows(floor.normal());
        assert!(agrees(expected), "{floor:?}: {mean} ± {error}, expected {expected}");
        assert!(!agrees(shows(Vec3::Y)), "{floor:?}: the map might be ignored");
        // As if the normal were turned half as much.
        let half = shows((floor.normal() + Vec3::Y).normalize());
        assert!(!agrees(half), "{floor:?}: {half} is taken too");
    }
}

/// The model of materials that is compared with other renderers knows no normal maps.
#[test]
fn lambert_model_ignores_normal_maps() {
    let settings = PictureSettings { materials: MaterialModel::Lambert, ..settings() };
    for (floor, towards) in [TO_X, TO_Y, ASIDE].into_iter().zip(suns()) {
        let floor = Bumpy { texel: floor, ..Bumpy::PLAIN };
        let mut stage = floor.stage(lambert(Vec3::splat(ALBEDO), BLACK));
        sun(&mut stage, towards);
        let (mean, _) = seen(&stage.snapshot(), ABOVE, settings);
        let agrees =
            |normal: Vec3| (mean - ALBEDO * SUN * normal.dot(towards) / PI).abs() <= 1e-4 * SUN;
        assert!(agrees(Vec3::Y), "{floor:?}: {mean}");
        assert!(!agrees(floor.normal()), "{floor:?}");
    }
}

/// Grey and without light, whatever its emission says.
fn unlit() -> Material {
    Material { unlit: true, double_sided: true, ..lambert(Vec3::splat(ALBEDO), Vec3::splat(4.0)) }
}

/// A floor of some material under sun and sky.
fn under_sun_and_sky(material: Material) -> Stage {
    let mut stage = Stage::default();
    let material = stage.material(material);
    stage.quad(Vec3::new(-50.0, 0.0, 50.0), Vec3::X * 100.0, Vec3::NEG_Z * 100.0, material);
    stage.environment(Environment::Constant { radiance: Vec3::ONE });
    sun(&mut stage, suns()[0]);
    stage
}

/// An unlit surface has a colour on screens but no radiance (`docs/math.md`): it is black in sun and
/// sky, and so are its light and its first surface in a frame. The model that is compared with other
/// renderers reflects by its base colour all the same.
#[test]
fn unlit_surfaces_are_black_to_the_tracer() {
    let reflected = ALBEDO * (SUN * suns()[0].y / PI + 1.0);
    let lit = Material { unlit: false, ..unlit() };
    for (model, material, expected) in [
        (MaterialModel::Full, unlit(), 0.0),
        (MaterialModel::Full, lit.clone(), 4.0 + reflected),
        (MaterialModel::Lambert, unlit(), reflected),
        (MaterialModel::Lambert, lit, 4.0 + reflected),
    ] {
        let scene = under_sun_and_sky(material.clone()).snapshot();
        let settings = PictureSettings { materials: model, ..settings() };
        let (mean, error) = seen(&scene, ABOVE, settings);
        let agrees = |value: f32| (mean - value).abs() <= 5.0 * error + 1e-4;
        let name = format!("{model:?}, unlit {}", material.unlit);
        assert!(agrees(expected), "{name}: {mean} ± {error}, expected {expected}");
        for wrong in [0.0, ALBEDO, 4.0, reflected, 4.0 + reflected] {
            assert!(wrong == expected || !agrees(wrong), "{name}: {wrong} is taken too");
        }
    }
    let first = |material| frame(&under_sun_and_sky(material).snapshot(), ABOVE).samples[0];
    let (of_unlit, of_lit) = (first(unlit()), first(Material { unlit: false, ..unlit() }));
    assert_eq!((of_unlit.emitted, of_unlit.surface), (BLACK, None));
    assert_eq!((of_lit.emitted.x, of_lit.surface.is_some()), (4.0, true));
}

/// Under an unlit square, 2 m wide and 1 m above it, a floor has what the square leaves of the sky,
/// π (1 − F), and no sun: the square blocks all light and sends none. Beside it, a floor has the sun.
#[test]
fn unlit_surfaces_block_light_and_send_none() {
    let white = || lambert(Vec3::ONE, BLACK);
    // F of a square above its middle (Howell, configuration C-11, four times).
    let root = 2.0f32.sqrt();
    let factor = 4.0 / PI * (1.0 / root) * (1.0 / root).atan();
    let from_sun = SUN * suns()[0].y / PI;
    let radiance = |material: Material, bounces| {
        let mut stage = under_sun_and_sky(white());
        let material = stage.material(material);
        // Its middle is over the origin, which lies in its shadow as well.
        stage.quad(Vec3::new(-1.0, 1.0, -1.0), 2.0 * Vec3::X, 2.0 * Vec3::Z, material);
        let settings = PictureSettings { bounces, size: UVec2::splat(32), ..settings() };
        seen(&stage.snapshot(), Vec3::new(5.0, 1.5, 0.0), settings)
    };
    for bounces in [1, 3] {
        let (mean, error) = radiance(unlit(), bounces);
        let agrees =
            |(mean, error): (f32, f32), value: f32| (mean - value).abs() <= 5.0 * error + 1e-3;
        let expected = 1.0 - factor;
        assert!(agrees((mean, error), expected), "{mean} ± {error}, expected {expected}");
        // Were it not there for sky or sun, did it show its base colour or its emission.
        let shown = [1.0, expected + from_sun, expected + ALBEDO * factor, expected + 4.0 * factor];
        for wrong in shown {
            assert!(!agrees((mean, error), wrong), "{wrong} is taken too: {mean} ± {error}");
        }
        // Faults planted in the scene: it emits, it reflects.
        for fault in [
            Material { unlit: false, ..unlit() },
            Material { unlit: false, emissive: BLACK, ..unlit() },
        ] {
            let is_dark = bounces == 1 && fault.emissive == BLACK;
            assert_eq!(agrees(radiance(fault, bounces), expected), is_dark, "{bounces}");
        }
    }
    let (beside, error) = seen(&under_sun_and_sky(white()).snapshot(), ABOVE, settings());
    assert!((beside - (1.0 + from_sun)).abs() <= 5.0 * error + 1e-3, "{beside} ± {error}");
}
