//! What one looks into lumels by: a checkerboard of them, their age, and the pages that they lie on.

use std::f32::consts::PI;
use std::path::Path;
use std::sync::Arc;

use crate::common::{SIZE, renderer};
use crate::lumels::{self, PAGE, light, on_plate, point_of, scene, view};
use glam::{UVec2, Vec2, Vec3};
use lumencast_charts::{laid_out, sheets};
use lumencast_gather::path_trace::{CpuPathTracer, Options};
use lumencast_light::{FieldId, Light, Lightmap, LumelAges};
use lumencast_picture::{Picture, ToneMap};
use lumencast_scene::{LightmapSpec, Scene, Snapshot};
use lumencast_shade::{Lighting, LumelLook, Renderer, Settings, Strengths};
use lumencast_solve::{Bake, Effort, GatherOptions, bake};

const GREEN: Vec3 = Vec3::new(0.0, 1.0, 0.0);
const YELLOW: Vec3 = Vec3::new(1.0, 1.0, 0.0);
const RED: Vec3 = Vec3::new(1.0, 0.0, 0.0);

/// A look, as bright as the picture is exposed, without what changes nothing about it.
fn settings(look: LumelLook) -> Settings {
    let strengths = Strengths { still: 0.0, moving: 0.0 };
    Settings { look, strengths, lighting: Lighting::DIRECT, ..lumels::settings() }
}

fn lightmap(light: &Light) -> &Lightmap {
    light.lightmaps().next().expect("a lightmap")
}

/// Where a plate's picture shows which lumel, away from the borders of lumels: pixel, page, lumel, and
/// the share of the look's brightness that surfaces keep that are seen so much at an angle.
fn shown_lumels(scene: &Snapshot, light: &Light, number: usize) -> Vec<(usize, u32, UVec2, f32)> {
    let layout = &lightmap(light).layout;
    let eye = view(number).ray(Vec2::splat(0.5), 1.0).0;
    let shown = |pixel: u32| {
        let point = point_of(number, pixel)?;
        let on = on_plate(scene, number, point)?;
        let (page, at) = layout.surface(on.surface)?.at(on.triangle, on.weights)?;
        let beside = (at - at.round()).abs().min_element();
        let facing = (eye - point).normalize().z;
        (beside > 0.02).then_some((pixel as usize, page, at.as_uvec2(), 0.6 + 0.4 * facing))
    };
    (0..SIZE.element_product()).filter_map(shown).collect()
}

/// Asserts that plates show these colours where they have lumels, and nothing of them where not.
fn assert_shown(
    scene: &Arc<Snapshot>,
    light: &Light,
    renderer: &mut Renderer,
    look: LumelLook,
    color: impl Fn(u32, UVec2) -> Vec3,
) {
    let settings = settings(look);
    let pictures = renderer.pictures(&[0, 1, 2].map(view), &settings).unwrap();
    for (number, picture) in pictures.iter().enumerate() {
        let shown = shown_lumels(scene, light, number);
        for &(pixel, page, lumel, share) in &shown {
            let (seen, right) =
                (picture[pixel] * settings.pre_exposure, color(page, lumel) * share);
            assert!(
                seen.distance(right) < 2e-3,
                "{look:?}, {number}, {lumel}: {seen}, not {right}"
            );
        }
        assert!((shown.len() > 700) == (number < 2), "{} pixels of plate {number}", shown.len());
    }
    assert!(pictures[2].iter().all(|pixel| *pixel == Vec3::ZERO), "what moves has no lumels");
}

#[test]
fn every_other_lumel_is_dark() {
    let scene = scene();
    let light = light(&scene);
    let mut renderer = renderer(&scene, &settings(LumelLook::Lumels));
    renderer.set_light(&light).unwrap();
    assert_shown(&scene, &light, &mut renderer, LumelLook::Lumels, |_, lumel| {
        Vec3::splat(if (lumel.x + lumel.y) % 2 == 0 { 0.8 } else { 0.08 })
    });
}

/// Squares of 16 lumels of 0, 0.1, 1, 10 and 100 seconds and without light, in turn.
fn ages() -> (LumelAges, impl Fn(u32, UVec2) -> Vec3) {
    let known = [Some(0.0), Some(0.1), Some(1.0), Some(10.0), Some(100.0), None];
    let colors = [GREEN, GREEN, YELLOW, RED, RED, Vec3::ZERO];
    let columns = PAGE / 16;
    let squares = (2 * columns * columns) as usize;
    let seconds = known.into_iter().cycle().take(squares).collect();
    let color = move |page: u32, lumel: UVec2| {
        let square = lumel / 16;
        colors[((page * columns + square.y) * columns + square.x) as usize % colors.len()]
    };
    (LumelAges { field: FieldId(0), side: 16, seconds }, color)
}

#[test]
fn light_goes_from_green_to_red_as_it_grows_old() {
    let scene = scene();
    let light = light(&scene);
    let mut renderer = renderer(&scene, &settings(LumelLook::Age));
    renderer.set_light(&light).unwrap();
    let nothing = |_, _| Vec3::ZERO;
    assert_shown(&scene, &light, &mut renderer, LumelLook::Age, nothing);
    let (ages, color) = ages();
    renderer.set_lumel_ages(vec![ages]);
    assert_shown(&scene, &light, &mut renderer, LumelLook::Age, color);
    // It stays so with the light that comes next, until other ages are told.
    renderer.set_light(&light).unwrap();
    let between = 10f64.powf(-0.5);
    let layout = &lightmap(&light).layout;
    renderer.set_lumel_ages(vec![LumelAges::even(FieldId(0), layout, between)]);
    let half_way = |_, _| Vec3::new(0.5, 1.0, 0.0);
    assert_shown(&scene, &light, &mut renderer, LumelLook::Age, half_way);
    // Ages of another field are none of these lumels'.
    renderer.set_lumel_ages(vec![LumelAges::even(FieldId(1), layout, between)]);
    assert_shown(&scene, &light, &mut renderer, LumelLook::Age, nothing);
}

/// The page and the point of it, lumels from its corner, that a pixel shows where pages are shown. Two
/// pages beside each other take 0.86 of the width.
fn on_page(pixel: u32) -> Option<(u32, Vec2)> {
    let at = UVec2::new(pixel % SIZE.x, pixel / SIZE.x).as_vec2() + 0.5;
    let side = 0.86 * SIZE.x as f32 / 2.0;
    let own = (at - 0.5 * SIZE.as_vec2()) / side + Vec2::new(1.0, 0.5);
    let page = own.x.floor();
    let point = (own - Vec2::X * page) * PAGE as f32;
    let is_shown = (0.0..2.0).contains(&own.x) && (0.0..1.0).contains(&own.y);
    is_shown.then_some((page as u32, point))
}

#[test]
fn pages_show_what_lumels_have_where_they_lie() {
    let scene = scene();
    let light = light(&scene);
    let mut renderer = renderer(&scene, &settings(LumelLook::Light));
    renderer.set_light(&light).unwrap();
    let (ages, age_color) = ages();
    renderer.set_lumel_ages(vec![ages]);
    let mut draw = |look, pages, samples| {
        let settings = Settings { pages, samples, ..settings(look) };
        renderer.pictures(&[view(0)], &settings).unwrap().remove(0)
    };
    for look in [LumelLook::Light, LumelLook::Age] {
        let (without, with) = (draw(look, false, 1), draw(look, true, 1));
        let mut seen = [0, 0];
        for pixel in 0..SIZE.element_product() {
            let shown = with[pixel as usize];
            let Some((page, at)) = on_page(pixel) else {
                assert_eq!(shown, without[pixel as usize], "beside the pages");
                continue;
            };
            let right = match look {
                LumelLook::Light => lightmap(&light).read(page, at) / PI,
                _ => age_color(page, at.as_uvec2()) / lumels::settings().pre_exposure,
            };
            let most = 4e-3 * right.length() + 1e-3;
            assert!(shown.distance(right) < most, "{look:?}, {page}, {at}: {shown}, not {right}");
            seen[page as usize] += 1;
        }
        assert!(seen.iter().all(|count| *count > 1500), "{seen:?}");
    }
    // Samples of a pixel make no difference within pages.
    let (one, four) = (draw(LumelLook::Light, true, 1), draw(LumelLook::Light, true, 4));
    let middle = ((SIZE.y / 2) * SIZE.x + SIZE.x / 4) as usize;
    assert!(one[middle].distance(four[middle]) < 1e-2 * one[middle].length());
}

/// The three views of a room, left as looks-of-cornell-….png in the tests' folder of the target.
#[test]
fn a_room_is_looked_into() {
    let mut scene = Scene::builtin("cornell").unwrap();
    let view = scene.views()[0].view;
    let scene = scene.snapshot();
    let sheets = sheets(&scene, None, &|_| true).expect("charts").sheets;
    let laid_out = laid_out(&sheets, LightmapSpec::Size(128)).expect("a layout");
    let wanted = Bake {
        scene: &scene,
        volumes: &[],
        lightmap: Some(&laid_out),
        effort: Effort::of_samples(32),
        options: GatherOptions::default(),
    };
    let mut tracer = CpuPathTracer::new(Options::default()).expect("threads");
    let light = Light::new(bake(wanted, &mut tracer, |_| {}).expect("light").fields);
    let plain = Settings { size: UVec2::new(320, 240), ..Settings::default() };
    let mut renderer = renderer(&scene, &plain);
    renderer.set_light(&light).unwrap();
    let lightmap = lightmap(&light);
    // The upper half of each page has come just now, the lower one long ago.
    let side = lightmap.layout.page_size / 2;
    let seconds = [0.2, 0.2, 6.0, 6.0].map(Some).into_iter();
    let seconds = seconds.cycle().take(4 * lightmap.layout.pages as usize).collect();
    renderer.set_lumel_ages(vec![LumelAges { field: lightmap.id, side, seconds }]);
    let mut draw = |name: &str, settings: Settings| {
        let pixels = renderer.pictures(&[view], &settings).unwrap().remove(0);
        let size = settings.size;
        let picture = Picture::new(size.x, size.y, pixels.clone()).unwrap();
        let file = format!("looks-of-cornell-{name}.png");
        let file = Path::new(env!("CARGO_TARGET_TMPDIR")).join(file);
        picture.write_png(&file, ToneMap::Srgb, settings.pre_exposure).unwrap();
        pixels
    };
    let lit = draw("light", plain);
    let squares = draw("lumels", Settings { look: LumelLook::Lumels, ..plain });
    let aged = draw("age", Settings { look: LumelLook::Age, ..plain });
    let pages = draw("pages", Settings { pages: true, ..plain });
    // Walls are of one colour, and their lumels are not.
    let rough = |picture: &[Vec3]| -> f32 {
        let steps = picture.windows(2).map(|pair| pair[0].distance(pair[1]).min(1.0));
        steps.sum::<f32>() / picture.len() as f32
    };
    assert!(rough(&squares) > 3.0 * rough(&lit), "{} and {}", rough(&squares), rough(&lit));
    let count = |is: &dyn Fn(&Vec3) -> bool| aged.iter().filter(|pixel| is(pixel)).count();
    let young = count(&|p| p.y > 1.5 * p.x && p.z == 0.0);
    let old = count(&|p| p.x > 1.5 * p.y && p.z == 0.0);
    assert!(young > 5000 && old > 5000, "{young} young and {old} old pixels");
    let differ = lit.iter().zip(&pages).filter(|(a, b)| a.distance(**b) > 0.02).count();
    assert!(differ > lit.len() / 4, "{differ} pixels show pages");
}
