//! Lightmaps in a cache: tiles on their way, lost updates, other runs, layouts that come late.

use std::sync::Arc;

use glam::{UVec2, Vec2, Vec3};
use lumencast_cache::{Cache, CacheError};
use lumencast_codec::{
    Catalog, Coding, DecodeError, EncodedRegion, Epoch, FieldInfo, LightFile, LightTrack,
    LightmapShape, LumelCoding, LumelEncoder, Qp, Resource, ResourceHash, SceneInfo, StateFrame,
    UpdateInfo, layout_resources,
};
use lumencast_light::{
    ChartVertex, Charts, FieldId, Layout, Lightmap, OnTriangle, Rectangle, Surface, SurfaceId,
};

const TICK: f64 = 0.04;
const FIELD: u32 = 7;

/// A square of 4 × 4 lumels, or wider: one triangle.
fn charts(width: u32) -> Arc<Charts> {
    let at = |x: f32, y: f32| ChartVertex { source: 0, rectangle: 0, at: Vec2::new(x, y) };
    Arc::new(Charts {
        sizes: vec![UVec2::new(width, 4)],
        vertices: vec![at(0.5, 0.5), at(3.5, 0.5), at(0.5, 3.5)],
        triangles: vec![[0, 1, 2]],
    })
}

fn surface(node: u32, charts: &Arc<Charts>, x: u32) -> Surface {
    let rectangles = vec![Rectangle { page: 0, corner: UVec2::new(x, 0) }];
    let id = SurfaceId { node, ..SurfaceId::default() };
    Surface { id, charts: charts.clone(), rectangles }
}

/// Surface 1 in the first of four tiles, surface 2, of other charts, in the second.
fn layout() -> Layout {
    Layout::new(260, 1, vec![surface(1, &charts(4), 0), surface(2, &charts(3), 256)])
}

/// A server with one lightmap, whose light is the same number everywhere.
struct Server {
    catalog: Catalog,
    encoder: LumelEncoder,
    lightmap: Lightmap,
    resources: (Resource, Vec<Resource>),
    update: u64,
}

impl Server {
    fn new(epoch: u64, layout: Layout) -> Self {
        Self::of_coding(epoch, layout, LumelCoding::Halves)
    }

    fn of_coding(epoch: u64, layout: Layout, coding: LumelCoding) -> Self {
        let resources = layout_resources(&layout);
        let lightmap = Lightmap::dark(FieldId(FIELD), Arc::new(layout));
        let shape = LightmapShape::of(&lightmap, coding.coding());
        let scene = SceneInfo { name: "room".into(), root: "room.glb".into() };
        let fields = vec![FieldInfo::of_lightmap(lightmap.id, shape.clone(), None, "a test")];
        let epoch = Epoch(epoch);
        Self {
            catalog: Catalog { epoch, scene, tick_seconds: TICK, fields, unknown: vec![] },
            encoder: LumelEncoder::new(shape, coding),
            lightmap,
            resources,
            update: 0,
        }
    }

    /// The frames of an update in which light is so bright.
    fn update(&mut self, value: f32) -> Vec<EncodedRegion> {
        self.lightmap.irradiance.fill(Vec3::splat(value));
        let (update, tick) = (self.update, self.update);
        let info = UpdateInfo { update, tick, time: tick as f64 * TICK, scene_version: 5 };
        self.update += 1;
        self.encoder.encode(&self.lightmap, info, |_| true).expect("frames")
    }

    /// Names of the layout and of its charts.
    fn names(&self) -> Vec<ResourceHash> {
        let (layout, charts) = &self.resources;
        std::iter::once(layout).chain(charts).map(Resource::hash).collect()
    }
}

fn add(cache: &mut Cache, frame: &EncodedRegion, now: f64) -> Result<bool, CacheError> {
    let track = LightTrack { field: FIELD, region: frame.region, layer: frame.layer };
    cache.add_light(track, &frame.bytes, now).map(|received| received.news)
}

fn add_all(cache: &mut Cache, frames: &[EncodedRegion], now: f64) {
    frames.iter().for_each(|frame| assert_eq!(add(cache, frame, now), Ok(true)));
}

/// Red of the first lumel and of the last.
fn shown(cache: &mut Cache, now: f64) -> [f32; 2] {
    let light = cache.light(now);
    let lightmap = light.lightmaps().next().expect("a lightmap");
    [lightmap.irradiance[0].x, lightmap.irradiance.last().expect("lumels").x]
}

/// What is read on a surface, once it has passed from probes to lumels or back.
fn read(cache: &mut Cache, node: u32) -> Option<f32> {
    let surface = SurfaceId { node, ..SurfaceId::default() };
    let point = OnTriangle { surface, triangle: 0, weights: Vec3::X };
    cache.light(1e3);
    let light = cache.light(1e3 + 1.0);
    light.lightmaps().next()?.irradiance_at(&point).map(|irradiance| irradiance.x)
}

#[test]
fn tiles_pass_from_update_to_update() {
    let mut server = Server::new(1, layout());
    let mut cache = Cache::new();
    cache.add_catalog(&server.catalog.encode(), 0.0).unwrap();
    assert_eq!(shown(&mut cache, 0.0), [0.0; 2]);
    add_all(&mut cache, &server.update(1.0), 0.0);
    assert_eq!(shown(&mut cache, 0.0), [1.0; 2], "the first light is there at once");
    let frames = server.update(3.0);
    add_all(&mut cache, &frames[..1], 0.4);
    add_all(&mut cache, &frames[3..], 0.2);
    assert_eq!(shown(&mut cache, 0.4), [1.0, 3.0], "each tile by itself");
    let half_way = shown(&mut cache, 0.6)[0];
    assert!((half_way - 2.0).abs() < 1e-5, "{half_way}");
    assert_eq!(shown(&mut cache, 0.9), [3.0; 2]);
    let light = cache.light(2.0);
    assert_eq!((light.tick, light.scene_version), (Some(1), Some(5)));
    assert!((light.age.unwrap() - 1.6).abs() < 1e-9 && light.oldest_age.unwrap() > 1.7);
    // An update that comes amid a passage takes over where that stands, seen or not.
    add_all(&mut cache, &server.update(5.0), 2.0);
    add_all(&mut cache, &server.update(8.0), 2.25);
    assert_eq!(shown(&mut cache, 2.25), [4.0; 2]);
    assert_eq!(shown(&mut cache, 2.375), [6.0; 2]);
}

#[test]
fn each_tile_has_the_age_of_its_own_newest_light() {
    let mut server = Server::new(1, layout());
    let mut cache = Cache::new();
    cache.add_catalog(&server.catalog.encode(), 0.0).unwrap();
    let ages = |cache: &Cache, now| {
        let [ages] = &cache.lumel_ages(now)[..] else { panic!("one lightmap") };
        assert_eq!((ages.field, ages.side, ages.seconds.len()), (FieldId(FIELD), 256, 4));
        ages.clone()
    };
    assert_eq!(ages(&cache, 1.0).seconds, [None; 4]);
    let first = server.update(1.0);
    add_all(&mut cache, &first[1..], 2.0);
    assert_eq!(ages(&cache, 3.0).seconds, [None, Some(1.0), Some(1.0), Some(1.0)]);
    add_all(&mut cache, &server.update(2.0)[3..], 4.0);
    let known = ages(&cache, 4.5);
    assert_eq!(known.seconds, [None, Some(2.5), Some(2.5), Some(0.5)]);
    let layout = layout();
    let last = UVec2::splat(259);
    assert_eq!(known.at(&layout, 0, last), Some(0.5));
    assert_eq!(known.at(&layout, 0, last - UVec2::splat(4)), None, "of the first tile");
    // What came before again is no newer light.
    assert_eq!(add(&mut cache, &first[3], 5.0), Ok(false));
    assert_eq!(ages(&cache, 5.0).seconds[3], Some(1.0));
}

/// Of video, what cannot be read leaves the picture before it, and so does all that builds on it.
#[test]
fn damaged_pictures_leave_what_is_shown_until_a_keyframe() {
    let coding = LumelCoding::H264(Qp::new(12).unwrap());
    let mut server = Server::of_coding(1, Layout::new(64, 1, vec![]), coding);
    let mut cache = Cache::new();
    cache.add_catalog(&server.catalog.encode(), 0.0).unwrap();
    add_all(&mut cache, &server.update(1.0), 0.0);
    add_all(&mut cache, &server.update(1.1), 0.0);
    let before = shown(&mut cache, 1.0);
    assert!((before[0] - 1.1).abs() < 0.05, "{before:?}");
    let mut damaged = server.update(1.3).remove(0);
    let picture = damaged.bytes.len() / 2;
    damaged.bytes[picture..].fill(0xFF);
    assert!(matches!(add(&mut cache, &damaged, 1.0), Err(CacheError::Decode(_))));
    let next = loop {
        let other = 1.4 + 0.2 * (server.update % 2) as f32;
        let frame = server.update(other).remove(0);
        if frame.new_group {
            break frame;
        }
        let refused = add(&mut cache, &frame, 2.0);
        assert!(
            matches!(refused, Err(CacheError::Decode(DecodeError::MissingBase { .. }))),
            "{refused:?}"
        );
        assert_eq!(shown(&mut cache, 3.0), before);
    };
    assert_eq!(add(&mut cache, &next, 4.0), Ok(true));
    assert!(shown(&mut cache, 9.0)[0] > 1.35);
}

#[test]
fn a_tick_is_reached_once_every_tile_is() {
    let mut server = Server::new(1, layout());
    let mut cache = Cache::new();
    cache.add_catalog(&server.catalog.encode(), 0.0).unwrap();
    let snapshot = Some(Default::default());
    let state = StateFrame { tick: 0, snapshot, ..StateFrame::default() };
    cache.add_state(&state.encode(), 0.0).unwrap();
    for frame in server.update(1.0) {
        assert!(!cache.has_reached(0));
        add(&mut cache, &frame, 0.0).unwrap();
    }
    assert!(cache.has_reached(0));
}

#[test]
fn deltas_without_their_base_are_passed_over_until_a_keyframe() {
    let mut server = Server::new(1, layout());
    let mut cache = Cache::new();
    cache.add_catalog(&server.catalog.encode(), 0.0).unwrap();
    add_all(&mut cache, &server.update(1.0), 0.0);
    server.update(1.25);
    let late = server.update(1.5);
    let missing = CacheError::Decode(DecodeError::MissingBase { update: 2, base: 1 });
    assert_eq!(add(&mut cache, &late[0], 1.0), Err(missing));
    assert_eq!(shown(&mut cache, 2.0), [1.0; 2]);
    while server.update < 60 {
        server.update(1.5);
    }
    let keyframes = server.update(1.75);
    assert_eq!(add(&mut cache, &keyframes[0], 3.0), Ok(true));
    assert_eq!(shown(&mut cache, 9.0), [1.75, 1.0]);
    // What came late is no news; a lightmap has one layer, and four tiles here.
    let again = add(&mut cache, &keyframes[0], 4.0);
    assert_eq!(again, Ok(false));
    let other_layer = EncodedRegion { layer: 1, ..keyframes[0].clone() };
    let wrong = CacheError::WrongLayer { update: 60, layer: 1 };
    assert_eq!(add(&mut cache, &other_layer, 4.0), Err(wrong));
    let no_tile = EncodedRegion { region: 4, ..keyframes[0].clone() };
    let unknown = CacheError::UnknownRegion { field: FIELD, region: 4 };
    assert_eq!(add(&mut cache, &no_tile, 4.0), Err(unknown));
}

#[test]
fn another_run_begins_anew_and_what_is_shown_stays() {
    let mut server = Server::new(1, layout());
    let mut cache = Cache::new();
    cache.add_catalog(&server.catalog.encode(), 0.0).unwrap();
    for value in [1.0, 1.25, 1.5] {
        add_all(&mut cache, &server.update(value), 0.0);
    }
    let mut server = Server::new(2, layout());
    cache.add_catalog(&server.catalog.encode(), 5.0).unwrap();
    assert_eq!((shown(&mut cache, 5.0), cache.light(5.0).age), ([1.5; 2], None));
    add_all(&mut cache, &server.update(0.5), 5.0);
    assert_eq!(shown(&mut cache, 9.0), [0.5; 2]);
    assert_eq!(cache.light(9.0).tick, Some(0));
}

#[test]
fn surfaces_are_read_as_their_resources_come() {
    let mut server = Server::new(1, layout());
    let mut cache = Cache::new();
    assert_eq!(cache.wanted_resources(), []);
    cache.add_catalog(&server.catalog.encode(), 0.0).unwrap();
    add_all(&mut cache, &server.update(2.0), 0.0);
    let names = server.names();
    let (layout, charts) = server.resources.clone();
    assert_eq!(cache.wanted_resources(), names[..1]);
    assert_eq!(read(&mut cache, 1), None);

    // Charts that nobody names yet, bytes that are cut short, and nothing at all.
    for bytes in [charts[0].bytes(), &layout.bytes()[1..], &[]] {
        let unknown = CacheError::UnknownResource(ResourceHash::of(bytes));
        assert_eq!(cache.add_resource(bytes), Err(unknown));
    }
    assert_eq!(cache.wanted_resources(), names[..1]);

    cache.add_resource(layout.bytes()).unwrap();
    assert_eq!(cache.wanted_resources(), names[1..]);
    assert_eq!(read(&mut cache, 1), None);
    // Of one surface the charts are there, then of both.
    cache.add_resource(charts[0].bytes()).unwrap();
    assert_eq!(cache.wanted_resources(), names[2..]);
    let readable =
        |cache: &mut Cache| [1, 2].map(|node| read(cache, node)).iter().flatten().count();
    assert_eq!(readable(&mut cache), 1);
    cache.add_resource(charts[1].bytes()).unwrap();
    assert_eq!([1, 2].map(|node| read(&mut cache, node)), [Some(2.0); 2]);
    assert_eq!(cache.wanted_resources(), []);
    let again = CacheError::UnknownResource(names[0]);
    assert_eq!(cache.add_resource(layout.bytes()), Err(again));

    // A catalog of another scale, in which the layout is the same: nothing is asked for again, and
    // whoever shows the light finds the same layout.
    let before = cache.light(5.0).lightmaps().next().unwrap().layout.clone();
    server.catalog.fields[0].scale_log2 = Some(3);
    cache.add_catalog(&server.catalog.encode(), 5.0).unwrap();
    let after = cache.light(5.0).lightmaps().next().unwrap().layout.clone();
    assert!(Arc::ptr_eq(&before, &after) && cache.wanted_resources().is_empty());
}

#[test]
fn another_layout_takes_over_the_pages_and_then_the_surfaces() {
    let mut first = Server::new(1, layout());
    let mut cache = Cache::new();
    cache.add_catalog(&first.catalog.encode(), 0.0).unwrap();
    add_all(&mut cache, &first.update(2.0), 0.0);
    let (layout, charts) = first.resources.clone();
    for resource in std::iter::once(&layout).chain(&charts) {
        cache.add_resource(resource.bytes()).unwrap();
    }
    assert_eq!(read(&mut cache, 1), Some(2.0));

    // Surface 3 has the charts of surface 1, which are there already; those of surface 2 go.
    let only = Layout::new(260, 1, vec![surface(3, &self::charts(4), 8)]);
    let second = Server::new(1, only);
    cache.add_catalog(&second.catalog.encode(), 1.0).unwrap();
    assert_eq!(shown(&mut cache, 1.0), [2.0; 2]);
    assert_eq!([1, 3].map(|node| read(&mut cache, node)), [Some(2.0), None], "the old layout");
    assert_eq!(cache.wanted_resources(), second.names()[..1]);
    cache.add_resource(second.resources.0.bytes()).unwrap();
    // Its charts have been there all the time, and frames go on.
    assert_eq!(cache.wanted_resources(), []);
    assert_eq!([1, 3].map(|node| read(&mut cache, node)), [None, Some(2.0)]);
    let delta = first.update(3.0);
    assert!(delta.iter().all(|frame| !frame.new_group));
    add_all(&mut cache, &delta, 1.5);
    assert_eq!(shown(&mut cache, 4.0), [3.0; 2]);
    let gone = CacheError::UnknownResource(layout.hash());
    assert_eq!(cache.add_resource(layout.bytes()), Err(gone));

    // Further pages are dark, those of before are not.
    let more = Server::new(1, Layout::new(260, 2, vec![]));
    cache.add_catalog(&more.catalog.encode(), 2.0).unwrap();
    assert_eq!(shown(&mut cache, 2.0), [3.0, 0.0]);
    assert_eq!(
        cache.light(2.0).lightmaps().next().map(|l| l.irradiance.len()),
        Some(2 * 260 * 260)
    );

    // Pages of another size are other pages.
    let larger = Server::new(1, Layout::new(512, 1, vec![]));
    cache.add_catalog(&larger.catalog.encode(), 2.0).unwrap();
    assert_eq!(shown(&mut cache, 2.0), [0.0; 2]);
}

#[test]
fn resources_that_cannot_be_read_are_not_asked_for_again() {
    let mut server = Server::new(1, layout());
    let rubbish = Resource::new(b"no layout".to_vec());
    let other_pages = layout_resources(&Layout::new(16, 1, vec![])).0;
    let mut cache = Cache::new();
    for (resource, taken) in [(rubbish, false), (other_pages, true)] {
        let mut shape = LightmapShape::of(&server.lightmap, Coding::Halves);
        shape.layout = resource.hash();
        server.catalog.fields[0].shape = lumencast_codec::Shape::Lightmap(shape);
        cache.add_catalog(&server.catalog.encode(), 0.0).unwrap();
        assert_eq!(cache.wanted_resources(), [resource.hash()]);
        assert_eq!(cache.add_resource(resource.bytes()).is_ok(), taken);
        assert_eq!(cache.wanted_resources(), []);
        let light = cache.light(1.0);
        let pages = light.lightmaps().next().map(|lightmap| lightmap.layout.page_size);
        assert_eq!(pages, Some(260), "the pages are those of the catalog");
    }
}

#[test]
fn a_file_brings_its_layout() {
    let mut server = Server::new(1, layout());
    server.update(4.0);
    let fields = [server.lightmap.clone().into()];
    let scene = server.catalog.scene.clone();
    let mut file = LightFile::of_fields(scene, "", &fields, UpdateInfo::default());
    let mut cache = Cache::new();
    for _ in 0..2 {
        cache.load(&file.write(), 0.0).unwrap();
        assert_eq!([1, 2].map(|node| read(&mut cache, node)), [Some(4.0); 2]);
        assert_eq!(cache.wanted_resources(), []);
        file.resources.reverse();
    }
    // A server with the same layout need not send it again.
    cache.add_catalog(&server.catalog.encode(), 1.0).unwrap();
    assert_eq!((read(&mut cache, 1), cache.wanted_resources()), (Some(4.0), vec![]));
}
