//! Every map and every factor of a material beside the path tracer: panels that fill the picture, whose
//! textures are smooth and so near that both read their finest level. With each go panels as a renderer
//! would draw them that left something out or took one thing for another: they have to be told from it.

use std::f32::consts::{PI, TAU};
use std::sync::Arc;

use crate::common::{Difference, difference, direct, traced};
use glam::{Affine2, Affine3A, Mat2, Quat, Vec2, Vec3, Vec4};
use lumencast_gather::reference::Parts;
use lumencast_picture::linear_from_srgb;
use lumencast_scene::{
    Filter, Image, LightKind, Material, Primitive, PunctualLight, Snapshot, TextureRef, Vertices,
    View, Wrap,
};
use lumencast_shade::{Gpu, Materials, Renderer, Settings, Shadows};
use lumencast_testkit::scenes::{Stage, lambert};

/// Texels along the side of a map; a texel is about 15 pixels wide.
const SIDE: u32 = 8;
/// How far a pixel may be off, of the brightest.
const TOLERANCE: f32 = 0.005;
/// And their root mean square: 0.0002 to 0.0009 were found.
const RMS: f32 = 0.002;

/// A panel as it is meant to be or with a fault.
#[derive(Clone, Debug)]
struct Panel {
    material: Material,
    /// Of vertices, one a corner; no colours where there are none.
    colors: Vec<Vec4>,
    /// Of the bitangent.
    sign: f32,
    world_from_object: Affine3A,
}

impl From<Material> for Panel {
    fn from(material: Material) -> Self {
        let world_from_object = Affine3A::IDENTITY;
        Self { material, colors: Vec::new(), sign: 1.0, world_from_object }
    }
}

impl Panel {
    /// Its normals lean outwards, as if it were bent; its second texture coordinates are the first
    /// turned by a quarter.
    fn primitive(&self) -> Primitive {
        let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(Vec2::from);
        let uv = |corner: Vec2| Vec2::new(0.5, 0.5) + 0.5 * corner * Vec2::new(1.0, -1.0);
        let normal = |corner: Vec2| (0.35 * corner).extend(1.0).normalize();
        let tangent = |corner: Vec2| {
            let n = normal(corner);
            (Vec3::X - n.x * n).normalize().extend(self.sign)
        };
        Primitive {
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            vertices: Vertices {
                positions: corners.map(|c| (c * Vec2::new(1.7, 1.2)).extend(0.0)).to_vec(),
                normals: corners.map(normal).to_vec(),
                tangents: corners.map(tangent).to_vec(),
            },
            uv: [corners.map(uv).to_vec(), corners.map(|c| uv(c.perp())).to_vec()],
            colors: self.colors.clone(),
            ..Primitive::default()
        }
    }

    /// It in the light of a lamp before it and of one behind it.
    fn scene(&self) -> Arc<Snapshot> {
        let mut stage = Stage::default();
        stage.material(self.material.clone());
        stage.primitive(self.primitive(), self.world_from_object);
        let kind = LightKind::Point { radius: 0.0 };
        let lamp =
            PunctualLight { kind, color: Vec3::new(1.0, 0.9, 0.8), intensity: 12.0, range: None };
        stage.light(lamp, Vec3::new(-0.5, 0.7, 1.8), Vec3::Y);
        stage.light(lamp, Vec3::new(0.4, -0.3, -1.5), Vec3::Y);
        stage.snapshot()
    }
}

fn view() -> View {
    View::look_at(Vec3::new(0.3, 0.2, 2.3), Vec3::ZERO, 0.7).unwrap()
}

/// There is nothing for a shadow to fall on, and what faces away from a lamp needs none to be dark.
fn settings() -> Settings {
    Settings { shadows: Shadows { resolution: 0, ..Shadows::default() }, ..direct() }
}

/// A map of four waves, one a channel, each over the whole of it in another direction.
fn waves() -> Image {
    let texel = |i: u32| {
        let at = Vec2::new((i % SIDE) as f32, (i / SIDE) as f32) / SIDE as f32;
        let wave = |along: Vec2, phase: f32| 0.5 + 0.45 * (TAU * (at.dot(along) + phase)).sin();
        [wave(Vec2::X, 0.1), wave(Vec2::Y, 0.2), wave(Vec2::ONE, 0.7), wave(Vec2::X, 0.6)]
    };
    image(texel)
}

/// Normals that lean up to 40° to either side, along x and y differently.
pub(super) fn bumps() -> Image {
    let texel = |i: u32| {
        let at = TAU * Vec2::new((i % SIDE) as f32, (i / SIDE) as f32) / SIDE as f32;
        [0.5 + 0.25 * (at.x + 0.5).sin(), 0.45 + 0.2 * (at.y + at.x).cos(), 0.85, 1.0]
    };
    image(texel)
}

fn image(texel: impl Fn(u32) -> [f32; 4]) -> Image {
    let texels = (0..SIDE * SIDE).map(|i| texel(i).map(|v| (255.0 * v).round() as u8)).collect();
    Image { name: String::new(), width: SIDE, height: SIDE, texels }
}

/// The same with other texels.
fn recoded(image: &Image, code: impl Fn([u8; 4]) -> [u8; 4]) -> Image {
    Image { texels: image.texels.iter().map(|texel| code(*texel)).collect(), ..image.clone() }
}

/// What is read of an sRGB map that is decoded once more than it should, or of a linear one that is taken
/// for sRGB.
fn decoded_twice(image: &Image) -> Image {
    recoded(image, |[r, g, b, a]| {
        let codes = Vec3::new(f32::from(r), f32::from(g), f32::from(b)) / 255.0;
        let [r, g, b] = (255.0 * linear_from_srgb(codes)).round().to_array().map(|v| v as u8);
        [r, g, b, a]
    })
}

pub(super) fn map(image: Image) -> Option<TextureRef> {
    Some(TextureRef {
        image: Arc::new(image),
        tex_coord: 0,
        texture_from_mesh: Affine2::IDENTITY,
        wrap: [Wrap::Repeat; 2],
        filter: Filter::Linear,
    })
}

/// Smooth enough for a highlight, and rough enough that it has no edges.
fn plastic() -> Material {
    Material {
        base_color: Vec4::new(0.7, 0.6, 0.5, 1.0),
        metallic: 0.0,
        roughness: 0.5,
        ..Material::default()
    }
}

/// A panel with its name, and those with a fault, each with what the fault is.
type Case = (&'static str, Panel, Vec<(&'static str, Panel)>);

fn case(name: &'static str, sound: Material, faults: Vec<(&'static str, Material)>) -> Case {
    let faults = faults.into_iter().map(|(fault, material)| (fault, material.into())).collect();
    (name, sound.into(), faults)
}

/// Draws panels, and tells how they differ from what is traced of this one.
fn beside<'a>(
    reference: &Panel,
    settings: &'a Settings,
) -> impl FnMut(&str, &Panel) -> Difference + 'a {
    let reference = traced(&reference.scene(), view(), settings, Parts::Direct, 32);
    let mut renderer = Renderer::new(Gpu::new().expect("an adapter"), settings);
    move |name, panel| {
        renderer.set_scene(&panel.scene());
        let picture = renderer.pictures(&[view()], settings).unwrap().remove(0);
        difference(name, &picture, &reference, TOLERANCE)
    }
}

/// All pixels count in the mean, for there is no edge but where a slope is steep.
fn is_same(found: &Difference) -> bool {
    found.off == 0.0 && found.rms < RMS
}

fn is_other(found: &Difference) -> bool {
    found.off > 0.1 && found.rms > 10.0 * RMS
}

/// Panels are drawn as they are traced, and faults are not.
fn judge(cases: &[Case], settings: &Settings) {
    for (name, sound, faults) in cases {
        let mut compare = beside(sound, settings);
        let found = compare(name, sound);
        assert!(is_same(&found), "{name}: {found:?}");
        for (fault, panel) in faults {
            let name = format!("{name}, {fault}");
            let found = compare(&name, panel);
            assert!(is_other(&found), "{name} is not noticed: {found:?}");
        }
    }
}

#[test]
fn color_maps() {
    let colored = Material { base_color_texture: map(waves()), ..plastic() };
    let glowing = Material {
        emissive: Vec3::new(3.0, 1.5, 0.8),
        emissive_texture: map(waves()),
        ..plastic()
    };
    let cases = [
        case(
            "base colour",
            colored.clone(),
            vec![
                ("no map", plastic()),
                ("no factor", Material { base_color: Vec4::ONE, ..colored }),
                (
                    "decoded twice",
                    Material { base_color_texture: map(decoded_twice(&waves())), ..plastic() },
                ),
            ],
        ),
        case(
            "emission",
            glowing.clone(),
            vec![
                ("no map", Material { emissive_texture: None, ..glowing.clone() }),
                ("no emission", plastic()),
                (
                    "decoded twice",
                    Material { emissive_texture: map(decoded_twice(&waves())), ..glowing },
                ),
            ],
        ),
    ];
    judge(&cases, &settings());
}

/// Unlit surfaces show their colour on the screen, whatever the exposure: as if they shone by as much as
/// becomes that, which the tracer is given instead, since to light they are black.
#[test]
fn unlit_surfaces_show_their_color() {
    let settings = Settings { pre_exposure: 0.25, ..settings() };
    let colored = Material { base_color_texture: map(waves()), ..plastic() };
    let glowing = Material {
        base_color: Vec4::W,
        specular: 0.0,
        emissive: colored.base_color.truncate() / settings.pre_exposure,
        emissive_texture: colored.base_color_texture.clone(),
        ..plastic()
    };
    let mut compare = beside(&glowing.into(), &settings);
    let unlit = Material { unlit: true, ..colored.clone() };
    let found = compare("unlit", &unlit.clone().into());
    assert!(is_same(&found), "{found:?}");
    let untextured = Material { base_color_texture: None, ..unlit };
    for (name, fault) in [("lit", colored), ("unlit, no map", untextured)] {
        let found = compare(name, &fault.into());
        assert!(is_other(&found), "{name}: {found:?}");
    }
}

/// Of diffuse surfaces alone the base colour's map is left, and nothing of the others.
#[test]
fn maps_of_lambert_surfaces() {
    let all = Material {
        base_color_texture: map(waves()),
        metallic_roughness_texture: map(waves()),
        normal_texture: map(bumps()),
        emissive: Vec3::ONE,
        emissive_texture: map(waves()),
        ..plastic()
    };
    let faults = vec![
        ("no base colour", Material { base_color_texture: None, ..all.clone() }),
        ("no emission", Material { emissive: Vec3::ZERO, ..all.clone() }),
    ];
    let settings = Settings { materials: Materials::Lambert, ..settings() };
    judge(&[case("Lambert", all, faults)], &settings);
}

#[test]
fn metallic_roughness_maps() {
    let mapped = Material {
        metallic: 0.9,
        roughness: 0.8,
        metallic_roughness_texture: map(waves()),
        ..plastic()
    };
    let exchanged = recoded(&waves(), |[r, g, b, a]| [r, b, g, a]);
    let faults = vec![
        ("no map", Material { metallic_roughness_texture: None, ..mapped.clone() }),
        ("no metal", Material { metallic: 0.0, ..mapped.clone() }),
        ("no roughness of its own", Material { roughness: 1.0, ..mapped.clone() }),
        ("exchanged", Material { metallic_roughness_texture: map(exchanged), ..mapped.clone() }),
        (
            "taken for sRGB",
            Material { metallic_roughness_texture: map(decoded_twice(&waves())), ..mapped.clone() },
        ),
    ];
    judge(&[case("metal and roughness", mapped, faults)], &settings());
}

/// What KHR_materials_specular and KHR_materials_ior say of the light that dielectrics reflect.
#[test]
fn specular_factors_and_maps() {
    // Dark, so that what is reflected is most of the light.
    let dark = Material { base_color: Vec4::new(0.05, 0.06, 0.08, 1.0), ..plastic() };
    let weak = Material { specular: 0.4, ..dark.clone() };
    let dense = Material { ior: 2.2, ..dark.clone() };
    let infinite = Material { ior: 0.0, ..dark.clone() };
    let color = Vec3::new(1.6, 0.8, 0.3);
    let tinted = Material { specular_color: color, ..dense.clone() };
    // Its F0 would be beyond 1 in red.
    let bright = Material { specular_color: 8.0 * color, ..dense.clone() };
    let strength = Material { specular_texture: map(waves()), ior: 2.2, ..dark.clone() };
    let red_for_alpha = recoded(&waves(), |[r, g, b, _]| [r, g, b, r]);
    let hue = Material { specular_color_texture: map(waves()), ..tinted.clone() };
    let cases = [
        case("strength", weak, vec![("no strength", dark.clone())]),
        case("index", dense.clone(), vec![("no index", dark.clone())]),
        case("infinite index", infinite, vec![("no index", dark)]),
        case("colour", tinted.clone(), vec![("no colour", dense.clone())]),
        case("bright colour", bright, vec![("less", tinted.clone())]),
        case(
            "map of strength",
            strength.clone(),
            vec![
                ("no map", dense),
                ("red", Material { specular_texture: map(red_for_alpha), ..strength }),
            ],
        ),
        case(
            "map of colour",
            hue.clone(),
            vec![
                ("no map", tinted),
                (
                    "decoded twice",
                    Material { specular_color_texture: map(decoded_twice(&waves())), ..hue },
                ),
            ],
        ),
    ];
    judge(&cases, &settings());
}

#[test]
fn transmission_maps() {
    let sheer = Material { transmission: 0.8, double_sided: true, ..plastic() };
    let mapped = Material { transmission_texture: map(waves()), ..sheer.clone() };
    let green_for_red = recoded(&waves(), |[_, g, b, a]| [g, g, b, a]);
    let faults = vec![
        ("no map", sheer.clone()),
        ("no factor", Material { transmission: 1.0, ..mapped.clone() }),
        ("green", Material { transmission_texture: map(green_for_red), ..mapped.clone() }),
    ];
    let opaque = Material { transmission: 0.0, ..sheer.clone() };
    let cases = [
        case("transmission", sheer, vec![("opaque", opaque)]),
        case("map of transmission", mapped, faults),
    ];
    judge(&cases, &settings());
}

/// The second set of texture coordinates, KHR_texture_transform, and what lies beyond a texture's edge.
#[test]
fn texture_coordinates() {
    let with = |change: &dyn Fn(&mut TextureRef)| {
        let mut texture = map(waves());
        texture.iter_mut().for_each(change);
        Material { base_color_texture: texture, ..plastic() }
    };
    let placed = |scale: Vec2, angle: f32, offset: Vec2| {
        let transform = Affine2::from_scale_angle_translation(scale, angle, offset);
        with(&|texture| texture.texture_from_mesh = transform)
    };
    let (scale, angle, offset) = (Vec2::new(0.9, 0.6), 0.5, Vec2::new(0.3, 0.1));
    let both = with(&|texture| {
        texture.tex_coord = 1;
        texture.texture_from_mesh = Affine2::from_translation(offset);
    });
    // Half of the panel lies beyond it.
    let moved = Affine2::from_mat2_translation(Mat2::IDENTITY, Vec2::new(0.5, -0.4));
    let wrapped = |wrap: [Wrap; 2]| {
        with(&|texture| (texture.wrap, texture.texture_from_mesh) = (wrap, moved))
    };
    let plain = || with(&|_| ());
    let cases = [
        case("second set", with(&|texture| texture.tex_coord = 1), vec![("the first", plain())]),
        case(
            "transform",
            placed(scale, angle, offset),
            vec![
                ("none", plain()),
                ("turned the other way", placed(scale, -angle, offset)),
                ("not turned", placed(scale, 0.0, offset)),
                ("not moved", placed(scale, angle, Vec2::ZERO)),
                ("not scaled", placed(Vec2::ONE, angle, offset)),
            ],
        ),
        case(
            "transform of the second set",
            both,
            vec![("of the first", placed(Vec2::ONE, 0.0, offset))],
        ),
        case(
            "mirrored and clamped",
            wrapped([Wrap::Mirror, Wrap::Clamp]),
            vec![
                ("repeated", wrapped([Wrap::Repeat; 2])),
                ("exchanged", wrapped([Wrap::Clamp, Wrap::Mirror])),
            ],
        ),
    ];
    judge(&cases, &settings());
}

#[test]
fn vertex_colors() {
    let colors = [[0.9, 0.2, 0.3], [0.2, 0.8, 0.4], [0.3, 0.3, 1.0], [1.0, 0.9, 0.1]];
    let colors = colors.map(|c| Vec3::from(c).extend(1.0)).to_vec();
    let textured = Material { base_color_texture: map(waves()), ..plastic() };
    let colored = |material: &Material| Panel { colors: colors.clone(), ..material.clone().into() };
    let cases = [
        ("vertex colours", colored(&plastic()), vec![("no colours", plastic().into())]),
        (
            "vertex colours on a map",
            colored(&textured),
            vec![("no colours", textured.clone().into()), ("no map", colored(&plastic()))],
        ),
    ];
    judge(&cases, &settings());
}

/// Normal maps of every scale, on instances as they are, turned, stretched and mirrored.
#[test]
fn normal_maps() {
    let bumpy =
        |scale: f32| Material { normal_texture: map(bumps()), normal_scale: scale, ..plastic() };
    let turned = Affine3A::from_rotation_z(0.6) * Affine3A::from_scale(Vec3::splat(1.4));
    let stretched = Affine3A::from_scale(Vec3::new(1.0, 1.3, 2.5)) * Affine3A::from_rotation_y(0.3);
    let mirrored = Affine3A::from_scale(Vec3::new(-1.0, 1.0, 1.0));
    let mut cases: Vec<Case> = Vec::new();
    for (name, world_from_object, scale, sign) in [
        ("normals", Affine3A::IDENTITY, 1.0, 1.0),
        ("flatter normals", Affine3A::IDENTITY, 0.5, -1.0),
        ("turned normals", turned, 1.5, 1.0),
        ("stretched normals", stretched, 0.6, 1.0),
        ("mirrored normals", mirrored, 0.6, -1.0),
    ] {
        let sound = Panel { sign, world_from_object, ..bumpy(scale).into() };
        let with = |material: Material| Panel { material, ..sound.clone() };
        let exchanged = recoded(&bumps(), |[r, g, b, a]| [g, r, b, a]);
        let exchanged = Material { normal_texture: map(exchanged), ..bumpy(scale) };
        let mut faults = vec![
            ("no map", with(plastic())),
            // Also what comes of bitangents that are made in the world where it is mirrored.
            ("bitangents that point the other way", Panel { sign: -sign, ..sound.clone() }),
            ("x for y", with(exchanged)),
        ];
        if scale != 1.0 {
            faults.push(("no scale", with(bumpy(1.0))));
            faults.push(("its square for the scale", with(bumpy(scale * scale))));
        }
        cases.push((name, sound, faults));
    }
    judge(&cases, &settings());
}

/// Two-sided panels seen from behind: bumps are hollows there, and what shines shines to that side too.
#[test]
fn backs() {
    let behind = |material: &Material| Panel {
        world_from_object: Affine3A::from_rotation_y(PI),
        ..material.clone().into()
    };
    let bumpy = Material {
        normal_texture: map(bumps()),
        double_sided: true,
        normal_scale: 0.7,
        ..plastic()
    };
    let glowing = Material {
        emissive: Vec3::new(3.0, 1.5, 0.8),
        emissive_texture: map(waves()),
        double_sided: true,
        ..plastic()
    };
    let one_sided = |material: &Material| Material { double_sided: false, ..material.clone() };
    let outward = recoded(&bumps(), |[r, g, b, a]| [255 - r, 255 - g, b, a]);
    let outward = Material { normal_texture: map(outward), ..bumpy.clone() };
    let dark = Material { emissive: Vec3::ZERO, ..glowing.clone() };
    let cases = [
        (
            "back of bumps",
            behind(&bumpy),
            vec![("one-sided", behind(&one_sided(&bumpy))), ("bumps as well", behind(&outward))],
        ),
        (
            "back of what shines",
            behind(&glowing),
            vec![("one-sided", behind(&one_sided(&glowing))), ("dark", behind(&dark))],
        ),
    ];
    judge(&cases, &settings());
    let cases = [(
        "back of what shines, Lambert",
        behind(&glowing),
        vec![("bright", behind(&Material { base_color: Vec4::ONE, ..glowing.clone() }))],
    )];
    judge(&cases, &Settings { materials: Materials::Lambert, ..settings() });
}

/// An unlit surface emits nothing, whatever its material says, in the Lambert model either.
#[test]
fn unlit_surfaces_shine_in_neither_model() {
    let settings = Settings { materials: Materials::Lambert, ..settings() };
    let unlit = Material { unlit: true, emissive: Vec3::ONE, ..plastic() };
    let shining = Material { unlit: false, ..unlit.clone() };
    judge(&[case("unlit, Lambert", unlit, vec![("shining", shining)])], &settings);
}

/// The normal of a panel whose instance is turned and stretched is not what its vertices' normals become
/// when they are transformed as positions are.
#[test]
fn vertex_normals_of_stretched_instances() {
    let world_from_object = Affine3A::from_scale_rotation_translation(
        Vec3::new(1.0, 1.0, 3.0),
        Quat::from_rotation_x(-0.2),
        Vec3::ZERO,
    );
    let sound = Panel { world_from_object, ..lambert(Vec3::splat(0.8), Vec3::ZERO).into() };
    let flat = Affine3A::from_rotation_x(-0.2);
    let faults = vec![("not stretched", Panel { world_from_object: flat, ..sound.clone() })];
    judge(&[("stretched", sound, faults)], &settings());
}
