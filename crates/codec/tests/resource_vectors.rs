//! `vectors/resources.json`, which the TypeScript client reads too.

use base64::{Engine, prelude::BASE64_STANDARD};
use glam::{UVec2, Vec2};
use lumencast_codec::{LayoutResource, PlacedSurface, Resource, ResourceHash, read_charts};
use lumencast_light::{ChartVertex, Rectangle, SurfaceId};
use serde::Deserialize;

#[derive(Deserialize)]
struct Vectors {
    charts: Vec<ChartsCase>,
    layouts: Vec<LayoutCase>,
    refused: Vec<Refused>,
}

#[derive(Deserialize)]
struct ChartsCase {
    bytes: String,
    hash: ResourceHash,
    sizes: Vec<UVec2>,
    sources: Vec<u32>,
    rectangle: Vec<u32>,
    at: Vec<f32>,
    triangles: Vec<i64>,
}

#[derive(Deserialize)]
struct LayoutCase {
    bytes: String,
    hash: ResourceHash,
    page_size: u32,
    pages: u32,
    surfaces: Vec<SurfaceCase>,
}

#[derive(Deserialize)]
struct SurfaceCase {
    node: u32,
    copy: u32,
    primitive: u32,
    back: bool,
    charts: ResourceHash,
    rectangles: Vec<[u32; 3]>,
}

#[derive(Deserialize)]
struct Refused {
    what: String,
    name: String,
    bytes: String,
    error: String,
}

fn vectors() -> Vectors {
    let text = include_str!("../../../vectors/resources.json");
    serde_json::from_str(text).expect("vectors/resources.json")
}

fn resource(base64: &str) -> Resource {
    Resource::new(BASE64_STANDARD.decode(base64).expect("base64"))
}

#[test]
fn charts_are_named_and_read_alike() {
    for case in vectors().charts {
        let resource = resource(&case.bytes);
        assert_eq!(resource.hash(), case.hash);
        let charts = read_charts(resource.bytes()).expect("charts");
        let places = case.at.chunks_exact(2).map(Vec2::from_slice);
        let vertices: Vec<ChartVertex> = case
            .sources
            .iter()
            .zip(&case.rectangle)
            .zip(places)
            .map(|((source, rectangle), at)| ChartVertex {
                source: *source,
                rectangle: *rectangle,
                at,
            })
            .collect();
        let triangles = charts.triangles.iter().flatten();
        let corners: Vec<i64> = triangles.map(|corner| i64::from(*corner as i32)).collect();
        assert_eq!((charts.sizes, charts.vertices), (case.sizes, vertices));
        assert_eq!(corners, case.triangles);
    }
}

#[test]
fn layouts_are_named_and_read_alike() {
    for case in vectors().layouts {
        let resource = resource(&case.bytes);
        assert_eq!(resource.hash(), case.hash);
        let place = |[page, x, y]: [u32; 3]| Rectangle { page, corner: UVec2::new(x, y) };
        let surface = |case: SurfaceCase| {
            let SurfaceCase { node, copy, primitive, back, charts, rectangles } = case;
            let rectangles = rectangles.into_iter().map(place).collect();
            PlacedSurface { id: SurfaceId { node, copy, primitive, back }, charts, rectangles }
        };
        let LayoutCase { page_size, pages, surfaces, .. } = case;
        let surfaces = surfaces.into_iter().map(surface).collect();
        let wanted = LayoutResource { page_size, pages, surfaces };
        assert_eq!(LayoutResource::read(resource.bytes()), Ok(wanted));
    }
}

#[test]
fn others_are_refused_with_their_kind() {
    for case in vectors().refused {
        let bytes = resource(&case.bytes).into_bytes();
        let error = match case.what.as_str() {
            "charts" => read_charts(&bytes).map(drop),
            _ => LayoutResource::read(&bytes).map(drop),
        };
        assert_eq!(error.map_err(|e| e.kind()), Err(case.error.as_str()), "{}", case.name);
    }
}
