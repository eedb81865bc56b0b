//! The tick: edits → animation → acceleration structure → gather → encode → publish.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::{Duration, Instant};

use lumencast_charts::{LaidOut, Store};
use lumencast_codec::{
    AcceptedEdit, Catalog, EncodedRegion, Epoch, FieldInfo, LumelCoding, RefusedEdit, Resource,
    SceneInfo, SceneState, StateFrame, check_volumes, layout_resources, limits,
};
use lumencast_gather::Gather;
use lumencast_light::{FieldId, Light, Lightmap};
use lumencast_scene::{Edit, FileRead, Scene, Script, Snapshot, VolumeSpec};
use lumencast_solve::{FitEffort, GatherOptions, Solver, Turn, volumes};

use crate::error::ServerError;
use crate::gathering::{Brought, Gathering, Patience};
use crate::inbox::{Mail, Received, refusal};
use crate::pace::{Budget, LumelPace, SampleRange};
use crate::publish::Outlet;
use crate::published::{Moment, Published};
use crate::report::{Report, Stage, Stopwatch};
use crate::temporary::Temporary;
use crate::unwrapping::Unwrapping;

/// How a server computes light.
#[derive(Clone, Debug)]
pub struct TickOptions {
    /// Seconds from one tick to the next.
    pub period: f64,
    /// Samples a probe and tick.
    pub samples: SampleRange,
    /// How light is gathered and blended.
    pub gather: GatherOptions,
    /// Whether paths go on, where they end, in the light of the tick before
    /// ([`lumencast_gather::Job::previous`]): all bounces for the price of few.
    pub feedback: bool,
    /// Volumes in place of the scene's own, or of the default one.
    pub volumes: Vec<VolumeSpec>,
    /// Lumels of still surfaces, if there are to be some.
    pub lightmap: Option<LaidOut>,
    /// Samples of all lumels in a tick: as many as there is time for beside probes, unless it is given.
    pub lumel_samples: Option<u64>,
    /// Where charts are kept of instances that come later.
    pub charts: Option<Store>,
    /// How lumels are coded.
    pub lumel_coding: LumelCoding,
    /// Edits at set times.
    pub script: Option<Script>,
    /// What computes the light, for the catalog ([`lumencast_codec::FieldInfo::source`]).
    pub source: String,
}

impl Default for TickOptions {
    /// 25 ticks a second.
    fn default() -> Self {
        Self {
            period: 1.0 / 25.0,
            samples: SampleRange::default(),
            gather: GatherOptions::default(),
            feedback: false,
            volumes: Vec::new(),
            lightmap: None,
            lumel_samples: None,
            charts: None,
            lumel_coding: LumelCoding::default(),
            script: None,
            source: String::new(),
        }
    }
}

/// Rounds and steps of a tick's fit, which goes on from the last one's.
const FIT_EFFORT: FitEffort = FitEffort { rounds: 1, steps: 4 };
/// A snapshot of the scene goes out at least every so many ticks, for those who join.
const SNAPSHOT_EVERY: u64 = 64;
/// Ticks from one catalog to the next at least: light that flickers is not to fill slow links with
/// catalogs.
const CATALOG_EVERY: u64 = 25;
/// Bytes of a snapshot from which on nothing can be added: those who join have to get it in one
/// frame, and changes need room too.
const ADDING_ROOM: usize = limits::FRAME_BYTES / 2;
/// Bytes of a snapshot from which on nothing more can be changed.
const CHANGING_ROOM: usize = limits::FRAME_BYTES / 8 * 5;
/// Bytes of the reasons that a tick gives for refusing edits; beyond them reasons are short.
const REASON_ROOM: usize = limits::FRAME_BYTES / 32;
/// Scene time moves at most this much in a tick, seconds, however long the machine slept.
const LONGEST_STEP: f64 = 0.5;

/// A scene with its light, stepped by hand. It has no socket and no thread, and no clock but to measure
/// how long its steps take.
pub struct Tick {
    scene: Scene,
    gathering: Gathering,
    /// Fields that have looked for surfaces, and gathered no light since. Their next job is for light,
    /// or else a scene that changes all the time would have them look for ever.
    looked: Vec<FieldId>,
    solver: Solver,
    /// The solver's fields, in its order.
    published: Vec<Published>,
    options: TickOptions,
    budget: Budget,
    lumel_pace: LumelPace,
    epoch: Epoch,
    number: u64,
    /// The scales that clients know from the catalog.
    told_scales: Vec<Option<i8>>,
    /// Whether clients do not know yet which fields there are.
    fields_are_news: bool,
    /// The tick from which on the catalog may go out again.
    next_catalog: u64,
    /// At most so many bytes has the scene's snapshot.
    snapshot_bytes: usize,
    /// The tick in which that was measured last.
    measured: Option<u64>,
    last_now: Option<f64>,
    temporary: Temporary,
    unwrapping: Unwrapping,
    last: Report,
}

impl Tick {
    /// Prepares a scene. `epoch` tells this run of the server from others.
    ///
    /// # Errors
    /// A volume that makes no sense or is beyond the limits of the wire format, or such a source.
    pub fn new(
        mut scene: Scene,
        mut gatherer: Box<dyn Gather>,
        options: TickOptions,
        epoch: Epoch,
    ) -> Result<Self, ServerError> {
        let source = &options.source;
        if source.len() > limits::SOURCE_BYTES || source.chars().any(char::is_control) {
            return Err(ServerError::Source(source.clone()));
        }
        let volumes = if options.volumes.is_empty() {
            volumes(&mut scene, &mut *gatherer)?
        } else {
            options.volumes.clone()
        };
        check_volumes(&volumes)?;
        if let Some(laid_out) = &options.lightmap {
            options.lumel_coding.check(laid_out.layout.page_size)?;
        }
        let mut solver = Solver::new(&volumes, options.gather)?;
        solver.set_lightmap(&scene.snapshot(), options.lightmap.as_ref());
        let published = Published::all(&solver, options.lumel_coding, Vec::new());
        let told_scales = vec![None; published.len()];
        let budget = Budget::new(options.period, options.samples).filling(share(&solver));
        let lumel_pace = LumelPace::new(options.period, options.lumel_samples);
        let last = Report::default();
        let unwrapping = Unwrapping::new(options.charts.clone());
        Ok(Self {
            scene,
            gathering: Gathering::new(gatherer),
            looked: Vec::new(),
            solver,
            published,
            options,
            budget,
            lumel_pace,
            epoch,
            number: 0,
            told_scales,
            fields_are_news: false,
            next_catalog: 0,
            snapshot_bytes: 0,
            measured: None,
            last_now: None,
            temporary: Temporary::default(),
            unwrapping,
            last,
        })
    }

    /// What this server offers: the scene and its fields.
    pub fn catalog(&self) -> Catalog {
        Catalog {
            epoch: self.epoch,
            scene: SceneInfo {
                name: self.scene.name().to_owned(),
                root: self.scene.root_file().to_owned(),
            },
            tick_seconds: self.options.period,
            fields: self.describe(),
            unknown: Vec::new(),
        }
    }

    /// The scene.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// Takes in a file that an edit names ([`Scene::take_in`]), so that a tick need not read it.
    pub fn take_in(&mut self, file: FileRead) {
        self.scene.take_in(file);
    }

    /// The fields as the catalog lists them.
    fn describe(&self) -> Vec<FieldInfo> {
        let describe = |published: &Published| {
            let field = self.solver.light().field(published.id)?;
            Some(published.describe(field, &self.options.source))
        };
        self.published.iter().filter_map(describe).collect()
    }

    /// Computes the light of these volumes from the next tick on, of which the catalog then tells.
    /// Volumes that are there already go on as they are.
    ///
    /// # Errors
    /// As in [`Tick::new`]; nothing has changed then.
    pub fn set_volumes(&mut self, volumes: &[VolumeSpec]) -> Result<(), ServerError> {
        check_volumes(volumes)?;
        self.solver.set_volumes(volumes)?;
        let before = std::mem::take(&mut self.published);
        self.published = Published::all(&self.solver, self.options.lumel_coding, before);
        self.gathering.keep(|id| self.solver.ids().any(|there| there == id));
        self.fields_are_news = true;
        Ok(())
    }

    /// What the fields' shapes name by hash: layouts of lumels, and their charts.
    pub fn resources(&self) -> Vec<Resource> {
        let of_lightmap = |lightmap: &Lightmap| {
            let (layout, charts) = layout_resources(&lightmap.layout);
            [layout].into_iter().chain(charts)
        };
        self.light().lightmaps().flat_map(of_lightmap).collect()
    }

    /// The light as it was last published.
    pub fn light(&self) -> &Light {
        self.solver.light()
    }

    /// The number of the next tick.
    pub fn number(&self) -> u64 {
        self.number
    }

    /// Seconds from one tick to the next.
    pub fn period(&self) -> f64 {
        self.options.period
    }

    /// One tick at `now` seconds of the caller's clock, which must not run backwards. Everything
    /// that depends on it is the scene's time, so equal calls give equal light.
    pub fn step(&mut self, now: f64, mail: Mail, outlet: &mut dyn Outlet) -> Report {
        self.step_with(now, mail, outlet, Patience::Endless)
    }

    /// The same, but waits for light only so long. Jobs that take longer go on beside the ticks that
    /// follow, and the tick that finds them done takes them in. So edits and the scene's state do not
    /// wait while trees of a large model are built.
    pub fn step_within(
        &mut self,
        now: f64,
        mail: Mail,
        outlet: &mut dyn Outlet,
        patience: Duration,
    ) -> Report {
        self.step_with(now, mail, outlet, Patience::Until(Instant::now() + patience))
    }

    fn step_with(
        &mut self,
        now: f64,
        mail: Mail,
        outlet: &mut dyn Outlet,
        patience: Patience,
    ) -> Report {
        let began = Instant::now();
        let mut watch = Stopwatch::start();
        let mut report = Report { tick: self.number, ..Report::default() };
        let elapsed = self.last_now.map_or(0.0, |last| (now - last).clamp(0.0, LONGEST_STEP));

        let edits = self.apply_edits(elapsed, mail);
        if !edits.accepted.is_empty() {
            self.solver.expect_change();
        }
        report.seconds[Stage::Edits as usize] = watch.lap();

        self.scene.advance(elapsed);
        let scene = self.scene.snapshot();
        report.seconds[Stage::Animation as usize] = watch.lap();

        let (state, is_snapshot) =
            self.state_frame(&scene, &edits, now + began.elapsed().as_secs_f64());
        outlet.state(state, is_snapshot);
        report.seconds[Stage::Publish as usize] = watch.lap();

        self.follow(&scene, outlet);
        self.unwrap(&scene, outlet, matches!(patience, Patience::Endless));
        let (brought, build) = self.gather(&scene, patience);
        let gathering = watch.lap();
        report.seconds[Stage::Accelerate as usize] = build.min(gathering);
        report.seconds[Stage::Gather as usize] = gathering - build.min(gathering);

        self.blend(&brought);
        report.seconds[Stage::Blend as usize] = watch.lap();

        if std::mem::take(&mut self.fields_are_news) {
            self.tell_catalog(outlet);
        }
        let frames = self.encode(outlet);
        report.seconds[Stage::Encode as usize] = watch.lap();

        let watched = self.published.iter().any(|published| published.is_watched(outlet));
        if self.scales_are_news() {
            self.tell_catalog(outlet);
        }
        for (field, frame) in frames {
            outlet.light(field, frame);
        }
        report.seconds[Stage::Publish as usize] += watch.lap();

        let gathered = || brought.iter().filter(|brought| brought.gathered.is_some());
        report.rays = gathered().filter_map(|b| b.gathered.as_ref()).map(|g| g.rays).sum();
        report.samples = gathered().map(|brought| brought.asked.samples()).sum();
        report.accepted = edits.accepted.len() as u64;
        report.refused = edits.refused.len() as u64;
        // Clients ask for files then that they did not need before.
        report.files_changed = edits.accepted.iter().any(|accepted| accepted.edit.file().is_some());
        report.scene_version = scene.version;
        report.scene_time = scene.time;
        self.last_now = Some(now);
        self.finish(watched, report)
    }

    /// Lets lumels of what has moved go.
    fn follow(&mut self, scene: &Snapshot, outlet: &mut dyn Outlet) {
        let others = self.solver.follow(scene);
        if !others.is_empty() {
            self.lay_out(&others, outlet);
        }
    }

    /// The surfaces of these fields lie elsewhere, of which clients are told.
    fn lay_out(&mut self, fields: &[FieldId], outlet: &mut dyn Outlet) {
        for published in self.published.iter_mut().filter(|known| fields.contains(&known.id)) {
            if let Some(field) = self.solver.light().field(published.id) {
                published.lay_out(field);
            }
        }
        outlet.resources(self.resources());
        self.fields_are_news = true;
    }

    /// Gives lumels to what came later, once they are placed.
    fn unwrap(&mut self, scene: &Arc<Snapshot>, outlet: &mut dyn Outlet, waits: bool) {
        if self.unwrapping.is_idle()
            && let Some(newcomers) = self.solver.newcomers(scene)
        {
            self.unwrapping.start(newcomers);
        }
        let Some((newcomers, placed)) = self.unwrapping.poll(waits) else { return };
        let Some(placed) = placed else { return self.solver.leave_without_lumels(&newcomers) };
        let id = newcomers.field();
        // Their lumels are numbered anew.
        self.gathering.keep(|field| field != id);
        self.solver.extend_lightmap(scene, &newcomers, placed);
        self.budget = self.budget.filling(share(&self.solver));
        self.lay_out(&[id], outlet);
    }

    /// Applies the script's edits that are due and then the clients', each whole or not at all.
    fn apply_edits(&mut self, elapsed: f64, mail: Mail) -> Edits {
        let Mail { edits, refused, acks, gone } = mail;
        let mut outcome = Edits { accepted: Vec::new(), refused, acks };
        let left: Vec<_> = gone.iter().flat_map(|name| self.temporary.left_by(name)).collect();
        for node in left {
            // It may have gone already, with the node that it hung on.
            if let Ok(edit) = self.apply(&Edit::RemoveNode { node }) {
                outcome.accepted.push(AcceptedEdit { source: None, edit });
            }
        }
        let from = self.scene.time();
        let scripted: Vec<Edit> = match &self.options.script {
            Some(script) => script.due(from, from + elapsed).cloned().collect(),
            None => Vec::new(),
        };
        for edit in scripted {
            match self.apply(&edit) {
                Ok(edit) => outcome.accepted.push(AcceptedEdit { source: None, edit }),
                Err(reason) => tracing::warn!(%reason, "an edit of the script is refused"),
            }
        }
        for received in edits {
            let Received { client, seq, edit, temporary } = received;
            match self.apply(&edit) {
                Ok(edit) => {
                    self.temporary.edited(&client, &edit, temporary);
                    outcome.accepted.push(AcceptedEdit { source: Some((client, seq)), edit });
                }
                Err(reason) => outcome.refused.push(refusal(client, seq, &reason)),
            }
        }
        shorten(&mut outcome.refused);
        outcome
    }

    /// Applies one edit; the reason when it is refused.
    fn apply(&mut self, edit: &Edit) -> Result<Edit, String> {
        let frees = matches!(edit, Edit::RemoveNode { .. });
        let adds = matches!(edit, Edit::AddInstance { .. } | Edit::AddLight { .. });
        if !frees && !self.has_room(if adds { ADDING_ROOM } else { CHANGING_ROOM }) {
            return Err("edits have changed as much as a scene can hold: remove some first".into());
        }
        let edit = self.scene.apply(edit).map_err(|error| error.to_string())?;
        self.snapshot_bytes += json_bytes(&edit);
        Ok(edit)
    }

    /// Whether a snapshot is shorter than this. What is known of it is too much, since an edit may
    /// take the place of another; so it is measured before anything is refused, once a tick.
    fn has_room(&mut self, room: usize) -> bool {
        if self.snapshot_bytes > room && self.measured != Some(self.number) {
            self.snapshot_bytes = json_bytes(&self.scene.edits_since_load());
            self.measured = Some(self.number);
        }
        self.snapshot_bytes <= room
    }

    /// Sums for every field, all fields' jobs under way at once, and the seconds that building trees
    /// took for them.
    fn gather(&mut self, scene: &Arc<Snapshot>, patience: Patience) -> (Vec<Brought>, f64) {
        let moment = Moment { tick: self.number, time: scene.time, version: scene.version };
        let earlier = self.gathering.poll();
        let (mut light, _) = self.found(earlier);
        for id in self.idle() {
            let owes_light = self.looked.contains(&id);
            if let Some(look) = self.solver.look(id, scene).filter(|_| !owes_light) {
                self.gathering.submit(look, moment);
            }
        }
        let looked = self.gathering.wait(self.number, patience);
        let (more, build_for_looks) = self.found(looked);
        light.extend(more);

        let previous = self.options.feedback.then(|| Arc::new(self.light().clone()));
        let (samples, lumels) = (self.budget.samples(), Some(self.lumel_pace.samples()));
        let turn = Turn { previous, samples, lumels, pass: self.number };
        for id in self.idle() {
            if let Some(job) = self.solver.job(id, scene, turn.clone()) {
                self.looked.retain(|looked| *looked != id);
                self.gathering.submit(job, moment);
            }
        }
        let brought = self.gathering.wait(self.number, patience);
        let (more, build) = self.found(brought);
        light.extend(more);
        (light, build.max(build_for_looks))
    }

    /// The fields for which no job is under way.
    fn idle(&self) -> Vec<FieldId> {
        self.solver.ids().filter(|id| !self.gathering.is_at(*id)).collect()
    }

    /// Lets fields know where surfaces are, and returns what brought light, with the seconds that
    /// building trees took within this tick.
    fn found(&mut self, brought: Vec<Brought>) -> (Vec<Brought>, f64) {
        let of_now = brought.iter().filter(|brought| brought.moment.tick == self.number);
        let seconds =
            of_now.filter_map(|brought| brought.gathered.as_ref()).map(|g| g.build_seconds);
        let build = seconds.fold(0.0, f64::max);
        let (light, looks): (Vec<_>, Vec<_>) =
            brought.into_iter().partition(|brought| brought.asked.is_light());
        for Brought { asked, gathered, .. } in looks {
            self.looked.push(asked.field);
            match gathered {
                Some(found) => self.solver.take(&asked, &found),
                None => {
                    self.note_failure(asked.field, "its surfaces are those of an earlier moment")
                }
            }
        }
        (light, build)
    }

    fn note_failure(&mut self, field: FieldId, outcome: &str) {
        if let Some(published) = self.published_mut(field) {
            published.note_failure("gathering", outcome);
        }
    }

    fn published_mut(&mut self, field: FieldId) -> Option<&mut Published> {
        self.published.iter_mut().find(|published| published.id == field)
    }

    /// Takes in what was gathered; a field whose job has failed keeps its light.
    fn blend(&mut self, brought: &[Brought]) {
        for Brought { asked, moment, gathered } in brought {
            let Some(gathered) = gathered else {
                self.note_failure(asked.field, "it keeps its light");
                continue;
            };
            self.solver.take(asked, gathered);
            if let Some(samples) = asked.lumel_samples() {
                self.lumel_pace.record(samples, gathered.trace_seconds);
            }
            if let Some(published) = self.published_mut(asked.field) {
                published.show(*moment);
            }
        }
        if !brought.is_empty() {
            self.solver.solve_volumes(FIT_EFFORT);
            self.solver.solve_lightmaps(self.lumel_pace.blocks());
        }
    }

    /// Frames of every field that has new light, for the regions that somebody watches.
    fn encode(&mut self, outlet: &dyn Outlet) -> Vec<(u32, EncodedRegion)> {
        let mut frames = Vec::new();
        for published in &mut self.published {
            let id = published.id;
            let Some(field) = self.solver.light().field(id) else { continue };
            let encoded = published.encode(field, |region| outlet.is_watched(id.0, region));
            frames.extend(encoded.into_iter().map(|frame| (id.0, frame)));
        }
        frames
    }

    /// Whether clients are to be told of another scale now.
    fn scales_are_news(&self) -> bool {
        self.number >= self.next_catalog && self.scales() != self.told_scales
    }

    fn scales(&self) -> Vec<Option<i8>> {
        self.published.iter().map(Published::scale_log2).collect()
    }

    /// Sends the catalog, of which clients then know.
    fn tell_catalog(&mut self, outlet: &mut dyn Outlet) {
        outlet.catalog(&self.catalog());
        self.told_scales = self.scales();
        self.next_catalog = self.number + CATALOG_EVERY;
    }

    /// The state frame: a snapshot of the scene now and then, what changed otherwise.
    fn state_frame(&mut self, scene: &Snapshot, edits: &Edits, clock: f64) -> (Vec<u8>, bool) {
        let is_snapshot = self.number.is_multiple_of(SNAPSHOT_EVERY);
        let snapshot = is_snapshot
            .then(|| SceneState { edits: self.scene.edits_since_load(), acks: edits.acks.clone() });
        let frame = StateFrame {
            tick: self.number,
            time: scene.time,
            clock,
            version: scene.version,
            tick_ms: self.last.total_seconds() * 1e3,
            samples: self.last.samples_a_probe.into(),
            snapshot,
            edits: edits.accepted.clone(),
            refused: edits.refused.clone(),
        };
        (frame.encode(), is_snapshot)
    }

    /// Counts the tick and sets the samples of the next.
    fn finish(&mut self, watched: bool, mut report: Report) -> Report {
        let probes = self.solver.probe_count();
        report.samples_a_probe = self.budget.samples();
        report.probes = probes as u64;
        report.buried = self.solver.buried_count() as u64;
        let (gather, total) = (report.stage(Stage::Gather), report.total_seconds());
        report.late = if self.gathering.is_late() {
            self.budget.overrun()
        } else {
            self.budget.record(gather, total)
        };
        self.lumel_pace.finish(total);
        if report.late {
            tracing::debug!(tick = self.number, seconds = report.total_seconds(), "late");
        }
        if !watched {
            self.budget.rest();
        }
        self.number += 1;
        self.last = report.clone();
        report
    }
}

/// The share of the period that ticks aim to fill before lumels have the rest.
fn share(solver: &Solver) -> f64 {
    if solver.lumel_count() == 0 { Budget::SHARE } else { Budget::SHARE_BESIDE_LUMELS }
}

/// Cuts reasons where many edits are refused, so that a frame holds all refusals.
fn shorten(refused: &mut [RefusedEdit]) {
    let mut room = REASON_ROOM;
    for RefusedEdit { reason, .. } in refused {
        match room.checked_sub(reason.len()) {
            Some(left) => room = left,
            None => *reason = "refused, as many others".into(),
        }
    }
}

fn json_bytes(value: &impl serde::Serialize) -> usize {
    serde_json::to_vec(value).map_or(0, |json| json.len())
}

/// What became of a tick's edits.
struct Edits {
    accepted: Vec<AcceptedEdit>,
    refused: Vec<RefusedEdit>,
    acks: BTreeMap<String, u64>,
}
