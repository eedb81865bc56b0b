//! Writes `vectors/resources.json`, by which every reader of layouts and charts is tested:
//! `cargo run -p lumencast-codec --example resource_vectors > vectors/resources.json`.
//!
//! `charts` and `layouts` hold bytes with their name, and what they decode to; of vertices `sources`,
//! `rectangle` and `at` (x, y by turns), of triangles three vertices each, −1 where there are no
//! lumels. `refused` holds bytes with what they were to be, and the kind of the error.

#![expect(clippy::print_stdout, reason = "its purpose is to print a file")]

use std::sync::Arc;

use base64::{Engine, prelude::BASE64_STANDARD};
use glam::{UVec2, Vec2};
use lumencast_codec::{
    LayoutResource, PlacedSurface, Resource, layout_resources, limits, read_charts,
};
use lumencast_light::{ChartVertex, Charts, Layout, Rectangle, Surface, SurfaceId};
use serde_json::{Value, json};

use crate::noise::Noise;

mod noise;

fn main() {
    let charts = [none(), square(), extremes(), patchwork()].map(Arc::new);
    let layout = layout(&charts);
    let (layouts, resources) = layout_resources(&layout);
    let empty = layout_resources(&Layout::new(1, 1, Vec::new())).0;
    let all = json!({
        "charts": resources.iter().map(charts_case).collect::<Vec<_>>(),
        "layouts": [layout_case(&layouts), layout_case(&empty)],
        "refused": refused(&layouts, &resources),
    });
    println!("{}", serde_json::to_string_pretty(&all).expect("plain values"));
}

fn vertex(source: u32, rectangle: u32, x: f32, y: f32) -> ChartVertex {
    ChartVertex { source, rectangle, at: Vec2::new(x, y) }
}

/// Of a primitive without triangles.
fn none() -> Charts {
    Charts::default()
}

/// Two triangles.
fn square() -> Charts {
    Charts {
        sizes: vec![UVec2::splat(4)],
        vertices: vec![
            vertex(0, 0, 0.5, 0.5),
            vertex(1, 0, 3.5, 0.5),
            vertex(2, 0, 3.5, 3.5),
            vertex(3, 0, 0.5, 3.5),
        ],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
    }
}

/// The largest numbers, and triangles without lumels.
fn extremes() -> Charts {
    Charts {
        sizes: vec![UVec2::new(8, 12), UVec2::new(4096, 1)],
        vertices: vec![
            vertex(9, 0, 0.0, 12.0),
            vertex(u32::MAX, 0, 8.0, 0.5),
            vertex(0, 0, 2.0 + 1.0 / 256.0, 3.5),
            vertex(7, 1, 4096.0, 0.25),
            vertex(7, 1, 0.0, 1.0),
        ],
        triangles: vec![[2, 0, 1], Charts::NOWHERE, [3, 4, 4], Charts::NOWHERE, [0, 1, 2]],
    }
}

/// Many rectangles of three vertices each.
fn patchwork() -> Charts {
    let mut noise = Noise(1);
    let mut charts = none();
    for rectangle in 0..40 {
        let size = UVec2::new(4 + noise.next() as u32 % 60, 4 + noise.next() as u32 % 60);
        let first = charts.vertices.len() as u32;
        charts.sizes.push(size);
        charts.vertices.extend((0..3).map(|_| {
            let place = 0.5 * (noise.vector().truncate() + 1.0) * size.as_vec2();
            vertex(noise.next() as u32 % 500, rectangle, place.x, place.y)
        }));
        charts.triangles.push([first, first + 2, first + 1]);
        if rectangle % 5 == 2 {
            charts.triangles.push(Charts::NOWHERE);
        }
    }
    charts
}

/// Surfaces of these charts, of which two share some; a page wide enough for each.
fn layout([none, square, extremes, patchwork]: &[Arc<Charts>; 4]) -> Layout {
    let surface = |node, copy, primitive, back, charts: &Arc<Charts>| {
        let place = |number| Rectangle { page: number % 3, corner: UVec2::new(0, 64 * number) };
        let rectangles = (0..charts.sizes.len() as u32).map(place).collect();
        let id = SurfaceId { node, copy, primitive, back };
        Surface { id, charts: charts.clone(), rectangles }
    };
    let surfaces = vec![
        surface(3, 0, 0, false, square),
        surface(3, 0, 0, true, square),
        surface(3, 0, 1, false, patchwork),
        surface(3, 2, 0, false, none),
        surface(u32::MAX, u32::MAX, u32::MAX, true, extremes),
    ];
    Layout::new(4096, 3, surfaces)
}

fn charts_case(resource: &Resource) -> Value {
    let charts = read_charts(resource.bytes()).expect("charts");
    let triangles = charts.triangles.iter().flatten().map(|corner| *corner as i32);
    json!({
        "bytes": BASE64_STANDARD.encode(resource.bytes()),
        "hash": resource.hash(),
        "sizes": charts.sizes,
        "sources": charts.vertices.iter().map(|vertex| vertex.source).collect::<Vec<_>>(),
        "rectangle": charts.vertices.iter().map(|vertex| vertex.rectangle).collect::<Vec<_>>(),
        "at": charts.vertices.iter().flat_map(|vertex| vertex.at.to_array()).collect::<Vec<_>>(),
        "triangles": triangles.collect::<Vec<_>>(),
    })
}

fn layout_case(resource: &Resource) -> Value {
    let layout = LayoutResource::read(resource.bytes()).expect("a layout");
    let surface = |PlacedSurface { id, charts, rectangles }: &PlacedSurface| {
        let rectangle = |Rectangle { page, corner }: &Rectangle| [*page, corner.x, corner.y];
        json!({
            "node": id.node,
            "copy": id.copy,
            "primitive": id.primitive,
            "back": id.back,
            "charts": charts,
            "rectangles": rectangles.iter().map(rectangle).collect::<Vec<_>>(),
        })
    };
    json!({
        "bytes": BASE64_STANDARD.encode(resource.bytes()),
        "hash": resource.hash(),
        "page_size": layout.page_size,
        "pages": layout.pages,
        "surfaces": layout.surfaces.iter().map(surface).collect::<Vec<_>>(),
    })
}

/// Bytes that are no charts or no layout.
fn refused(layout: &Resource, charts: &[Resource]) -> Vec<Value> {
    let largest = charts.iter().map(Resource::bytes).max_by_key(|bytes| bytes.len());
    let (layout, charts) = (layout.bytes(), largest.expect("charts"));
    let mut cases: Vec<(&str, &str, Vec<u8>)> = Vec::new();
    // One rectangle of 1 × 1, and one vertex; the end is the number of triangles.
    let vertex = |vertex: &[u8]| [&[1, 1, 1, 1, 1], vertex, &[0]].concat();
    // Three vertices in two rectangles, and one triangle.
    let triangle = |triangle: &[u8]| {
        let vertices = [0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0];
        [&[1, 2, 1, 1, 1, 1, 3], &vertices[..], &[1], triangle].concat()
    };
    let claim = |first: &[u8]| [first, &[0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0x7F]].concat();
    for (name, bytes) in [
        ("nothing", Vec::new()),
        ("another version", [&[2], &charts[1..]].concat()),
        ("bytes after the end", [charts, &[0]].concat()),
        ("more rectangles than bytes", claim(&[1])),
        ("more vertices than bytes", claim(&[1, 0])),
        ("more triangles than bytes", claim(&[1, 0, 0])),
        ("a rectangle without rows", vec![1, 1, 1, 0, 0, 0]),
        ("a rectangle of 4097 columns", vec![1, 1, 0x81, 0x20, 1, 0, 0]),
        ("a vertex of rectangle 1 of 1", vertex(&[0, 1, 0, 0])),
        ("a vertex right of its rectangle", vertex(&[0, 0, 0x80, 0x08, 0])),
        ("a vertex left of its rectangle", vertex(&[0, 0, 1, 0])),
        ("a vertex below its rectangle", vertex(&[0, 0, 0, 0x82, 0x04])),
        ("a vertex of source -1", vertex(&[1, 0, 0, 0])),
        ("a vertex of source 2^32", vertex(&[0x80, 0x80, 0x80, 0x80, 0x20, 0, 0, 0])),
        ("a triangle of vertex 3 of 3", triangle(&[1, 2, 6])),
        ("a triangle of vertex -1", triangle(&[2, 2, 4])),
        ("a triangle in two rectangles", triangle(&[1, 2, 4])),
    ] {
        cases.push(("charts", name, bytes));
    }
    for end in (0..charts.len()).step_by(37) {
        cases.push(("charts", "charts cut short", charts[..end].to_vec()));
    }
    // Pages of 16 lumels a side, so many surfaces; each of no rectangles unless told.
    let surface = |id: &[u8], rectangles: &[u8]| [id, &[7; 32], rectangles].concat();
    let pages = |count: u8, surfaces: &[u8]| [&[1, 16, 2, count], surfaces].concat();
    let two = |ids: [[u8; 4]; 2]| pages(2, &ids.map(|id| surface(&id, &[0])).concat());
    for (name, bytes) in [
        ("nothing", Vec::new()),
        ("another version", [&[2], &layout[1..]].concat()),
        ("bytes after the end", [layout, &[0]].concat()),
        ("pages of 4097 lumels a side", vec![1, 0x81, 0x20, 1, 0]),
        ("more surfaces than bytes", claim(&[1, 16, 2])),
        ("more rectangles than bytes", pages(1, &surface(&[0; 4], &[0xFF, 0x7F]))),
        ("a third side", pages(1, &surface(&[0, 0, 0, 2], &[0]))),
        ("a node of 2^32", pages(1, &surface(&[0x80, 0x80, 0x80, 0x80, 0x10, 0, 0, 0], &[0]))),
        ("a surface twice", two([[1, 0, 0, 0], [1, 0, 0, 0]])),
        ("sides out of order", two([[1, 0, 0, 1], [1, 0, 0, 0]])),
        ("nodes out of order", two([[2, 0, 0, 0], [1, 5, 5, 1]])),
        ("a rectangle on page 2 of 2", pages(1, &surface(&[0; 4], &[1, 2, 0, 0]))),
        ("a rectangle beside its page", pages(1, &surface(&[0; 4], &[1, 0, 16, 0]))),
        ("a rectangle below its page", pages(1, &surface(&[0; 4], &[1, 0, 0, 16]))),
    ] {
        cases.push(("layout", name, bytes));
    }
    for end in (0..layout.len()).step_by(37) {
        cases.push(("layout", "a layout cut short", layout[..end].to_vec()));
    }
    cases.into_iter().map(|(what, name, bytes)| refusal(what, name, &bytes)).collect()
}

fn refusal(what: &str, name: &str, bytes: &[u8]) -> Value {
    assert!(bytes.len() < limits::RESOURCE_BYTES);
    let error = match what {
        "charts" => read_charts(bytes).map(drop),
        _ => LayoutResource::read(bytes).map(drop),
    };
    let kind = error.expect_err(name).kind();
    json!({ "what": what, "name": name, "bytes": BASE64_STANDARD.encode(bytes), "error": kind })
}
