//! Ticks stepped by hand: no network, no clock but the test's own.

#![allow(
    dead_code,
    unreachable_pub,
    clippy::allow_attributes,
    reason = "each test file uses a part of it"
)]

use std::collections::BTreeMap;

use glam::{UVec3, Vec3};
use lumencast_codec::{Catalog, EncodedRegion, Epoch, StateFrame, VolumeShape};
use lumencast_gather::Gather;
use lumencast_gather::path_trace::{CpuPathTracer, Options};
use lumencast_light::ProbeVolume;
use lumencast_scene::{Edit, LightSpec, NodeId, Scene, VolumeSpec};
use lumencast_server::{Mail, Outlet, Received, Report, SampleRange, Tick, TickOptions};

/// Seconds from one tick to the next.
pub const PERIOD: f64 = 0.04;

/// Keeps what a tick sends.
#[derive(Default)]
pub struct Kept {
    pub catalogs: Vec<Catalog>,
    pub states: Vec<StateFrame>,
    pub frames: Vec<(u32, EncodedRegion)>,
    pub unwatched: bool,
}

impl Outlet for Kept {
    fn is_watched(&self, _: u32, _: u32) -> bool {
        !self.unwatched
    }

    fn catalog(&mut self, catalog: &Catalog) {
        self.catalogs.push(Catalog::decode(&catalog.encode()).expect("a catalog"));
    }

    fn state(&mut self, frame: Vec<u8>, new_group: bool) {
        let state = StateFrame::decode(&frame).expect("a state frame");
        assert_eq!(new_group, state.snapshot.is_some(), "a snapshot begins a group");
        self.states.push(state);
    }

    fn light(&mut self, field: u32, frame: EncodedRegion) {
        self.frames.push((field, frame));
    }
}

/// A tick stepped at the test's own times, and what it has sent.
pub struct Stepped<O = Kept> {
    pub tick: Tick,
    pub kept: O,
    pub now: f64,
}

impl<O: Outlet + Default> Stepped<O> {
    pub fn of(scene: Scene, gatherer: Box<dyn Gather>, options: TickOptions) -> Self {
        let tick = Tick::new(scene, gatherer, options, Epoch(7)).expect("a tick");
        Self { tick, kept: O::default(), now: 0.0 }
    }

    pub fn step(&mut self, mail: Mail) -> Report {
        let report = self.tick.step(self.now, mail, &mut self.kept);
        self.now += PERIOD;
        report
    }

    pub fn steps(&mut self, n: usize) {
        for _ in 0..n {
            self.step(Mail::default());
        }
    }

    pub fn node(&self, name: &str) -> NodeId {
        self.tick.scene().nodes().find(|node| node.name == name).expect(name).id
    }
}

impl Stepped {
    /// The built-in cornell.
    pub fn new(options: TickOptions) -> Self {
        Self::with(options, Box::new(tracer()))
    }

    /// The built-in cornell, with a gatherer of the test's own.
    pub fn with(options: TickOptions, gatherer: Box<dyn Gather>) -> Self {
        let scene = Scene::builtin("cornell").expect("a built-in scene");
        Self::of(scene, gatherer, options)
    }

    pub fn volume(&self) -> &ProbeVolume {
        self.tick.light().volumes().next().expect("a volume")
    }

    /// The mean over probes of the first coefficient, its channels added up.
    pub fn mean_c0(&self) -> f32 {
        let volume = self.volume();
        let sum: Vec3 = (0..volume.grid.probe_count()).map(|i| volume.probe(i)[0]).sum();
        sum.element_sum() / volume.grid.probe_count() as f32
    }
}

/// The volumes in the order in which they were asked for.
pub fn volumes(stepped: &Stepped) -> Vec<ProbeVolume> {
    let mut volumes: Vec<ProbeVolume> = stepped.tick.light().volumes().cloned().collect();
    volumes.sort_by_key(|volume| volume.id);
    volumes
}

/// The shape of a catalog's volume.
pub fn shape(catalog: &Catalog, field: usize) -> VolumeShape {
    catalog.fields[field].shape.as_volume().expect("a volume").clone()
}

pub fn tracer() -> CpuPathTracer {
    CpuPathTracer::new(Options::default()).expect("threads")
}

/// Few probes in the cornell, and the same number of samples in each tick.
pub fn options() -> TickOptions {
    let scene = Scene::builtin("cornell").expect("a built-in scene");
    let mut volume: VolumeSpec = scene.volumes()[0];
    volume.grid.resolution = UVec3::splat(3);
    TickOptions {
        period: PERIOD,
        samples: SampleRange::fixed(64),
        volumes: vec![volume],
        ..TickOptions::default()
    }
}

/// One edit of one client, acknowledged.
pub fn mail(seq: u64, edit: Edit) -> Mail {
    let received = Received { client: "a".into(), seq, edit, temporary: false };
    Mail { edits: vec![received], acks: BTreeMap::from([("a".into(), seq)]), ..Mail::default() }
}

/// Gives a lamp this intensity.
pub fn dim(node: NodeId, intensity: f32) -> Edit {
    Edit::SetLight { node, light: LightSpec { intensity: Some(intensity), ..LightSpec::default() } }
}
