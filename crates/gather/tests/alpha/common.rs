//! What the tests share: sheets and floors, light above them, and what floors and cameras receive.

use std::f32::consts::PI;
use std::sync::Arc;

use glam::{Affine2, Affine3A, UVec2, Vec2, Vec3, Vec4};
use lumencast_gather::path_trace::{CpuPathTracer, Levels, Options};
use lumencast_gather::reference::{Film, PictureSettings, Renderer};
use lumencast_gather::{Gather, Job, Receiver};
use lumencast_scene::{
    AlphaMode, Environment, Filter, HdrImage, Image, LightKind, Material, MaterialId, Primitive,
    Projection, PunctualLight, Snapshot, TextureRef, Vertices, View, Wrap,
};
use lumencast_testkit::scenes::{Stage, lambert};

pub(super) const BLACK: Vec3 = Vec3::ZERO;
/// Half the side of floors and sheets, metres. From one metre below a sheet, a share of about 10⁻⁴ of a
/// half space is beside it, weighed by the cosine.
pub(super) const WIDE: f32 = 100.0;
/// Opacity of the sheets that are so all over.
pub(super) const ALPHA: f32 = 0.25;
/// With a light buffer for parallel light, and without.
pub(super) const LEVELS: [Levels; 2] = [Levels::One, Levels::Two];

/// A value and its standard error.
#[derive(Clone, Copy, Debug)]
pub(super) struct Estimate {
    pub(super) mean: f32,
    pub(super) error: f32,
}

impl Estimate {
    /// Of independent values.
    pub(super) fn of(values: &[f32]) -> Self {
        let n = values.len() as f32;
        let mean = values.iter().sum::<f32>() / n;
        let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f32>() / (n - 1.0);
        Self { mean, error: (variance / n).sqrt() }
    }

    pub(super) fn agrees(&self, value: f32, slack: f32) -> bool {
        (self.mean - value).abs() <= 5.0 * self.error + slack
    }

    /// Checks it against what is expected, five standard errors and `slack` allowed, and against what
    /// is wrong.
    #[track_caller]
    pub(super) fn check(&self, name: &str, expected: f32, wrong: &[f32], slack: f32) {
        assert!(self.agrees(expected, slack), "{name}: {self:?}, expected {expected}");
        for wrong in wrong {
            assert!(!self.agrees(*wrong, slack), "{name}: {self:?}, and {wrong} is taken too");
        }
    }
}

/// Irradiance of a small piece of a surface: of many that have the same place.
pub(super) fn irradiance(
    scene: &Arc<Snapshot>,
    (position, normal): (Vec3, Vec3),
    levels: Levels,
    bounces: u32,
    samples: u32,
) -> Estimate {
    let receivers = [Receiver::point(position, normal); 32];
    let mut tracer = CpuPathTracer::new(Options { levels, ..Options::default() }).unwrap();
    let ticket = tracer.submit(Job { bounces, ..Job::new(scene.clone(), receivers, samples) });
    let sums = tracer.wait(ticket).unwrap().sums;
    Estimate::of(&sums.iter().flat_map(|sums| sums.mean().map(|e| e.x)).collect::<Vec<_>>())
}

/// Irradiance that a white floor at height 0 receives at a place: what a piece of surface receives in
/// turn that lies on it face to face.
pub(super) fn on_floor(scene: &Arc<Snapshot>, at: Vec3, levels: Levels) -> Estimate {
    irradiance(scene, (at + 1e-3 * Vec3::Y, Vec3::NEG_Y), levels, 1, 1024)
}

/// A square sheet that faces down, with texture coordinates from 0 to 1 along x and z.
pub(super) fn sheet(height: f32, half: f32, opacity: f32, material: MaterialId) -> Primitive {
    let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(Vec2::from);
    let position = |uv: &Vec2| {
        let at = half * (2.0 * *uv - 1.0);
        Vec3::new(at.x, height, at.y)
    };
    Primitive {
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        vertices: Vertices {
            positions: corners.iter().map(position).collect(),
            normals: vec![Vec3::NEG_Y; 4],
            tangents: Vec::new(),
        },
        uv: [corners.to_vec(), Vec::new()],
        colors: if opacity < 1.0 { vec![Vec4::new(1.0, 1.0, 1.0, opacity); 4] } else { Vec::new() },
        material,
        ..Primitive::default()
    }
}

/// Opacities along x, so many to a tile, with so many tiles on a surface.
pub(super) fn stripes(opacities: &[u8], tiles: f32, filter: Filter) -> TextureRef {
    let texels = opacities.iter().map(|a| [255, 255, 255, *a]).collect();
    let image = Image { name: String::new(), width: opacities.len() as u32, height: 1, texels };
    TextureRef {
        image: Arc::new(image),
        tex_coord: 0,
        texture_from_mesh: Affine2::from_scale(Vec2::splat(tiles)),
        wrap: [Wrap::Repeat; 2],
        filter,
    }
}

/// A black material of some opacity, the same on both sides.
pub(super) fn black(alpha_mode: AlphaMode, opacity: f32, texture: Option<TextureRef>) -> Material {
    Material {
        base_color: BLACK.extend(opacity),
        base_color_texture: texture,
        alpha_mode,
        double_sided: true,
        ..lambert(BLACK, BLACK)
    }
}

/// Black, of the same opacity all over.
pub(super) fn veil() -> Material {
    black(AlphaMode::Blend, ALPHA, None)
}

/// A ball of many triangles under the floor, where no light comes: light buffers and item buffers have
/// a cell a triangle, and only with small cells are there such as a triangle of a sheet covers.
pub(super) fn many_triangles() -> Stage {
    let mut stage = Stage::default();
    let hidden = stage.material(lambert(BLACK, BLACK));
    stage.sphere(Vec3::new(0.0, -3.0, 0.0), 1.0, 32, hidden);
    stage
}

/// By how much wide sheets are beside the middle, whole tiles of them, so that their diagonal is not
/// where they are looked at.
pub(super) const BESIDE: Vec3 = Vec3::new(20.0, 0.0, 0.0);

/// A white floor.
pub(super) fn floor() -> Stage {
    let mut stage = many_triangles();
    let white = stage.material(lambert(Vec3::ONE, BLACK));
    let side = 2.0 * WIDE;
    stage.quad(Vec3::new(-WIDE, 0.0, WIDE), Vec3::X * side, Vec3::NEG_Z * side, white);
    stage
}

pub(super) fn with_sheet(mut stage: Stage, height: f32, material: Material) -> Stage {
    let material = stage.material(material);
    let world_from_object = Affine3A::from_translation(BESIDE);
    stage.primitive(sheet(height, WIDE, 1.0, material), world_from_object);
    stage
}

pub(super) fn light(kind: LightKind, intensity: f32) -> PunctualLight {
    PunctualLight { kind, color: Vec3::ONE, intensity, range: None }
}

/// Form factor of a rectangle that is parallel to a surface, one metre from it, by its bounds in metres
/// along both axes (Howell, configuration C-11, for each corner).
pub(super) fn form_factor(x: [f32; 2], y: [f32; 2]) -> f32 {
    let part = |x: f32, y: f32| {
        let root = (1.0 + x * x).sqrt();
        x / root * (y / root).atan()
    };
    let corner = |x: f32, y: f32| (part(x, y) + part(y, x)) / (2.0 * PI);
    corner(x[1], y[1]) - corner(x[0], y[1]) - corner(x[1], y[0]) + corner(x[0], y[0])
}

/// A source of light, and the irradiance of a floor at the origin under it.
pub(super) struct Source {
    pub(super) name: &'static str,
    pub(super) light: fn(&mut Stage),
    pub(super) irradiance: f32,
}

/// Where lamps are, metres.
pub(super) const LAMP: Vec3 = Vec3::new(0.4, 3.0, -0.3);
/// Where parallel light comes from, not of unit length.
pub(super) const SUN: Vec3 = Vec3::new(0.6, 1.0, -0.2);

/// One source of every kind, above a sheet at a height of one metre.
pub(super) fn sources() -> Vec<Source> {
    let from_lamp = 20.0 * LAMP.y / LAMP.length().powi(3);
    let from_sun = 3.0 * SUN.y / SUN.length();
    let source = |name, irradiance, light| Source { name, light, irradiance };
    vec![
        source("point", from_lamp, |stage| {
            stage.light(light(LightKind::Point { radius: 0.0 }, 20.0), LAMP, Vec3::X);
        }),
        source("sphere", from_lamp, |stage| {
            stage.light(light(LightKind::Point { radius: 0.5 }, 20.0), LAMP, Vec3::X);
        }),
        source("spot", from_lamp, |stage| {
            let kind = LightKind::Spot { inner: 0.5, outer: 0.7, radius: 0.0 };
            stage.light(light(kind, 20.0), LAMP, -LAMP);
        }),
        source("sun without a size", from_sun, |stage| {
            stage.light(light(LightKind::Directional { angle: 0.0 }, 3.0), BLACK, -SUN);
        }),
        source("wide sun", from_sun, |stage| {
            stage.light(light(LightKind::Directional { angle: 0.3 }, 3.0), BLACK, -SUN);
        }),
        source("emissive square", PI * 4.0 * form_factor([-0.5, 0.5], [-0.5, 0.5]), |stage| {
            let lamp = stage.material(lambert(BLACK, 4.0 * Vec3::ONE));
            stage.primitive(sheet(3.0, 1.5, 1.0, lamp), Affine3A::IDENTITY);
        }),
        source("constant sky", PI, |stage| {
            stage.environment(Environment::Constant { radiance: Vec3::ONE });
        }),
        // ∫ (h + (z − h) cos θ) cos θ dω.
        source("gradient sky", PI * (1.0 + 2.0 / 3.0 * 2.0), |stage| {
            let (horizon, zenith) = (Vec3::ONE, Vec3::splat(3.0));
            stage.environment(Environment::Sky { zenith, horizon, ground: BLACK });
        }),
        source("picture of a sky", SKY_TEXEL * texel_irradiance(), |stage| {
            let mut texels = vec![BLACK; (SKY.x * SKY.y) as usize];
            texels[(SKY_AT.y * SKY.x + SKY_AT.x) as usize] = Vec3::splat(SKY_TEXEL);
            let image = Some(Arc::new(HdrImage { width: SKY.x, height: SKY.y, texels }));
            let uri = String::new();
            stage.environment(Environment::Image { uri, intensity: 1.0, rotation: 0.3, image });
        }),
    ]
}

pub(super) fn source(name: &str) -> Source {
    sources().into_iter().find(|source| source.name == name).unwrap()
}

/// A picture of a sky, and the one texel of it that shines.
pub(super) const SKY: UVec2 = UVec2::new(64, 32);
pub(super) const SKY_AT: UVec2 = UVec2::new(40, 6);
pub(super) const SKY_TEXEL: f32 = 300.0;

/// Irradiance of a floor under unit radiance from that texel, ∫ cos θ sin θ dθ dφ.
pub(super) fn texel_irradiance() -> f32 {
    let sin2 = |row: u32| (PI * row as f32 / SKY.y as f32).sin().powi(2);
    (sin2(SKY_AT.y + 1) - sin2(SKY_AT.y)) / 2.0 * 2.0 * PI / SKY.x as f32
}

/// Opacities of a mask's stripes: half of them reach the cutoff, though none is whole or nothing.
pub(super) const OPACITIES: [u8; 2] = [180, 100];
pub(super) const CUTOFF: f32 = 0.5;

/// A mask of stripes across x, half a metre each, whole from 0 on.
pub(super) fn mask(filter: Filter) -> Material {
    black(AlphaMode::Mask(CUTOFF), 1.0, Some(stripes(&OPACITIES, 2.0 * WIDE, filter)))
}

/// Whether a mask of stripes is whole at x.
pub(super) fn is_whole(x: f32) -> bool {
    (2.0 * x).rem_euclid(2.0) < 1.0
}

pub(super) fn settings() -> PictureSettings {
    PictureSettings { size: UVec2::new(32, 24), ..PictureSettings::default() }
}

/// Perspective, whose first rays a buffer answers, and orthographic; neither upright.
pub(super) fn views() -> [View; 2] {
    let perspective =
        View::look_at(Vec3::new(0.3, 4.0, 0.2), Vec3::new(0.8, 0.0, 0.0), 0.7).unwrap();
    let (half_width, half_height) = (1.3, 1.0);
    let projection = Projection::Orthographic { half_width, half_height, near: 0.0, far: 20.0 };
    [perspective, View { projection, ..perspective }]
}

pub(super) fn picture(
    scene: &Arc<Snapshot>,
    view: View,
    settings: PictureSettings,
    samples: u32,
) -> Film {
    expose(&Renderer::new(scene, view, settings).unwrap(), settings.size, samples)
}

pub(super) fn expose(renderer: &Renderer, size: UVec2, samples: u32) -> Film {
    let mut film = Film::new(size, samples);
    while film.samples() < samples {
        renderer.pass(&mut film, samples, &|_| true).unwrap();
    }
    film
}
