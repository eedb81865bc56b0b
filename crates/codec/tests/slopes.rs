//! Slopes: how irradiance at lumels depends on the normal, told in pages of their own.

use std::sync::Arc;

use glam::Vec3;
use lumencast_codec::{
    Coding, LightFile, LightmapShape, LumelCoding, LumelDecoder, LumelEncoder, Qp, SceneInfo,
    UpdateInfo,
};
use lumencast_light::{Field, FieldId, Layout, Lightmap, STEEPEST, Told};

const SIDE: u32 = 40;

/// Two pages of soft light, whose slopes turn across them.
fn lightmap() -> Lightmap {
    let layout = Arc::new(Layout::new(SIDE, 2, Vec::new()));
    let mut lightmap = Lightmap::dark(FieldId(3), layout).with_slopes(true);
    for lumel in 0..lightmap.irradiance.len() {
        let (x, y) = (lumel as u32 % SIDE, lumel as u32 / SIDE);
        let (u, v) = (x as f32 / SIDE as f32, y as f32 / SIDE as f32);
        lightmap.irradiance[lumel] = 90.0 * Vec3::new(1.0 + u, 2.0, 3.0 - v);
        lightmap.told_mut(Told::Slopes)[lumel] =
            Vec3::new((3.0 * u).sin(), 2.0 * v - 2.0, 1.0 - 2.0 * u);
    }
    lightmap
}

/// A lightmap as it comes out, and how many tiles told of it.
fn decoded(lightmap: &Lightmap, coding: LumelCoding) -> (Lightmap, usize) {
    let shape = LightmapShape::of(lightmap, coding.coding());
    let mut encoder = LumelEncoder::new(shape.clone(), coding);
    let frames = encoder.encode(lightmap, UpdateInfo::default(), |_| true).expect("frames");
    let mut shown = shape.dark(lightmap.id);
    for frame in &frames {
        let tile = shape.tile(frame.region).expect("a tile");
        let light = LumelDecoder::new(shape.coding, tile.size).decode(&frame.bytes).expect("light");
        tile.put(light, &mut shown);
    }
    (shown, frames.len())
}

/// Root of the mean square of what two lightmaps' slopes differ by.
fn apart(one: &Lightmap, other: &Lightmap) -> f32 {
    let [one, other] = [one, other].map(|lightmap| lightmap.slopes.as_ref().expect("slopes"));
    let squares: f32 = one.iter().zip(other).map(|(a, b)| a.distance_squared(*b)).sum();
    (squares / one.len() as f32).sqrt()
}

#[test]
fn slopes_come_out_nearly_as_they_went_in() {
    let lightmap = lightmap();
    let qp = Qp::new(15).expect("a parameter");
    for (coding, most) in [
        (LumelCoding::Halves, 2e-3),
        (LumelCoding::H264(qp), 0.06),
        (LumelCoding::H264Stacked(qp), 0.05),
    ] {
        let (shown, tiles) = decoded(&lightmap, coding);
        assert_eq!(tiles, 4, "two pages, and their slopes");
        let apart = apart(&lightmap, &shown);
        assert!(apart < most, "{coding:?}: {apart}");
    }
    let mut other = lightmap.clone();
    other.told_mut(Told::Slopes)[7] = Vec3::splat(-STEEPEST);
    assert!(apart(&other, &decoded(&lightmap, LumelCoding::Halves).0) > 0.05, "it can fail");
}

/// Whoever knows nothing of slopes reads the first tiles, which are those of a lightmap without any.
#[test]
fn irradiance_is_told_as_without_slopes() {
    let with = lightmap();
    let without = with.clone().with_slopes(false);
    for coding in [LumelCoding::Halves, LumelCoding::H264(Qp::for_pages(512))] {
        let frames = [&with, &without].map(|lightmap| {
            let shape = LightmapShape::of(lightmap, coding.coding());
            let mut encoder = LumelEncoder::new(shape, coding);
            encoder.encode(lightmap, UpdateInfo::default(), |_| true).expect("frames")
        });
        let bytes = frames.each_ref().map(|frames| {
            frames.iter().take(2).map(|frame| (frame.region, &frame.bytes)).collect::<Vec<_>>()
        });
        assert_eq!(bytes[0], bytes[1]);
        assert_eq!((frames[0].len(), frames[1].len()), (4, 2));
    }
    let told = |lightmap: &Lightmap| {
        serde_json::to_value(LightmapShape::of(lightmap, Coding::H264)).expect("a shape")
    };
    let (mut of_slopes, flat) = (told(&with), told(&without));
    assert_eq!(of_slopes["slopes"].take(), serde_json::json!(true));
    of_slopes.as_object_mut().expect("an object").remove("slopes");
    assert_eq!(of_slopes, flat);
}

#[test]
fn files_keep_slopes() {
    let field = Field::from(lightmap());
    let scene = SceneInfo { name: "box".into(), root: String::new() };
    let file = LightFile::of_fields(scene, "test", [&field], UpdateInfo::default());
    let read = LightFile::read(&file.write()).expect("a file").fields().expect("fields");
    let [Field::Lightmap(read)] = &read[..] else { panic!("another field") };
    let field = field.as_lightmap().expect("a lightmap");
    assert!(apart(field, read) < 2e-3);
    assert!(apart(field, &field.clone().with_slopes(true)) > 0.5, "it can fail");
}
