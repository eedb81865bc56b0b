//! Surfaces on pages: each point has one place, nothing overlaps, equal things are equal.

use std::collections::HashMap;
use std::sync::Arc;

use glam::{Affine3A, Quat, UVec2, Vec2, Vec3};
use lumencast_charts::{
    ChartError, Extended, LaidOut, Lumel, MOST_PAGES, PAGE, Sheets, UnionFind, chart_count,
    extended, laid_out, lumels, sheets,
};
use lumencast_light::{Charts, Surface};
use lumencast_scene::{
    BUILTINS, LightmapSpec, Material, Mesh, MeshId, Primitive, Scene, Snapshot, Vertices,
};
use lumencast_testkit::scenes::{Stage, lambert};

fn cut(scene: &Snapshot) -> Sheets {
    sheets(scene, None, &|_| true).unwrap()
}

fn grey() -> Material {
    lambert(Vec3::splat(0.5), Vec3::ZERO)
}

/// The lumel that a point of a page lies in.
fn page_lumel(surface: &Surface, rectangle: u32, at: UVec2) -> (u32, UVec2) {
    let place = surface.rectangles[rectangle as usize];
    (place.page, place.corner + at)
}

/// Checks what everyone relies on: rectangles lie on pages, and a lumel belongs to one surface and to
/// one part of it.
fn check(scene: &Snapshot, laid_out: &LaidOut) {
    let layout = &laid_out.layout;
    let mut owners = HashMap::new();
    for (number, surface) in layout.surfaces().iter().enumerate() {
        let of_node = |i: &&lumencast_scene::Instance| i.node.0 == surface.id.node;
        let instance = scene.instances.iter().find(of_node).unwrap();
        let primitive = &instance.mesh.primitives[surface.id.primitive as usize];
        let world = |v: u32| {
            instance.world_from_object.transform_point3(primitive.vertices.positions[v as usize])
        };
        assert_eq!(surface.charts.triangles.len(), primitive.triangles.len());
        for (rectangle, size) in surface.rectangles.iter().zip(&surface.charts.sizes) {
            assert!(rectangle.page < layout.pages);
            assert!((rectangle.corner + *size).max_element() <= layout.page_size);
        }
        let (mut flat, mut curved) = (0.0, 0.0);
        for (number, own) in (0..).zip(&primitive.triangles) {
            if !primitive.has_area(own) {
                assert_eq!(surface.charts.corners(number), None);
                continue;
            }
            let corners = surface.charts.corners(number).expect("a place for what has an area");
            assert_eq!(&corners.map(|corner| corner.source), own);
            assert!(corners.iter().all(|corner| corner.rectangle == corners[0].rectangle));
            let [a, b, c] = corners.map(|corner| corner.at);
            flat += 0.5 * (b - a).perp_dot(c - a).abs();
            let [a, b, c] = own.map(world);
            curved += 0.5 * (b - a).cross(c - a).length();
        }
        let share = flat * laid_out.texel_of(surface.id).powi(2) / curved;
        assert!((0.9..1.1).contains(&share), "{:?}: lumels for {share} of its area", surface.id);
        for lumel in lumels(&surface.charts) {
            assert!(lumel.weights.min_element() >= 0.0);
            assert!((lumel.weights.element_sum() - 1.0).abs() < 1e-5);
            let before = owners.insert(page_lumel(surface, lumel.rectangle, lumel.at), number);
            assert_eq!(before, None, "a lumel of two surfaces");
            let (_, at) = surface.charts.at(lumel.triangle, lumel.weights).unwrap();
            let off = (at - lumel.at.as_vec2() - 0.5).abs().max_element();
            assert!(off <= if lumel.holds_middle { 0.04 } else { 0.501 }, "{lumel:?}: {off}");
        }
        let clusters = clusters(&lumels(&surface.charts));
        assert_eq!(clusters, chart_count(&surface.charts), "{:?}: charts lie apart", surface.id);
    }
}

/// Number of groups of lumels that have at least two others between them: what filtering reads, and what
/// shares its colour as it is sent, is of one chart.
fn clusters(lumels: &[Lumel]) -> usize {
    let place = |lumel: &Lumel| (lumel.rectangle, lumel.at.x as i32, lumel.at.y as i32);
    let mut sets = UnionFind::default();
    let numbers: HashMap<_, _> = lumels.iter().map(|lumel| (place(lumel), sets.add())).collect();
    let mut count = numbers.len();
    for ((rectangle, x, y), number) in &numbers {
        let near = (-2..=2).flat_map(|i| (-2..=2).map(move |j| (*rectangle, x + i, y + j)));
        for other in near.filter_map(|at| numbers.get(&at)) {
            count -= usize::from(sets.unite(*number, *other));
        }
    }
    count
}

#[test]
fn built_in_scenes_fill_one_page_of_their_own_size() {
    // The paper's table 4.1.
    let sizes = [("cornell", 256), ("door", 512), ("tomb", 1024)];
    for name in BUILTINS {
        let mut scene = Scene::open(name).unwrap();
        let snapshot = scene.snapshot();
        let Sheets { sheets, notes } = cut(&snapshot);
        assert_eq!(notes, Vec::<String>::new());
        let spec = scene.lightmap().unwrap();
        let laid_out = laid_out(&sheets, spec).unwrap();
        check(&snapshot, &laid_out);
        assert_eq!(laid_out.layout.pages, 1);
        for (surface, sheet) in laid_out.layout.surfaces().iter().zip(&sheets) {
            assert_eq!(
                (surface.id, chart_count(&surface.charts)),
                (sheet.id, sheet.charts()),
                "{name}"
            );
        }
        assert!(sizes.contains(&(name, laid_out.layout.page_size)), "{name}");
        assert_eq!(spec, LightmapSpec::Size(laid_out.layout.page_size));
        let covered: usize =
            laid_out.layout.surfaces().iter().map(|s| lumels(&s.charts).len()).sum();
        let share = covered as f32 / laid_out.layout.page_size.pow(2) as f32;
        assert!(share > 0.5, "{name}: {share} of the page is covered");
    }
}

/// What moves has no lumels.
#[test]
fn still_surfaces_alone_have_lumels() {
    let mut scene = Scene::open("cornell").unwrap();
    let names: HashMap<u32, String> =
        scene.nodes().map(|node| (node.id.0, node.name.to_owned())).collect();
    let mut found: Vec<&str> =
        cut(&scene.snapshot()).sheets.iter().map(|s| names[&s.id.node].as_str()).collect();
    found.dedup();
    assert_eq!(
        found,
        ["room", "tall box"],
        "not the sphere, which moves, nor the lamp, which is black"
    );
}

#[test]
fn a_texel_is_as_large_as_it_is_asked_to_be() {
    let mut stage = Stage::default();
    let material = stage.material(grey());
    stage.quad(Vec3::ZERO, 4.0 * Vec3::X, 2.0 * Vec3::Y, material);
    let snapshot = stage.snapshot();
    let laid_out = laid_out(&cut(&snapshot).sheets, LightmapSpec::Texel(0.1)).unwrap();
    assert_eq!((laid_out.texel, laid_out.coarser), (0.1, false));
    assert_eq!(
        (laid_out.layout.pages, laid_out.layout.page_size),
        (1, 128),
        "no more than it takes"
    );
    check(&snapshot, &laid_out);
    let [surface] = laid_out.layout.surfaces() else { panic!("one surface") };
    let [size] = surface.charts.sizes[..] else { panic!("one rectangle") };
    // Its own 40 by 20, half a lumel in, and padding.
    assert!(size.max_element() <= 40 + 5 && size.min_element() <= 20 + 5, "{size}");
    // The middle of its first lumels lies on its border, and it goes on straight.
    let at = |x: f32, y: f32| {
        let [v, w] = [Vec2::new(4.0, 0.0), Vec2::new(4.0, 2.0)];
        let w_ = y / w.y;
        let v_ = (x - w_ * w.x) / v.x;
        surface.charts.at(0, Vec3::new(1.0 - v_ - w_, v_, w_)).unwrap().1
    };
    let origin = at(0.0, 0.0);
    assert!((origin.fract() - 0.5).abs().max_element() < 1e-3, "{origin}");
    assert!(((at(2.0, 0.5) - at(1.0, 0.5)).length() - 10.0).abs() < 1e-3);
}

/// Lumels are a decimetre large, or smaller where that takes no more of a page.
#[test]
fn scenes_that_ask_for_nothing_fill_their_pages() {
    let of = |side: f32| {
        let mut stage = Stage::default();
        let material = stage.material(grey());
        stage.quad(Vec3::ZERO, side * Vec3::X, side * Vec3::Y, material);
        let snapshot = stage.snapshot();
        let laid_out = laid_out(&cut(&snapshot).sheets, None).unwrap();
        check(&snapshot, &laid_out);
        assert!(laid_out.layout.pages == 1 && !laid_out.coarser);
        (laid_out.layout.page_size, laid_out.texel)
    };
    for little in [0.01, 15.0] {
        let (size, texel) = of(little);
        assert_eq!(size, 256);
        assert!((0.7..1.0).contains(&(little / texel / size as f32)), "{texel}");
    }
    assert_eq!(of(30.0), (512, 0.07));
    let (size, texel) = of(45.0);
    assert_eq!(size, 512);
    assert!((0.088..0.093).contains(&texel), "{texel}");
    let (size, texel) = of(100.0);
    assert_eq!(size, 1024);
    assert!((0.0977..0.0985).contains(&texel), "as small as a page allows: {texel}");
}

/// On a page of 256² most of these would be padding.
#[test]
fn many_little_things_have_a_larger_page() {
    let of = |side: i32| {
        let mut stage = Stage::default();
        let material = stage.material(grey());
        stage.quad(Vec3::ZERO, 0.3 * Vec3::X, 0.4 * Vec3::Y, material);
        let mesh = stage.snapshot().instances[0].mesh.clone();
        for k in 1..side * side {
            let at = Vec3::new((k % side) as f32, (k / side) as f32, 0.0);
            stage.instance(MeshId(0), mesh.clone(), Affine3A::from_translation(at));
        }
        let snapshot = stage.snapshot();
        let laid_out = laid_out(&cut(&snapshot).sheets, None).unwrap();
        check(&snapshot, &laid_out);
        let area = 0.12 * (side * side) as f32;
        let covered = area / laid_out.texel.powi(2) / laid_out.layout.lumel_count() as f32;
        (laid_out.layout.page_size, covered)
    };
    for (side, page) in [(12, 256), (30, 512), (50, 1024)] {
        let (size, covered) = of(side);
        assert_eq!(size, page);
        assert!(covered > 0.25, "{side}: {covered}");
    }
}

/// Nine surfaces of 100 × 100 m: at a decimetre each nearly fills a page.
#[test]
fn lumels_grow_where_pages_end() {
    let mut stage = Stage::default();
    let material = stage.material(grey());
    for k in 0..9 {
        let corner = Vec3::new(0.0, 10.0 * k as f32, 0.0);
        stage.quad(corner, 100.0 * Vec3::X, 100.0 * Vec3::Z, material);
    }
    let snapshot = stage.snapshot();
    let laid_out = laid_out(&cut(&snapshot).sheets, LightmapSpec::Texel(0.1)).unwrap();
    check(&snapshot, &laid_out);
    assert!(laid_out.coarser && laid_out.texel > 0.1, "{}", laid_out.texel);
    assert!(laid_out.layout.pages <= MOST_PAGES && laid_out.layout.page_size == PAGE);
}

/// Two roads, so long, and a hut beside them. The roads' lumels are as large as make them fit a page, the
/// hut's a decimetre.
#[test]
fn what_is_larger_than_a_page_has_larger_lumels() {
    for side in [150.0, 2000.0] {
        let mut stage = Stage::default();
        let material = stage.material(grey());
        for x in [-side, 0.0] {
            let corner = Vec3::new(x, 0.0, 0.0);
            stage.quad(corner, side * Vec3::Z, 0.02 * side * Vec3::X, material);
        }
        stage.room(Vec3::ZERO, Vec3::new(8.0, 3.0, 6.0), material);
        let scene = stage.snapshot();
        let sheets = cut(&scene).sheets;
        let all = laid_out(&sheets, LightmapSpec::Texel(0.1)).unwrap();
        check(&scene, &all);
        assert!(!all.coarser && all.texel == 0.1 && all.layout.pages <= 2, "{}", all.layout.pages);
        assert_eq!(all.larger.len(), 2);
        let least = side / PAGE as f32;
        for texel in all.larger.values() {
            assert!((least..1.01 * least).contains(texel), "{texel} m on {side} m");
        }
        let usual = laid_out(&sheets, None).unwrap();
        check(&scene, &usual);
        assert!(usual.texel <= 0.1 && usual.larger == all.larger, "{}", usual.texel);

        // The roads come later.
        let (roads, hut) = sheets.split_at(2);
        let before = laid_out(hut, LightmapSpec::Size(PAGE)).unwrap();
        let Extended { laid_out: after, left_out } = extended(&before, |_| true, roads).unwrap();
        check(&scene, &after);
        assert!(left_out.is_empty() && after.larger == all.larger, "{:?}", after.larger);
        let gone = extended(&after, |id| id == hut[0].id, &[]).unwrap().laid_out;
        assert!(gone.larger.is_empty() && gone.texel == before.texel);
    }
}

/// A sphere whose charts do not fit one page.
#[test]
fn a_primitive_may_have_several_rectangles() {
    let mut stage = Stage::default();
    let material = stage.material(grey());
    stage.sphere(Vec3::ZERO, 20.0, 48, material);
    let snapshot = stage.snapshot();
    let laid_out = laid_out(&cut(&snapshot).sheets, LightmapSpec::Texel(0.05)).unwrap();
    check(&snapshot, &laid_out);
    assert!(!laid_out.coarser && laid_out.layout.pages < MOST_PAGES);
    let [surface] = laid_out.layout.surfaces() else { panic!("one surface") };
    assert!(surface.rectangles.len() > 1 && laid_out.layout.pages > 1);
}

/// Two equal instances and a larger one of one mesh.
#[test]
fn equal_instances_share_charts() {
    let mut stage = Stage::default();
    let material = stage.material(grey());
    stage.sphere(Vec3::ZERO, 1.0, 8, material);
    let mesh = stage.snapshot().instances[0].mesh.clone();
    for (scale, turn) in [(1.0, 0.7), (2.0, 0.0)] {
        let place = Affine3A::from_scale_rotation_translation(
            Vec3::splat(scale),
            Quat::from_rotation_y(turn),
            5.0 * Vec3::X,
        );
        stage.instance(MeshId(0), mesh.clone(), place);
    }
    let snapshot = stage.snapshot();
    let laid_out = laid_out(&cut(&snapshot).sheets, LightmapSpec::Texel(0.1)).unwrap();
    check(&snapshot, &laid_out);
    let [one, other, larger] = laid_out.layout.surfaces() else { panic!("three surfaces") };
    assert!(Arc::ptr_eq(&one.charts, &other.charts));
    assert!(!Arc::ptr_eq(&one.charts, &larger.charts));
}

#[test]
fn backs_have_lumels_on_the_charts_that_they_name() {
    let mut stage = Stage::default();
    let material = stage.material(grey());
    stage.sphere(Vec3::ZERO, 1.0, 8, material);
    let mut all = cut(&stage.snapshot()).sheets;
    let front = all[0].clone();
    assert!(front.charts() > 1);
    let mut kept = vec![false; front.charts()];
    kept[0] = true;
    all.push(front.back(kept));
    let laid_out = laid_out(&all, LightmapSpec::Size(256)).unwrap();
    let [_, back] = laid_out.layout.surfaces() else { panic!("two surfaces") };
    assert!(back.id.back);
    assert_eq!(chart_count(&back.charts), 1);
    for (number, triangle) in back.charts.triangles.iter().enumerate() {
        assert_eq!(*triangle != Charts::NOWHERE, front.chart_of(number) == Some(0));
    }
}

/// A strip of `columns` squares with second coordinates.
fn strip(columns: u32, uv: impl Fn(Vec2) -> Vec2) -> Primitive {
    let mut primitive = Primitive::default();
    for column in 0..=columns {
        for y in [0.0, 1.0] {
            primitive.vertices.positions.push(Vec3::new(column as f32, y, 0.0));
            primitive.vertices.normals.push(Vec3::Z);
            primitive.uv[1].push(uv(Vec2::new(column as f32 / columns as f32, y)));
        }
    }
    for column in 0..columns {
        let a = 2 * column;
        primitive.triangles.extend([[a, a + 2, a + 3], [a, a + 3, a + 1]]);
    }
    primitive
}

/// The sheets of a strip of four columns with these second coordinates.
fn sheets_of_strip(uv: impl Fn(Vec2) -> Vec2) -> Sheets {
    let mut stage = Stage::default();
    stage.material(grey());
    stage.primitive(strip(4, uv), Affine3A::IDENTITY);
    cut(&stage.snapshot())
}

/// A file's own second coordinates cut the surface where they are sound: here in the middle.
#[test]
fn sound_second_coordinates_are_used() {
    let charts_of = |primitive: Primitive| {
        let mut stage = Stage::default();
        stage.material(grey());
        stage.primitive(primitive, Affine3A::IDENTITY);
        let Sheets { sheets, notes } = cut(&stage.snapshot());
        assert_eq!((sheets.len(), notes), (1, vec![]));
        check(&stage.snapshot(), &laid_out(&sheets, LightmapSpec::Texel(0.1)).unwrap());
        sheets[0].charts()
    };
    let whole = Primitive { uv: Default::default(), ..strip(4, |at| at) };
    // The right half has vertices of its own on the edge where it meets the left one.
    let mut parted = whole.clone();
    for vertex in [4, 5] {
        parted.vertices.positions.push(whole.vertices.positions[vertex]);
        parted.vertices.normals.push(Vec3::Z);
    }
    let right = parted.triangles[4..].iter_mut().flatten();
    right.filter(|v| **v < 6).for_each(|v| *v += 6);
    let across = [0.0, 0.2, 0.4, 0.8, 1.0, 0.6];
    parted.uv[1] = (0..12).map(|v| Vec2::new(across[v / 2], (v % 2) as f32)).collect();
    assert_eq!((charts_of(whole), charts_of(parted)), (1, 2));
}

/// Others are named, and the surface is cut as if it had none.
#[test]
fn bad_second_coordinates_are_named_and_left_alone() {
    let mut bare = strip(4, |at| at);
    bare.uv = Default::default();
    let mut stage = Stage::default();
    stage.material(grey());
    stage.primitive(bare, Affine3A::IDENTITY);
    let lay = |sheets: &Sheets| laid_out(&sheets.sheets, LightmapSpec::Size(64)).unwrap().layout;
    let expected = lay(&cut(&stage.snapshot()));
    let outside = sheets_of_strip(|at| 1.5 * at);
    assert!(outside.notes[0].contains("leave the square"), "{:?}", outside.notes);
    let folded = sheets_of_strip(|at| Vec2::new((2.0 * at.x - 1.0).abs(), at.y));
    assert!(folded.notes[0].contains("overlap"), "{:?}", folded.notes);
    for sheets in [outside, folded] {
        assert_eq!(sheets.sheets.len(), 1);
        assert_eq!(lay(&sheets), expected);
    }
}

/// Triangles without area have no place, and all others have the place that they would have without
/// them. Vertices are named by the file's numbers.
#[test]
fn triangles_without_area_keep_their_numbers() {
    let laid_out_of = |primitive: &Primitive| {
        let mut stage = Stage::default();
        stage.material(grey());
        stage.primitive(primitive.clone(), Affine3A::IDENTITY);
        let layout =
            laid_out(&cut(&stage.snapshot()).sheets, LightmapSpec::Size(64)).unwrap().layout;
        Charts::clone(&layout.surfaces()[0].charts)
    };
    let plain = strip(3, |at| 0.1 + 0.8 * at);
    let mut more = plain.clone();
    more.triangles.insert(0, [0, 2, 4]);
    more.triangles.insert(3, [1, 3, 3]);
    more.sources = (0..8).map(|vertex| 100 + vertex / 2).collect();
    let (expected, mut charts) = (laid_out_of(&plain), laid_out_of(&more));
    for number in [3, 0] {
        assert_eq!(charts.triangles.remove(number), Charts::NOWHERE);
    }
    for (vertex, plain) in charts.vertices.iter_mut().zip(&expected.vertices) {
        assert_eq!(vertex.source, 100 + plain.source / 2);
        vertex.source = plain.source;
    }
    assert_eq!(charts, expected);
}

/// Vertices of a primitive that nothing good can be said of.
fn bad_meshes() -> Vec<(&'static str, Primitive)> {
    let of = |positions: Vec<Vec3>, triangles: Vec<[u32; 3]>| Primitive {
        vertices: Vertices {
            normals: vec![Vec3::Z; positions.len()],
            positions,
            tangents: Vec::new(),
        },
        triangles,
        ..Primitive::default()
    };
    let fan: Vec<Vec3> = (0..12).map(|k| Quat::from_rotation_x(0.5 * k as f32) * Vec3::Y).collect();
    let line = (0..9).map(|k| k as f32 * Vec3::X).collect();
    let soup = |count: u32, size: f32| {
        let corner = |k: u32| Vec3::new((k * 7919 % 1009) as f32, (k * 104_729 % 997) as f32, 0.0);
        let positions = (0..count)
            .flat_map(|k| [Vec3::ZERO, size * Vec3::X, size * Vec3::Y].map(|p| corner(k) + p));
        of(positions.collect(), (0..count).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]).collect())
    };
    vec![
        ("no triangles", of(vec![], vec![])),
        ("no area", of(line, vec![[0, 1, 2], [3, 4, 5], [6, 7, 8]])),
        // All pages of a book on one spine.
        (
            "an edge of many triangles",
            of([vec![Vec3::ZERO, Vec3::X], fan].concat(), (2..14).map(|k| [0, 1, k]).collect()),
        ),
        (
            "the same triangle thrice, and its back",
            of(
                vec![Vec3::ZERO, Vec3::X, Vec3::Y],
                vec![[0, 1, 2], [0, 1, 2], [1, 2, 0], [0, 2, 1]],
            ),
        ),
        ("splinters", soup(500, 1e-6)),
        ("far apart", of(vec![Vec3::ZERO, 1e8 * Vec3::X, 1e8 * Vec3::Y], vec![[0, 1, 2]])),
    ]
}

#[test]
fn bad_meshes_have_lumels_or_are_named() {
    for (name, primitive) in bad_meshes() {
        let triangles = primitive.triangles.len();
        let mut stage = Stage::default();
        let material = stage.material(grey());
        stage.quad(Vec3::ZERO, Vec3::X, Vec3::Y, material);
        stage.primitive(primitive, Affine3A::IDENTITY);
        let Sheets { sheets, notes } = cut(&stage.snapshot());
        match &sheets[..] {
            // There is nothing to light.
            [_] if triangles == 0 => assert!(notes.is_empty(), "{notes:?}"),
            [_] => assert!(notes.iter().any(|n| n.starts_with("mesh 1, primitive 0")), "{name}"),
            [_, bad] => {
                let laid_out = laid_out(&sheets, LightmapSpec::Size(256)).unwrap();
                let surface = laid_out.layout.surface(bad.id).unwrap();
                assert_eq!(surface.charts.triangles.len(), triangles, "{name}");
                lumels(&surface.charts);
            }
            _ => panic!("{name}: {} sheets", sheets.len()),
        }
    }
}

/// A mesh of a million parts is named, and not unwrapped: that would take minutes.
#[test]
fn meshes_of_too_many_charts_are_named() {
    let mut stage = Stage::default();
    let material = stage.material(grey());
    stage.quad(Vec3::ZERO, Vec3::X, Vec3::Y, material);
    let corner = |k: u32| Vec3::new((k % 1000) as f32, (k / 1000) as f32, 1.0);
    let triangle = |k| [Vec3::ZERO, 0.5 * Vec3::X, 0.5 * Vec3::Y].map(|p| corner(k) + p);
    let positions = (0..1_000_000).flat_map(triangle).collect();
    let primitive = Primitive {
        vertices: Vertices { positions, ..Vertices::default() },
        triangles: (0..1_000_000).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]).collect(),
        ..Primitive::default()
    };
    stage.primitive(primitive, Affine3A::IDENTITY);
    let scene = stage.snapshot();
    let watch = |progress: lumencast_charts::Progress| {
        assert!(progress.done < 1_000_000, "its triangles were unwrapped");
        true
    };
    let Sheets { sheets, notes } = sheets(&scene, None, &watch).unwrap();
    assert_eq!((sheets.len(), notes.len()), (1, 1), "{notes:?}");
    assert!(notes[0].contains("mesh 1, primitive 0") && notes[0].contains("1000000 charts"));
}

#[test]
fn nothing_to_lay_out_is_said() {
    assert_eq!(laid_out(&[], LightmapSpec::default()), Err(ChartError::NoArea));
    let nothing = Snapshot::clone(&Stage::default().snapshot());
    assert!(cut(&nothing).sheets.is_empty());
}

#[test]
fn cutting_tells_its_progress_and_ends_when_told() {
    let mut scene = Scene::open("tomb").unwrap();
    let snapshot = scene.snapshot();
    let most = std::sync::Mutex::new(0.0f32);
    let watch = |progress: lumencast_charts::Progress| {
        let share = progress.done as f32 / progress.total as f32;
        assert!((0.0..=1.0).contains(&share));
        let mut most = most.lock().unwrap();
        *most = most.max(share);
        true
    };
    sheets(&snapshot, None, &watch).unwrap();
    assert!(*most.lock().unwrap() > 0.9);
    assert_eq!(sheets(&snapshot, None, &|_| false).unwrap_err(), ChartError::Interrupted);
}

#[test]
fn what_is_unlit_black_or_glass_has_no_lumels() {
    let with = |material: Material| {
        let mut stage = Stage::default();
        let material = stage.material(material);
        stage.quad(Vec3::ZERO, Vec3::X, Vec3::Y, material);
        cut(&stage.snapshot()).sheets.len()
    };
    assert_eq!(with(grey()), 1);
    assert_eq!(with(Material { unlit: true, ..grey() }), 0);
    assert_eq!(with(Material { transmission: 0.5, ..grey() }), 0);
    assert_eq!(with(lambert(Vec3::ZERO, Vec3::ONE)), 0);
}

/// The mesh is shared by an instance that stands and one that an animation moves.
#[test]
fn a_mesh_that_one_instance_moves_has_lumels_on_the_other() {
    let mut stage = Stage::default();
    let material = stage.material(grey());
    stage.quad(Vec3::ZERO, Vec3::X, Vec3::Y, material);
    let mesh: Arc<Mesh> = stage.snapshot().instances[0].mesh.clone();
    stage.instance(MeshId(0), mesh, Affine3A::from_translation(Vec3::Z));
    let mut snapshot = Snapshot::clone(&stage.snapshot());
    snapshot.instances[1].still = false;
    let found = cut(&snapshot).sheets;
    assert_eq!(found.iter().map(|sheet| sheet.instance).collect::<Vec<_>>(), [0]);
}

/// What comes later lies beside what there is, which stays where it is; what goes makes room.
#[test]
fn layouts_are_extended() {
    let scene = Scene::builtin("door").expect("a built-in scene").snapshot();
    let all = cut(&scene).sheets;
    let (first, rest) = all.split_at(all.len() / 2);
    let before = laid_out(first, LightmapSpec::Texel(0.05)).unwrap();
    let Extended { laid_out: after, left_out } = extended(&before, |_| true, rest).unwrap();
    check(&scene, &after);
    assert!(left_out.is_empty());
    assert_eq!(after.texel, before.texel);
    assert_eq!(after.layout.surfaces().len(), all.len());
    for surface in before.layout.surfaces() {
        assert_eq!(after.layout.surface(surface.id), Some(surface));
    }

    // Taking turns needs no more room than both together.
    let is_first = |id| first.iter().any(|sheet| sheet.id == id);
    let mut layout = after.clone();
    for round in 0..6 {
        let back = if round % 2 == 0 { rest } else { first };
        let keeps = |id| is_first(id) == (round % 2 == 0);
        layout = extended(&layout, keeps, back).unwrap().laid_out;
        check(&scene, &layout);
        assert_eq!(layout.layout.surfaces().len(), all.len());
    }
    assert!(layout.layout.pages <= after.layout.pages + 1);

    // Rectangles that are larger than a page, and pages beyond the most.
    let tight = laid_out(&first[..1], LightmapSpec::Size(64)).unwrap();
    let huge = LaidOut { texel: tight.texel / 100.0, ..tight };
    let Extended { laid_out: same, left_out } = extended(&huge, |_| true, rest).unwrap();
    assert_eq!(left_out.len() + same.layout.surfaces().len(), rest.len() + 1);
    assert!(left_out.len() > rest.len() / 2);
}
