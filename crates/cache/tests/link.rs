//! A server's frames through a simulated link into a cache.

use glam::{Quat, UVec3, Vec3};
use lumencast_cache::{Cache, CacheError, SceneEvent};
use lumencast_codec::{
    AcceptedEdit, Catalog, ClientEdit, DecodeError, Epoch, FieldInfo, LightFile, LightTrack,
    ProbeEncoder, RefusedEdit, SceneInfo, SceneState, Shape, StateFrame, UpdateInfo,
};
use lumencast_light::{FieldId, Grid, Order, ProbeVolume};
use lumencast_scene::{Edit, NodeId};
use lumencast_testkit::{Conditions, Link};

const TICK: f64 = 0.04;

/// A frame with the track that it is on.
#[derive(Clone)]
enum Sent {
    Catalog(Vec<u8>),
    State(Vec<u8>),
    Light { track: LightTrack, bytes: Vec<u8> },
}

/// A server with one field whose light is the same number everywhere, set by the test.
struct Server {
    catalog: Catalog,
    encoder: ProbeEncoder,
    volume: ProbeVolume,
    tick: u64,
    /// The server's clock is ahead of the client's.
    ahead: f64,
    scene: SceneState,
    accepted: Vec<AcceptedEdit>,
    refused: Vec<RefusedEdit>,
}

const FIELD: u32 = 7;

impl Server {
    fn new(epoch: u64) -> Self {
        let grid = Grid {
            center: Vec3::ZERO,
            rotation: Quat::IDENTITY,
            size: Vec3::new(12.0, 2.0, 2.0),
            resolution: UVec3::new(12, 2, 2),
        };
        let encoder = ProbeEncoder::new(grid.resolution, Order::L1);
        let volume = ProbeVolume::dark(FieldId(FIELD), grid, Order::L1);
        let field = FieldInfo::of_volume(&volume, None, "a test");
        assert_eq!(field.shape.regions().count(), 2);
        let scene = SceneInfo { name: "room".into(), root: "room.glb".into() };
        Self {
            catalog: Catalog {
                epoch: Epoch(epoch),
                scene,
                tick_seconds: TICK,
                fields: vec![field],
                unknown: vec![],
            },
            encoder,
            volume,
            tick: 0,
            ahead: 1000.0,
            scene: SceneState::default(),
            accepted: Vec::new(),
            refused: Vec::new(),
        }
    }

    fn shine(&mut self, value: f32) {
        for probe in 0..self.volume.grid.probe_count() {
            self.volume.probe_mut(probe)[0] = Vec3::splat(value);
        }
    }

    /// One tick's frames.
    fn tick(&mut self, now: f64) -> Vec<Sent> {
        let scene_time = self.tick as f64 * TICK;
        let state = StateFrame {
            tick: self.tick,
            time: scene_time,
            clock: now + self.ahead,
            version: 100 + self.tick,
            tick_ms: 1.0,
            samples: 16.0,
            snapshot: self.tick.is_multiple_of(16).then(|| self.scene.clone()),
            edits: std::mem::take(&mut self.accepted),
            refused: std::mem::take(&mut self.refused),
        };
        let info = UpdateInfo {
            update: self.tick,
            tick: self.tick,
            time: scene_time,
            scene_version: 100 + self.tick,
        };
        let probes = self.encoder.encode(&self.volume, info, |_| true).into_iter().map(|frame| {
            Sent::Light { track: track(FIELD, frame.region, frame.layer), bytes: frame.bytes }
        });
        self.tick += 1;
        std::iter::once(Sent::State(state.encode())).chain(probes).collect()
    }

    fn catalog(&self) -> Sent {
        Sent::Catalog(self.catalog.encode())
    }
}

fn track(field: u32, region: u32, layer: u8) -> LightTrack {
    LightTrack { field, region, layer }
}

fn take_in(cache: &mut Cache, sent: &Sent, now: f64) -> Result<(), CacheError> {
    match sent {
        Sent::Catalog(bytes) => cache.add_catalog(bytes, now),
        Sent::State(bytes) => cache.add_state(bytes, now).map(drop),
        Sent::Light { track, bytes } => cache.add_light(*track, bytes, now).map(drop),
    }
}

/// Takes in all that has arrived; lost bases are the only errors a link may cause.
fn receive(cache: &mut Cache, link: &mut Link<Sent>, now: f64) {
    while let Some((arrival, sent)) = link.receive(now) {
        match take_in(cache, &sent, arrival) {
            Ok(()) | Err(CacheError::Decode(DecodeError::MissingBase { .. })) => {}
            Err(error) => panic!("{error}"),
        }
    }
}

/// The light of the first and the last probe.
fn shown(cache: &mut Cache, now: f64) -> [f32; 2] {
    let light = cache.light(now);
    let volume = light.volumes().next().unwrap();
    [volume.probe(0)[0].x, volume.probe(volume.grid.probe_count() - 1)[0].x]
}

const NEAR: f32 = 0.04;

fn near(shown: [f32; 2], value: f32) -> bool {
    shown.iter().all(|s| (s - value).abs() <= NEAR * value)
}

#[test]
fn light_arrives_blended_with_its_age_and_version() {
    let mut server = Server::new(1);
    let mut cache = Cache::new();
    let mut link = Link::new(Conditions { delay: 0.1, ..Conditions::PERFECT }, 1);
    cache.add_catalog(&server.catalog.encode(), 0.0).unwrap();
    let mut trace = Vec::new();
    for step in 0..400 {
        let now = f64::from(step) * TICK / 4.0;
        if step % 4 == 0 {
            server.shine(if step < 200 { 1.0 } else { 3.0 });
            for sent in server.tick(now) {
                link.send(now, sent);
            }
        }
        receive(&mut cache, &mut link, now);
        trace.push(shown(&mut cache, now)[0]);
        if step > 40 {
            let light = cache.light(now);
            // The newest light was computed a delay and at most a tick ago; the server's clock as
            // estimated is late by the delay, so the age counts from the earliest possible arrival.
            let age = light.age.unwrap();
            assert!((-1e-9..TICK + 1e-9).contains(&age), "{age}");
            assert_eq!(light.scene_version, light.tick.map(|tick| tick + 100));
            assert!((cache.server_time(now).unwrap() - (now + 1000.0 - 0.1)).abs() < 1e-9);
            assert!((cache.scene_time(now).unwrap() - (now - 0.1)).abs() < TICK);
        }
    }
    assert!(trace[..10].iter().all(|v| *v == 0.0));
    assert!((trace[190] - 1.0).abs() < NEAR && (trace[399] - 3.0).abs() < 3.0 * NEAR);
    // On the way from 1 to 3 it passes values between, in order, and never overshoots.
    let way: Vec<f32> = trace[200..240].to_vec();
    assert!(way.windows(2).all(|pair| pair[1] >= pair[0] - 0.05));
    assert!(way.iter().any(|v| (1.3..2.7).contains(v)));
    assert!(trace.iter().all(|v| *v < 3.0 * (1.0 + NEAR)));
}

/// Passages take as long as was waited for what they lead to: with the first frame after layers have
/// been dropped, and for frames that come together, the time in which they were made.
/// State and light of both regions have to be there, with no tick missing; only another server's light need
/// not be of that tick.
#[test]
fn a_tick_is_reached_once_everything_is() {
    let mut server = Server::new(1);
    let mut cache = Cache::new();
    assert!(!cache.has_reached(0), "no catalog");
    take_in(&mut cache, &server.catalog(), 0.0).unwrap();
    for tick in 0..3_u32 {
        for sent in server.tick(f64::from(tick) * TICK) {
            assert!(!cache.has_reached(tick.into()));
            take_in(&mut cache, &sent, f64::from(tick) * TICK).unwrap();
        }
        assert!(cache.has_reached(tick.into()) && !cache.has_reached(u64::from(tick) + 1));
    }
    let other = FieldInfo { id: 8, epoch: Some(Epoch(5)), ..server.catalog.fields[0].clone() };
    server.catalog.fields.push(other);
    take_in(&mut cache, &server.catalog(), 0.2).unwrap();
    assert!(!cache.has_reached(2), "a field without light");
    let mut elsewhere = Server::new(5);
    for sent in elsewhere.tick(0.2) {
        if let Sent::Light { track, bytes } = sent {
            cache.add_light(LightTrack { field: 8, ..track }, &bytes, 0.2).unwrap();
        }
    }
    assert!(cache.has_reached(2), "its ticks are of another count");

    // A state is missed: until a snapshot it is not known what the scene is.
    server.tick(0.2);
    while server.tick < 16 {
        for sent in server.tick(0.2).into_iter() {
            // Deltas of light miss a base.
            let _ = take_in(&mut cache, &sent, 0.2);
        }
        assert!(!cache.has_reached(3));
    }
    for sent in server.tick(0.2) {
        let _ = take_in(&mut cache, &sent, 0.2);
    }
    assert!(cache.server_edits().is_some());
}

#[test]
fn passages_take_the_time_between_updates() {
    let mut server = Server::new(1);
    let mut cache = Cache::new();
    cache.add_catalog(&server.catalog.encode(), 0.0).unwrap();
    let frames: Vec<Vec<Sent>> = (0..33u16)
        .map(|tick| {
            server.shine(1.0 + f32::from(tick / 4));
            server.tick(f64::from(tick) * TICK)
        })
        .collect();
    let of_layer = |sent: &Sent, most: u8| match sent {
        Sent::Light { track, .. } => track.layer <= most,
        _ => true,
    };
    let arrive = |cache: &mut Cache, tick: usize, most: u8, now: f64| {
        for sent in frames[tick].iter().filter(|sent| of_layer(sent, most)) {
            take_in(cache, sent, now).unwrap();
        }
    };
    let time = |tick: usize| tick as f64 * TICK;
    (0..=16).for_each(|tick| arrive(&mut cache, tick, 2, time(tick)));
    assert!(near(shown(&mut cache, time(17)), 5.0));
    // From now on the lowest layer alone: every fourth update.
    (17..=20).for_each(|tick| arrive(&mut cache, tick, 0, time(tick)));
    assert!(near(shown(&mut cache, time(22)), 5.5), "half-way after half of four ticks");
    assert!(near(shown(&mut cache, time(24)), 6.0));
    // Two updates at once after a pause: the second was made four ticks after the first.
    (21..=28).for_each(|tick| arrive(&mut cache, tick, 0, time(28)));
    assert!(near(shown(&mut cache, time(28)), 6.0), "{:?}", shown(&mut cache, time(28)));
    assert!(near(shown(&mut cache, time(30)), 7.0), "half-way from 6 to 8");
    assert!(near(shown(&mut cache, time(32)), 8.0));
}

#[test]
fn an_overdue_update_leaves_the_newest_standing() {
    let mut server = Server::new(1);
    let mut cache = Cache::new();
    cache.add_catalog(&server.catalog.encode(), 0.0).unwrap();
    for tick in 0..10 {
        server.shine(1.0 + tick as f32);
        for sent in server.tick(tick as f64 * TICK) {
            take_in(&mut cache, &sent, tick as f64 * TICK).unwrap();
        }
    }
    let settled = shown(&mut cache, 1.0);
    assert!(near(settled, 10.0));
    assert_eq!(shown(&mut cache, 100.0), settled);
    let age = cache.light(100.0).age.unwrap();
    assert!((age - (100.0 - 9.0 * TICK)).abs() < 1e-6, "{age}");
    // The scene's time stands still after a second.
    assert!((cache.scene_time(100.0).unwrap() - (9.0 * TICK + 1.0)).abs() < 1e-6);
}

#[test]
fn loss_jitter_and_doubling_break_nothing() {
    for seed in 0..8 {
        let mut server = Server::new(1);
        let mut cache = Cache::of_client("me");
        let bad = Conditions { delay: 0.05, jitter: 0.15, loss: 0.2, doubled: 0.1 };
        let mut link = Link::new(bad, seed);
        cache.add_catalog(&server.catalog.encode(), 0.0).unwrap();
        let mut updates = 0;
        let mut last_tick = None;
        for tick in 0..1500 {
            let now = f64::from(tick) * TICK;
            if tick == 1200 {
                link.conditions = Conditions { delay: 0.05, ..Conditions::PERFECT };
            }
            let value = if tick < 1000 { 2.0 + (now * 0.1).sin() as f32 } else { 2.0 };
            server.shine(value);
            for sent in server.tick(now) {
                link.send(now, sent);
            }
            receive(&mut cache, &mut link, now);
            let shown = shown(&mut cache, now);
            if (120..1000).contains(&tick) {
                // A fifth of all keyframes, one in 1.6 s, is lost, and what builds on a lost frame:
                // light may be some seconds old, in which the wave moves by 0.1 a second.
                assert!(shown.iter().all(|s| (s - value).abs() < 0.7), "{tick}: {shown:?} {value}");
            }
            let light_tick = cache.light(now).tick;
            assert!(light_tick >= last_tick, "light went back in time");
            updates += u32::from(light_tick > last_tick);
            last_tick = light_tick;
        }
        assert!(near(shown(&mut cache, 1e4), 2.0));
        assert!(updates > 500, "{updates} of 1500 updates came through");
    }
}

#[test]
fn dropped_layers_lose_rate_and_nothing_else() {
    for kept in 0..3 {
        let mut server = Server::new(1);
        let mut cache = Cache::new();
        cache.add_catalog(&server.catalog.encode(), 0.0).unwrap();
        for tick in 0..100 {
            let now = f64::from(tick) * TICK;
            server.shine(1.0 + tick as f32 * 0.1);
            for sent in server.tick(now) {
                if matches!(sent, Sent::Light { track, .. } if track.layer > kept) {
                    continue;
                }
                // Not even a missing base: lower layers need no higher ones.
                take_in(&mut cache, &sent, now).unwrap();
            }
        }
        let newest = [96_u8, 98, 99][usize::from(kept)];
        assert_eq!(cache.light(10.0).tick, Some(newest.into()));
        assert!(near(shown(&mut cache, 10.0), 1.0 + f32::from(newest) * 0.1));
    }
}

#[test]
fn a_restarted_server_is_known_by_its_epoch() {
    let mut server = Server::new(1);
    let mut cache = Cache::of_client("me");
    let mut link = Link::new(Conditions::PERFECT, 1);
    link.send(0.0, server.catalog());
    server.shine(5.0);
    for tick in 0..50 {
        server
            .tick(f64::from(tick) * TICK)
            .into_iter()
            .for_each(|sent| link.send(f64::from(tick) * TICK, sent));
    }
    receive(&mut cache, &mut link, 2.0);
    cache.edit(Edit::RemoveNode { node: NodeId(1) }).unwrap();
    assert_eq!(cache.epoch(), Some(Epoch(1)));
    cache.scene_events();

    let mut server = Server::new(2);
    server.ahead = -3.0;
    link.send(10.0, server.catalog());
    receive(&mut cache, &mut link, 10.0);
    assert_eq!(cache.epoch(), Some(Epoch(2)));
    assert_eq!(cache.server_time(10.0), None);
    assert!(near(shown(&mut cache, 10.0), 5.0), "the light stays until new light is there");
    assert_eq!(cache.light(10.0).age, None);
    assert!(matches!(cache.scene_events()[..], [SceneEvent::Lost { seq: 1, .. }]));

    // The new server counts from 0 again, and all is taken in.
    server.shine(2.0);
    server.tick(10.0).into_iter().for_each(|sent| link.send(10.0, sent));
    receive(&mut cache, &mut link, 10.0);
    assert!(near(shown(&mut cache, 11.0), 2.0));
    assert_eq!(cache.light(11.0).tick, Some(0));
    assert!(matches!(cache.scene_events()[..], [SceneEvent::Snapshot(_)]));
}

/// One server lists the fields, others compute them: each is forgotten by its own epoch.
#[test]
fn a_field_s_own_epoch_tells_when_its_updates_begin_anew() {
    let mut cache = Cache::new();
    let computes = |epoch: u64| {
        let mut server = Server::new(1);
        server.catalog.fields[0].epoch = Some(Epoch(epoch));
        server
    };
    let feed = |cache: &mut Cache, server: &mut Server, now: f64| {
        server.tick(now).iter().for_each(|sent| take_in(cache, sent, now).unwrap());
    };
    let mut server = computes(8);
    cache.add_catalog(&server.catalog.encode(), 0.0).unwrap();
    server.shine(5.0);
    for tick in 0..50 {
        feed(&mut cache, &mut server, f64::from(tick) * TICK);
    }
    // Its ticks are not those of the state track: age counts from arrival.
    let light = cache.light(3.0);
    assert!((light.age.unwrap() - (3.0 - 49.0 * TICK)).abs() < 1e-9);
    assert_eq!((light.tick, light.scene_version), (None, None));

    // The catalog's server has restarted, the field's has not: its deltas go on.
    server.catalog.epoch = Epoch(2);
    cache.add_catalog(&server.catalog.encode(), 3.0).unwrap();
    assert_eq!(cache.server_time(3.0), None);
    assert!(cache.light(3.0).age.is_some());
    server.shine(2.0);
    feed(&mut cache, &mut server, 3.0);
    assert!(near(shown(&mut cache, 4.0), 2.0));

    // The field's server has restarted, the catalog's has not: update 0 is news again.
    let mut fresh = computes(9);
    fresh.catalog.epoch = Epoch(2);
    cache.add_catalog(&fresh.catalog.encode(), 4.0).unwrap();
    assert!(cache.server_time(4.0).is_some());
    assert_eq!(cache.light(4.0).age, None);
    assert!(near(shown(&mut cache, 4.0), 2.0), "the light stays until new light is there");
    fresh.shine(7.0);
    for sent in &fresh.tick(4.0)[1..] {
        take_in(&mut cache, sent, 4.0).unwrap();
    }
    assert!(near(shown(&mut cache, 5.0), 7.0));

    // Another word for the source, or the same epoch said elsewhere, is no restart.
    fresh.catalog.fields[0].source = "another word".into();
    fresh.catalog.epoch = Epoch(9);
    fresh.catalog.fields[0].epoch = None;
    cache.add_catalog(&fresh.catalog.encode(), 5.0).unwrap();
    assert_eq!(cache.light(5.0).tick, Some(0));
}

#[test]
fn a_reconnection_to_the_same_server_goes_on() {
    let mut server = Server::new(1);
    let mut cache = Cache::new();
    let mut link = Link::new(Conditions::PERFECT, 1);
    link.send(0.0, server.catalog());
    server.shine(5.0);
    for tick in 0..30 {
        let now = f64::from(tick) * TICK;
        let frames = server.tick(now);
        // Ticks 5 to 20 fall into an outage.
        if !(5..=20).contains(&tick) {
            frames.into_iter().for_each(|sent| link.send(now, sent));
        }
        if tick == 21 {
            link.send(now, server.catalog());
        }
        receive(&mut cache, &mut link, now);
        assert_eq!(cache.epoch(), Some(Epoch(1)));
    }
    // Layer 0's next frame after the outage lacks its base; keyframes come every 40 updates.
    assert!(near(shown(&mut cache, 2.0), 5.0));
}

#[test]
fn another_scale_changes_nothing_but_itself() {
    let mut server = Server::new(1);
    let mut cache = Cache::new();
    take_in(&mut cache, &server.catalog(), 0.0).unwrap();
    for tick in 0..6 {
        server.shine(8.0 + tick as f32);
        let now = f64::from(tick) * TICK;
        for sent in server.tick(now) {
            take_in(&mut cache, &sent, now).unwrap();
        }
    }
    let now = 5.5 * TICK;
    let before = shown(&mut cache, now);
    server.catalog.fields[0].scale_log2 = Some(4);
    take_in(&mut cache, &server.catalog(), now).unwrap();
    assert_eq!(cache.current_catalog().unwrap().fields[0].scale_log2, Some(4));
    assert_eq!(shown(&mut cache, now), before, "in the midst of a blend");
    // A delta: its base is still known.
    for sent in server.tick(6.0 * TICK) {
        take_in(&mut cache, &sent, 6.0 * TICK).unwrap();
    }
}

#[test]
fn a_saved_field_shows_until_a_server_s_light_comes() {
    let mut server = Server::new(1);
    server.shine(4.0);
    let scene = server.catalog.scene.clone();
    let file =
        LightFile::of_fields(scene, "", [&server.volume.clone().into()], UpdateInfo::default());
    let mut cache = Cache::new();
    cache.load(&file.write(), 0.0).unwrap();
    assert!(near(shown(&mut cache, 0.0), 4.0));
    assert_eq!((cache.epoch(), cache.light(5.0).age), (None, None));
    assert_eq!(cache.add_state(b"{}", 0.0), Err(CacheError::NoCatalog));

    // The server's volume is half as large; its probes read the saved light at their places.
    let Shape::Volume(shape) = &mut server.catalog.fields[0].shape else { panic!("a volume") };
    shape.grid.size *= 0.5;
    cache.add_catalog(&server.catalog.encode(), 1.0).unwrap();
    assert!(near(shown(&mut cache, 1.0), 4.0));
    server.shine(1.0);
    for sent in server.tick(1.0) {
        take_in(&mut cache, &sent, 1.0).unwrap();
    }
    assert!(near(shown(&mut cache, 2.0), 1.0));
    assert_eq!(cache.load(&file.write(), 2.0), Err(CacheError::Connected));
}

#[test]
fn fields_that_are_listed_no_longer_are_forgotten() {
    let mut server = Server::new(1);
    let mut cache = Cache::new();
    let mut catalog = server.catalog.clone();
    catalog.fields.push(FieldInfo { id: 8, ..catalog.fields[0].clone() });
    cache.add_catalog(&catalog.encode(), 0.0).unwrap();
    assert_eq!(cache.light(0.0).volumes().count(), 2);
    server.shine(3.0);
    let frames = server.tick(0.0);
    for sent in &frames {
        take_in(&mut cache, sent, 0.0).unwrap();
    }
    cache.add_catalog(&server.catalog.encode(), 0.1).unwrap();
    assert_eq!(cache.light(0.1).volumes().count(), 1);
    assert!(near(shown(&mut cache, 0.1), 3.0), "the other field keeps its light");
    assert_eq!(cache.light(0.1).tick, Some(0), "and its numbers");
    let Some(Sent::Light { bytes, .. }) = frames.last() else { panic!("no probe frames") };
    assert_eq!(cache.add_light(track(8, 0, 0), bytes, 0.2), Err(CacheError::UnknownField(8)));
    let unknown = CacheError::UnknownRegion { field: FIELD, region: 2 };
    assert_eq!(cache.add_light(track(FIELD, 2, 0), bytes, 0.2), Err(unknown));
    assert_eq!(
        cache.add_light(track(FIELD, 1, 1), bytes, 0.2),
        Err(CacheError::WrongLayer { update: 0, layer: 1 })
    );
}

#[test]
fn edits_are_seen_by_everyone_and_refusals_only_by_their_sender() {
    let mut server = Server::new(1);
    let mut caches = [Cache::of_client("me"), Cache::of_client("other")];
    for cache in &mut caches {
        cache.add_catalog(&server.catalog.encode(), 0.0).unwrap();
    }
    let tick = |server: &mut Server, caches: &mut [Cache; 2]| {
        let now = server.tick as f64 * TICK;
        for sent in server.tick(now) {
            for cache in caches.iter_mut() {
                take_in(cache, &sent, now).unwrap();
            }
        }
    };
    tick(&mut server, &mut caches);
    for node in [3, 999] {
        let bytes = caches[0].edit(Edit::RemoveNode { node: NodeId(node) }).unwrap();
        let ClientEdit { seq, edit, .. } = ClientEdit::decode(&bytes).unwrap();
        if node == 3 {
            server.scene.edits.push(edit.clone());
            server.accepted.push(AcceptedEdit { source: Some(("me".into(), seq)), edit });
        } else {
            server.refused.push(RefusedEdit {
                client: "me".into(),
                seq,
                reason: "no node 999".into(),
            });
        }
    }
    caches.iter_mut().for_each(|cache| drop(cache.scene_events()));
    tick(&mut server, &mut caches);
    let edit = Edit::RemoveNode { node: NodeId(3) };
    assert_eq!(
        caches[0].scene_events(),
        [
            SceneEvent::Edit { edit: edit.clone(), own: Some(1) },
            SceneEvent::Acknowledged { seq: 1 },
            SceneEvent::Refused {
                seq: 2,
                edit: Edit::RemoveNode { node: NodeId(999) },
                reason: "no node 999".into()
            },
        ]
    );
    assert!(caches[0].pending().is_empty());
    assert_eq!(caches[1].scene_events(), [SceneEvent::Edit { edit: edit.clone(), own: None }]);
    assert_eq!(caches[1].server_edits(), Some(&[edit][..]));
}

#[test]
fn rubbish_changes_nothing() {
    let mut server = Server::new(1);
    let mut cache = Cache::of_client("me");
    assert_eq!(cache.add_light(track(FIELD, 0, 0), b"", 0.0), Err(CacheError::NoCatalog));
    cache.add_catalog(&server.catalog.encode(), 0.0).unwrap();
    server.shine(3.0);
    let frames = server.tick(0.0);
    for sent in &frames {
        take_in(&mut cache, sent, 0.0).unwrap();
    }
    cache.scene_events();
    let before = shown(&mut cache, 1.0);
    let mut random = 1_u64;
    let mut next = || {
        random =
            random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (random >> 33) as usize
    };
    let mut refused = 0;
    for _ in 0..20_000 {
        // A keyframe's number stays 0, so that even one that decodes is no news.
        let mut sent = frames[next() % frames.len()].clone();
        let bytes = match &mut sent {
            Sent::Catalog(bytes) | Sent::State(bytes) | Sent::Light { bytes, .. } => bytes,
        };
        match next() % 3 {
            0 => bytes.truncate(next() % bytes.len()),
            1 => {
                let at = 3 + next() % (bytes.len() - 3);
                bytes[at] = next() as u8;
            }
            _ => bytes.extend((0..next() % 40).map(|i| i as u8 + 1)),
        }
        let is_state = matches!(sent, Sent::State(_));
        let result = take_in(&mut cache, &sent, 1.0);
        refused += u32::from(result.is_err());
        if is_state && result.is_ok() {
            // Mutated JSON may well be a later tick; start over.
            cache = Cache::of_client("me");
            cache.add_catalog(&server.catalog.encode(), 0.0).unwrap();
            for sent in &frames {
                take_in(&mut cache, sent, 0.0).unwrap();
            }
        }
    }
    assert!(refused > 10_000, "{refused}");
    assert_eq!(shown(&mut cache, 1.0), before);
}
