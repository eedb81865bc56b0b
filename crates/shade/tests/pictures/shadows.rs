//! Shadows beside the path tracer's, surfaces and edges counted apart: no acne where light arrives, no
//! light between a thing and its shadow, and nothing to see where one map takes over from another.

use std::path::Path;
use std::sync::Arc;

use crate::common::{direct, drawn, traced};
use glam::{Affine2, UVec2, Vec3};
use lumencast_gather::reference::Parts;
use lumencast_picture::{Picture, ToneMap};
use lumencast_scene::{
    AlphaMode, Filter, Image, LightKind, Material, MaterialId, PunctualLight, Snapshot, TextureRef,
    View, Wrap,
};
use lumencast_shade::{Settings, Shadows};
use lumencast_testkit::scenes::{Stage, lambert};

const SIZE: UVec2 = UVec2::new(192, 128);
/// Pixels so near to one that is lit otherwise are edges.
const EDGE: u32 = 2;
/// Shares of light that count as all and as none of it.
const LIT: f32 = 0.97;
const DARK: f32 = 0.03;
/// Of a pixel that is lit or dark: how far off it is wrong.
const WRONG: f32 = 0.1;

fn settings() -> Settings {
    Settings { size: SIZE, ..direct() }
}

/// Numbers of pixels.
#[derive(Clone, Copy, Debug, Default)]
struct Counted {
    lit: usize,
    dark: usize,
    edge: usize,
    /// Lit ones that are too dark.
    acne: usize,
    /// Dark ones that are lit.
    leaks: usize,
    /// Mean difference of light shares at edges.
    edge_error: f32,
}

impl Counted {
    fn assert_clean(&self, name: &str) {
        assert!(self.lit > 500 && self.dark > 100, "{name} shows light and shadow: {self:?}");
        // Where two surfaces meet that are both lit, the filter takes one for the other's shadow within
        // a texel: a tenth of the light of a few pixels.
        assert!(self.acne * 1000 < self.lit && self.leaks == 0, "{name}: {self:?}");
        assert!(self.edge_error < 0.04, "{name}: {self:?}");
    }
}

/// Which share of the light arrives at each pixel; nothing where there would be hardly any.
fn shares(picture: &[Vec3], unshadowed: &[Vec3]) -> Vec<Option<f32>> {
    let most = unshadowed.iter().map(|p| p.max_element()).fold(0.0, f32::max);
    let share = |(p, all): (&Vec3, &Vec3)| {
        (all.max_element() > 0.02 * most).then(|| p.max_element() / all.max_element())
    };
    picture.iter().zip(unshadowed).map(share).collect()
}

/// Judges the shadows of a picture that `settings` draw by those that the tracer finds.
fn count(name: &str, scene: &Arc<Snapshot>, view: View, settings: &Settings) -> Counted {
    let none = Shadows { resolution: 0, ..settings.shadows };
    let unshadowed = drawn(scene, view, &Settings { shadows: none, ..*settings });
    let truth = shares(&traced(scene, view, settings, Parts::Direct, 64), &unshadowed);
    let found = shares(&drawn(scene, view, settings), &unshadowed);

    let index = |x: u32, y: u32| (y * SIZE.x + x) as usize;
    let grey = |share: Option<f32>| share.map_or(Vec3::Z * 0.2, Vec3::splat);
    let side_by_side = Picture::from_fn(2 * SIZE.x, SIZE.y, |x, y| match x < SIZE.x {
        true => grey(found[index(x, y)]),
        false => grey(truth[index(x - SIZE.x, y)]),
    });
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("shadows {name}.png"));
    side_by_side.write_png(&path, ToneMap::Srgb, 1.0).unwrap();

    let mut counted = Counted::default();
    for y in 0..SIZE.y {
        for x in 0..SIZE.x {
            let Some((share, expected)) = found[index(x, y)].zip(truth[index(x, y)]) else {
                continue;
            };
            let around = (y.saturating_sub(EDGE)..=(y + EDGE).min(SIZE.y - 1)).flat_map(|y| {
                (x.saturating_sub(EDGE)..=(x + EDGE).min(SIZE.x - 1)).map(move |x| (x, y))
            });
            let mut around = around.map(|(x, y)| truth[index(x, y)]);
            if around.clone().all(|share| share.is_some_and(|share| share > LIT)) {
                counted.lit += 1;
                counted.acne += usize::from(share < 1.0 - WRONG);
            } else if around.all(|share| share.is_some_and(|share| share < DARK)) {
                counted.dark += 1;
                counted.leaks += usize::from(share > WRONG);
            } else {
                counted.edge += 1;
                counted.edge_error += (share - expected).abs();
            }
        }
    }
    counted.edge_error /= counted.edge.max(1) as f32;
    eprintln!("{name}: {counted:?}, {}", path.display());
    counted
}

fn light(kind: LightKind, intensity: f32) -> PunctualLight {
    PunctualLight { kind, color: Vec3::ONE, intensity, range: None }
}

/// A box whose fronts face outwards, standing at `foot`.
fn block(stage: &mut Stage, foot: Vec3, size: Vec3, material: MaterialId) {
    stage.room(foot + 0.5 * size.y * Vec3::Y, size * Vec3::new(-1.0, 1.0, 1.0), material);
}

/// On a floor: a box, a board of 2 cm on edge, a ball, all in contact with it, and a wall behind.
fn furnished(lit: impl FnOnce(&mut Stage)) -> Arc<Snapshot> {
    let mut stage = Stage::default();
    let grey = lambert(Vec3::splat(0.7), Vec3::ZERO);
    let grey = stage.material(Material { double_sided: true, ..grey });
    stage.quad(Vec3::new(-4.0, 0.0, 4.0), Vec3::X * 8.0, Vec3::NEG_Z * 8.0, grey);
    stage.quad(Vec3::new(-4.0, 0.0, -3.0), Vec3::X * 8.0, Vec3::Y * 5.0, grey);
    block(&mut stage, Vec3::new(-1.3, 0.0, -0.6), Vec3::new(0.9, 1.2, 0.9), grey);
    block(&mut stage, Vec3::new(0.3, 0.0, 0.4), Vec3::new(0.02, 0.8, 1.4), grey);
    stage.sphere(Vec3::new(1.6, 0.6, -0.8), 0.6, 48, grey);
    lit(&mut stage);
    stage.snapshot()
}

fn view() -> View {
    View::look_at(Vec3::new(0.8, 2.6, 5.2), Vec3::new(0.0, 0.5, 0.0), 0.75).unwrap()
}

/// Every kind of light, from high and from so low that it grazes the floor.
#[test]
fn no_acne_and_nothing_floats() {
    let spot = |outer| LightKind::Spot { inner: 0.5 * outer, outer, radius: 0.0 };
    for (name, kind, intensity) in [
        ("point", LightKind::Point { radius: 0.0 }, 60.0),
        ("spot", spot(0.9), 60.0),
        ("wide spot", spot(1.4), 60.0),
        ("sun", LightKind::Directional { angle: 0.0 }, 4.0),
    ] {
        for (height, from) in
            [("high", Vec3::new(2.5, 4.0, 2.0)), ("low", Vec3::new(3.6, 1.0, 1.2))]
        {
            let scene = furnished(|stage| {
                stage.light(light(kind, intensity), from, Vec3::new(-0.4, 0.4, -0.3) - from);
            });
            let name = format!("{height} {name}");
            count(&name, &scene, view(), &settings()).assert_clean(&name);
        }
    }
}

/// Edges stay where they are, and shadows at the feet of what casts them, where a texel is as large as
/// what casts them is thick.
#[test]
fn coarse_maps_shift_nothing() {
    let (sun, from) = (LightKind::Directional { angle: 0.0 }, Vec3::new(3.6, 2.0, 1.2));
    let scene = furnished(|stage| {
        stage.light(light(sun, 4.0), Vec3::ZERO, -from);
    });
    let shadows = Shadows { resolution: 384, ..Shadows::default() };
    let counted = count("coarse sun", &scene, view(), &Settings { shadows, ..settings() });
    // Points moved off the floor by two texels, as a bias against acne would: 0.038.
    assert!(counted.edge_error < 0.028 && counted.leaks == 0, "{counted:?}");
}

/// Along a street with posts, seen from one end: every cascade has its part, and none shows where it
/// ends. With steady maps, which are half as sharp, it is the same.
#[test]
fn cascades_meet_unseen() {
    let mut stage = Stage::default();
    let grey = stage.material(lambert(Vec3::splat(0.7), Vec3::ZERO));
    stage.quad(Vec3::new(-10.0, 0.0, 2.0), Vec3::X * 20.0, Vec3::NEG_Z * 82.0, grey);
    for post in 0_u8..16 {
        let foot = Vec3::new(-2.0, 0.0, -4.5 * f32::from(post));
        block(&mut stage, foot, Vec3::new(1.2, 4.0, 1.8), grey);
    }
    let sun = light(LightKind::Directional { angle: 0.0 }, 4.0);
    stage.light(sun, Vec3::ZERO, Vec3::new(0.8, -0.9, -0.1));
    let view = View::look_at(Vec3::new(6.0, 5.0, 4.0), Vec3::new(-1.0, 0.0, -16.0), 0.8).unwrap();
    for steady in [false, true] {
        let shadows = Shadows { steady, ..Shadows::default() };
        let name = format!("street, steady {steady}");
        let settings = Settings { shadows, ..settings() };
        count(&name, &stage.snapshot(), view, &settings).assert_clean(&name);
    }
}

/// A fence of stripes that its texture cuts out.
fn fence(alpha_mode: AlphaMode) -> Material {
    let texels = vec![[255, 255, 255, 255], [255, 255, 255, 0]];
    let image = Image { name: String::new(), width: 2, height: 1, texels };
    let stripes = TextureRef {
        image: Arc::new(image),
        tex_coord: 0,
        texture_from_mesh: Affine2::from_scale((4.0, 1.0).into()),
        wrap: [Wrap::Repeat; 2],
        filter: Filter::Nearest,
    };
    let grey = lambert(Vec3::splat(0.7), Vec3::ZERO);
    Material { base_color_texture: Some(stripes), alpha_mode, double_sided: true, ..grey }
}

/// What a texture masks casts the shadow of what it leaves, under every kind of light.
#[test]
fn textures_cut_shadows_out() {
    for (name, kind, intensity) in [
        ("point", LightKind::Point { radius: 0.0 }, 60.0),
        ("spot", LightKind::Spot { inner: 0.4, outer: 0.9, radius: 0.0 }, 60.0),
        ("sun", LightKind::Directional { angle: 0.0 }, 4.0),
    ] {
        for alpha_mode in [AlphaMode::Mask(0.5), AlphaMode::Blend] {
            let mut stage = Stage::default();
            let grey = stage.material(lambert(Vec3::splat(0.7), Vec3::ZERO));
            stage.quad(Vec3::new(-4.0, 0.0, 4.0), Vec3::X * 8.0, Vec3::NEG_Z * 8.0, grey);
            let fence = stage.material(fence(alpha_mode));
            stage.quad(Vec3::new(-2.0, 0.0, -1.0), Vec3::X * 4.0, Vec3::Y * 1.6, fence);
            let from = Vec3::new(1.0, 3.0, -4.0);
            stage.light(light(kind, intensity), from, Vec3::new(0.0, 0.0, 0.4) - from);
            let name = format!("{name} through {alpha_mode:?}");
            count(&name, &stage.snapshot(), view(), &settings()).assert_clean(&name);
        }
    }
}

/// The count finds acne where maps are coarse and compared as they are, leaks where what casts a
/// shadow is moved from where it stands.
#[test]
fn planted_faults_are_counted() {
    let sun = light(LightKind::Directional { angle: 0.0 }, 4.0);
    let lit = |stage: &mut Stage| {
        stage.light(sun, Vec3::ZERO, Vec3::new(-0.8, -0.5, -0.3));
    };
    let none = Shadows { resolution: 0, ..Shadows::default() };
    let scene = furnished(lit);
    let unshadowed =
        count("without maps", &scene, view(), &Settings { shadows: none, ..settings() });
    assert!(unshadowed.leaks > 100 && unshadowed.acne == 0, "{unshadowed:?}");
    let coarse = Shadows { resolution: 16, filter_radius: 8.0, ..Shadows::default() };
    let coarse = count("coarse maps", &scene, view(), &Settings { shadows: coarse, ..settings() });
    assert!(coarse.leaks + coarse.acne > 100, "{coarse:?}");
}
