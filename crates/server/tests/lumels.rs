//! Lumels while a scene is live: stepped by hand, without network.

mod common;

use std::collections::{HashMap, HashSet};
use std::sync::Arc;
use std::time::Duration;

use common::{PERIOD, dim, mail, tracer};
use glam::Vec3;
use lumencast_charts::{LaidOut, laid_out, lumels_on_pages, sheets};
use lumencast_codec::{
    Catalog, EncodedRegion, FrameHead, LayoutResource, LightmapShape, LumelCoding, LumelDecoder,
    Qp, Resource, ResourceHash, read_charts,
};
use lumencast_gather::path_trace::CpuPathTracer;
use lumencast_gather::{Gather, Gathered, Job, Progress, Receiver, Ticket};
use lumencast_light::{Layout, Lightmap, SurfaceId, luminance};
use lumencast_scene::{
    AnimationId, Edit, InstanceSource, LightmapSpec, NodeId, NodeName, Playback, Scene, Snapshot,
    Transform,
};
use lumencast_server::{Mail, Outlet, SampleRange, TickOptions};
use lumencast_solve::{Bake, Effort, GatherOptions, bake, spread};

/// Ticks of a second and more, in which light has followed a change.
const LONG: usize = 40;

/// Keeps what a tick sends.
#[derive(Default)]
struct Kept {
    catalogs: Vec<Catalog>,
    /// What has come of resources by the time of each catalog.
    resources: HashMap<ResourceHash, Resource>,
    frames: Vec<(u32, EncodedRegion)>,
}

impl Outlet for Kept {
    fn is_watched(&self, _: u32, _: u32) -> bool {
        true
    }

    fn resources(&mut self, resources: Vec<Resource>) {
        self.resources = resources.into_iter().map(|r| (r.hash(), r)).collect();
    }

    fn catalog(&mut self, catalog: &Catalog) {
        self.catalogs.push(Catalog::decode(&catalog.encode()).expect("a catalog"));
    }

    fn state(&mut self, _: Vec<u8>, _: bool) {}

    fn light(&mut self, field: u32, frame: EncodedRegion) {
        self.frames.push((field, frame));
    }
}

type Stepped = common::Stepped<Kept>;

impl Stepped {
    /// A cornell that stands still, with a small page.
    fn new() -> Self {
        Self::coded(LumelCoding::Halves)
    }

    /// The same, whose lumels are sent so.
    fn coded(lumel_coding: LumelCoding) -> Self {
        let mut stepped = Self::gathering(lumel_coding, Box::new(tracer()));
        let playback = Playback { playing: Some(false), ..Playback::default() };
        stepped.edit(1, Edit::SetAnimation { animation: AnimationId(0), playback });
        stepped
    }

    /// The same, whose ball goes round.
    fn gathering(lumel_coding: LumelCoding, gatherer: Box<dyn Gather>) -> Self {
        let mut scene = Scene::builtin("cornell").expect("a built-in scene");
        let options = TickOptions {
            samples: SampleRange::fixed(4),
            lightmap: Some(lumels(&scene.snapshot())),
            lumel_samples: Some(8192),
            lumel_coding,
            // No machine is so slow that a tick is late by its own time.
            period: 3600.0,
            ..TickOptions::default()
        };
        Self::of(scene, gatherer, options)
    }

    /// Steps until something is so, which takes two seconds of rest and not many ticks more.
    fn rest_until(&mut self, is_so: impl Fn(&Self) -> bool) {
        self.steps((2.0 / PERIOD) as usize - 2);
        assert!(!is_so(self), "not yet");
        let mut waited = 0;
        while !is_so(self) {
            self.step(Mail::default());
            waited += 1;
            assert!(waited < 60, "it has rested for long");
        }
    }

    fn edit(&mut self, seq: u64, edit: Edit) {
        self.step(mail(seq, edit));
    }

    fn lightmap(&self) -> &Lightmap {
        self.tick.light().lightmaps().next().expect("lumels")
    }

    /// The mesh of the tall box.
    fn tall_box(&self) -> InstanceSource {
        let tall = self.node("tall box");
        let mesh = self.tick.scene().nodes().find(|node| node.id == tall).expect("a box").mesh;
        InstanceSource::Mesh(mesh.expect("a mesh"))
    }

    /// The shape that the catalog has now.
    fn shape(&self) -> LightmapShape {
        let catalog = self.tick.catalog();
        let shape = catalog.fields.iter().find_map(|field| field.shape.as_lightmap());
        shape.expect("a lightmap").clone()
    }
}

fn lumels(scene: &Snapshot) -> LaidOut {
    let sheets = sheets(scene, None, &|_| true).expect("charts").sheets;
    laid_out(&sheets, LightmapSpec::Size(96)).expect("a layout")
}

/// The same light, computed once.
fn converged(scene: &Arc<Snapshot>) -> Lightmap {
    let lightmap = lumels(scene);
    let effort = Effort::of_samples(512);
    let (lightmap, options) = (Some(&lightmap), GatherOptions::default());
    let wanted = Bake { scene, volumes: &[], lightmap, effort, options };
    let baked = bake(wanted, &mut tracer(), |_| ()).expect("light");
    baked.fields[0].as_lightmap().expect("lumels").clone()
}

/// Root of the mean square by which lumels differ, over the mean; of those that charts cover.
fn difference(lightmap: &Lightmap, right: &Lightmap) -> f32 {
    let (mut squares, mut sum, mut count) = (0.0, 0.0, 0.0);
    for surface in right.layout.surfaces() {
        for (index, _) in lumels_on_pages(&right.layout, surface) {
            let of = |lightmap: &Lightmap| luminance(lightmap.irradiance[index]);
            squares += (of(lightmap) - of(right)).powi(2);
            sum += of(right);
            count += 1.0;
        }
    }
    (squares / count as f32).sqrt() / (sum / count as f32)
}

fn moved(node: NodeId, x: f32) -> Edit {
    let transform =
        Transform { translation: Some(Vec3::new(x, 0.6, -0.3)), ..Transform::default() };
    Edit::MoveNode { node, transform }
}

/// A gatherer that is never done with lumels.
struct Reluctant {
    inner: CpuPathTracer,
    lumels: HashSet<Ticket>,
}

impl Gather for Reluctant {
    fn submit(&mut self, job: Job) -> Ticket {
        let is_of_lumels = matches!(job.receivers.first(), Some(Receiver::Lumel { .. }));
        let ticket = self.inner.submit(job);
        if is_of_lumels {
            self.lumels.insert(ticket);
        }
        ticket
    }

    fn poll(&mut self, ticket: Ticket) -> Progress {
        match self.lumels.contains(&ticket) {
            true => Progress::Working(0.5),
            false => self.inner.poll(ticket),
        }
    }

    fn wait(&mut self, ticket: Ticket) -> Option<Gathered> {
        assert!(!self.lumels.contains(&ticket), "nobody waits for lumels");
        self.inner.wait(ticket)
    }

    fn cancel(&mut self, ticket: Ticket) {
        self.inner.cancel(ticket);
    }
}

/// Ticks wait for probes, and never for lumels, however long these take.
#[test]
fn live_ticks_do_not_wait_for_lumels() {
    let reluctant = Reluctant { inner: tracer(), lumels: HashSet::new() };
    let mut stepped = Stepped::gathering(LumelCoding::Halves, Box::new(reluctant));
    for _ in 0..5 {
        stepped.now += PERIOD;
        // Far longer than the test may last.
        let patience = Duration::from_secs(10_000);
        let report =
            stepped.tick.step_within(stepped.now, Mail::default(), &mut stepped.kept, patience);
        assert!(!report.late && report.rays > 0, "{report:?}");
    }
}

#[test]
fn lumels_come_near_to_converged_light_and_follow_a_change() {
    let mut stepped = Stepped::new();
    let mut scene = Scene::builtin("cornell").expect("a built-in scene");
    let right = converged(&scene.snapshot());
    stepped.steps(4);
    let coarse = difference(stepped.lightmap(), &right);
    assert!(coarse < 0.5, "a coarse picture: {coarse}");
    stepped.steps(2 * LONG);
    let fine = difference(stepped.lightmap(), &right);
    assert!(fine < 0.12 && fine < coarse, "{fine}, and at first {coarse}");

    let lamp = stepped.node("lamp");
    scene.apply(&dim(lamp, 40.0)).expect("an edit");
    let right = converged(&scene.snapshot());
    assert!(difference(stepped.lightmap(), &right) > 0.5, "the lamp is brighter");
    stepped.edit(2, dim(lamp, 40.0));
    stepped.steps(LONG);
    let followed = difference(stepped.lightmap(), &right);
    assert!(followed < 0.25, "{followed}");
    stepped.steps(2 * LONG);
    let followed = difference(stepped.lightmap(), &right);
    assert!(followed < 0.12, "{followed}");
}

/// What is sent is what there is: layouts by their hash, before the catalog that names them, and light.
#[test]
fn frames_and_resources_are_what_clients_need() {
    let video = LumelCoding::H264(Qp::new(15).expect("a parameter"));
    for (coding, most) in [(LumelCoding::Halves, 1e-3), (video, 0.03)] {
        let mut stepped = Stepped::coded(coding);
        stepped.steps(10);
        let shown = shown(&stepped);
        let off = difference(&shown, stepped.lightmap());
        assert!(off < most, "{coding:?}: {off}");
    }
}

/// What a client makes of all that was sent.
fn shown(stepped: &Stepped) -> Lightmap {
    let shape = stepped.shape();
    let resources: HashMap<ResourceHash, Resource> =
        stepped.tick.resources().into_iter().map(|r| (r.hash(), r)).collect();
    assert_eq!(read(&shape.layout, &resources), *stepped.lightmap().layout);

    let id = stepped.lightmap().id.0;
    let mut shown = stepped.lightmap().clone();
    shown.irradiance.fill(Vec3::ZERO);
    for tile in shape.tiles() {
        let mut decoder = LumelDecoder::new(shape.coding, tile.size);
        let of_tile =
            stepped.kept.frames.iter().filter(|(f, frame)| (*f, frame.region) == (id, tile.id));
        for (_, frame) in of_tile {
            assert_eq!(frame.layer, 0);
            let light = decoder.decode(&frame.bytes).expect("light");
            tile.put(light, &mut shown);
        }
    }
    shown
}

fn read(hash: &ResourceHash, resources: &HashMap<ResourceHash, Resource>) -> Layout {
    let layout = LayoutResource::read(resources[hash].bytes()).expect("a layout");
    layout.layout(|charts| read_charts(resources.get(&charts)?.bytes()).ok().map(Arc::new))
}

/// A box that is moved has no lumels from that tick on, and has them again where it was.
#[test]
fn what_moves_loses_its_lumels() {
    let mut stepped = Stepped::new();
    stepped.steps(LONG);
    let node = stepped.node("tall box");
    let id = SurfaceId { node: node.0, ..SurfaceId::default() };
    let has = |layout: &Layout| layout.surface(id).is_some();
    let before = stepped.shape();
    assert!(has(&stepped.lightmap().layout));
    let home = stepped.tick.scene().nodes().find(|n| n.id == node).expect("the box").transform;
    stepped.kept.frames.clear();

    stepped.edit(2, moved(node, 0.2));
    assert!(!has(&stepped.lightmap().layout), "at once");
    let shape = stepped.shape();
    assert_ne!(shape.layout, before.layout);
    let told = stepped.kept.catalogs.last().expect("a catalog");
    let told = told.fields.iter().find_map(|field| field.shape.as_lightmap()).expect("lumels");
    assert_eq!(told, &shape);
    assert!(!has(&read(&shape.layout, &stepped.kept.resources)));
    stepped.edit(3, moved(node, 0.3));
    assert_eq!(stepped.shape(), shape, "it goes on moving");
    stepped.steps(2);
    // Lumels lie where they lay: frames go on.
    let id = stepped.lightmap().id.0;
    let of_lumels = stepped.kept.frames.iter().filter(|(field, _)| *field == id);
    let heads: Vec<FrameHead> =
        of_lumels.map(|(_, frame)| FrameHead::read(&frame.bytes).expect("a head")).collect();
    let numbers: Vec<u64> = heads.iter().map(|head| head.info.update).collect();
    assert!(numbers.windows(2).all(|two| two[1] == two[0] + 1), "{numbers:?}");
    assert_eq!(heads.len(), 4);

    stepped.edit(4, Edit::MoveNode { node, transform: home });
    let mut waited = 0;
    while stepped.shape() != before {
        stepped.step(Mail::default());
        waited += 1;
        assert!(waited < 30, "it need not rest there, its lumels only have to be gathered at");
    }
    assert!(has(&stepped.lightmap().layout));
}

/// A box that has rested for two seconds has lumels where it is, with the light of that place.
#[test]
fn what_rests_has_lumels_again() {
    let mut stepped = Stepped::new();
    stepped.steps(5);
    let node = stepped.node("tall box");
    let id = SurfaceId { node: node.0, ..SurfaceId::default() };
    let has = |stepped: &Stepped| stepped.lightmap().layout.surface(id).is_some();
    let home = stepped.shape();
    stepped.edit(2, moved(node, 0.3));
    stepped.rest_until(has);
    assert_eq!(stepped.shape(), home, "its lumels lie where they lay on the page");
    stepped.steps(LONG);

    let mut scene = Scene::builtin("cornell").expect("a built-in scene");
    scene.apply(&moved(node, 0.3)).expect("an edit");
    let (off, mean) = off_from_converged(&stepped, &scene.snapshot(), id);
    assert!(off < 0.1 * mean, "{off} of {mean}");
}

fn add(name: &str, source: InstanceSource, translation: Vec3) -> Edit {
    let transform = Transform { translation: Some(translation), ..Transform::default() };
    Edit::AddInstance { node: None, name: NodeName::new(name), source, parent: None, transform }
}

/// By how much the light of a surface is off on average, and the mean of what it should be.
fn off_from_converged(stepped: &Stepped, scene: &Arc<Snapshot>, id: SurfaceId) -> (f32, f32) {
    let right = converged(scene);
    let read = |lightmap: &Lightmap| -> Vec<f32> {
        let places = spread(scene, &right.layout, 4000);
        let own = places.iter().filter_map(|place| place.on.filter(|on| on.surface == id));
        own.map(|on| luminance(lightmap.irradiance_at(&on).expect("lumels"))).collect()
    };
    let (seen, right) = (read(stepped.lightmap()), read(&right));
    assert!(right.len() > 200, "{} points", right.len());
    let count = right.len() as f32;
    let off = seen.iter().zip(&right).map(|(a, b)| (a - b).abs()).sum::<f32>() / count;
    (off, right.iter().sum::<f32>() / count)
}

/// Where no surface has lumels, those that are added get them.
#[test]
fn what_is_added_to_nothing_gets_lumels() {
    let mut scene = Scene::builtin("cornell").expect("a built-in scene");
    let meshes: Vec<_> = scene.nodes().filter_map(|node| Some((node.id, node.mesh?))).collect();
    for (node, _) in &meshes {
        scene.apply(&Edit::RemoveNode { node: *node }).expect("an edit");
    }
    let options = TickOptions {
        lightmap: Some(LaidOut::empty(LightmapSpec::Size(96))),
        lumel_coding: LumelCoding::Halves,
        ..TickOptions::default()
    };
    let mut stepped = Stepped::of(scene, Box::new(tracer()), options);
    stepped.steps(5);
    let source = InstanceSource::Mesh(meshes[0].1);
    stepped.edit(1, add("a wall", source, Vec3::ZERO));
    let node = stepped.node("a wall").0;
    let has =
        |stepped: &Stepped| stepped.lightmap().layout.surfaces().iter().any(|s| s.id.node == node);
    stepped.rest_until(has);
    let lit = stepped.lightmap().irradiance.iter().filter(|e| luminance(**e) > 0.0).count();
    assert!(lit > 0, "its lumels have light");
}

/// What is added is lit by probes until it has rested, and its surfaces are cut and gathered at; what
/// lies on the pages already stays where it is.
#[test]
fn what_is_added_gets_lumels() {
    let mut stepped = Stepped::new();
    stepped.steps(5);
    let before = stepped.lightmap().layout.clone();
    let add = add("another", stepped.tall_box(), Vec3::new(-0.6, 0.4, 0.5));
    stepped.edit(2, add.clone());
    let id = SurfaceId { node: stepped.node("another").0, ..SurfaceId::default() };
    let has = |stepped: &Stepped| stepped.lightmap().layout.surface(id).is_some();
    stepped.rest_until(has);
    let layout = stepped.lightmap().layout.clone();
    for surface in before.surfaces() {
        assert_eq!(layout.surface(surface.id), Some(surface));
    }
    stepped.step(Mail::default());
    let shape = stepped.shape();
    assert_eq!(read(&shape.layout, &stepped.kept.resources), *layout);
    let told = stepped.kept.catalogs.last().expect("a catalog");
    assert_eq!(told.fields.iter().find_map(|field| field.shape.as_lightmap()), Some(&shape));
    stepped.steps(LONG);

    let mut scene = Scene::builtin("cornell").expect("a built-in scene");
    scene.apply(&add).expect("an edit");
    let (off, mean) = off_from_converged(&stepped, &scene.snapshot(), id);
    assert!(off < 0.1 * mean, "{off} of {mean}");

    // What goes leaves its place to what comes.
    stepped.edit(3, Edit::RemoveNode { node: NodeId(id.node) });
    assert!(!has(&stepped));
    stepped.steps(3);
    assert_eq!(stepped.lightmap().layout.surfaces(), before.surfaces());
}

/// Clients that know an old layout read no lumels of what came later: a place is used again once all know
/// that what lay there is gone.
#[test]
fn a_place_is_free_some_time_after_what_lay_there_went() {
    let mut stepped = Stepped::new();
    let mesh = stepped.tall_box();
    let id =
        |stepped: &Stepped, name| SurfaceId { node: stepped.node(name).0, ..SurfaceId::default() };
    let place = |stepped: &Stepped, id| {
        stepped.lightmap().layout.surface(id).map(|surface| surface.rectangles.clone())
    };
    stepped.edit(1, add("first", mesh.clone(), Vec3::new(-0.6, 0.4, 0.5)));
    let first = id(&stepped, "first");
    stepped.rest_until(|stepped| place(stepped, first).is_some());
    let before = place(&stepped, first);
    stepped.edit(2, add("second", mesh, Vec3::new(0.6, 0.4, 0.5)));
    let second = id(&stepped, "second");
    stepped.steps((1.5 / PERIOD) as usize);
    stepped.edit(3, Edit::RemoveNode { node: NodeId(first.node) });
    stepped.rest_until(|stepped| place(stepped, second).is_some());
    assert_eq!(place(&stepped, second), before);
}
