//! A running server as seen by its clients, over the real transport.

mod common;

use std::future::Future;
use std::io::Write;
use std::net::{TcpStream, UdpSocket};
use std::time::{Duration, Instant};

use bytes::Bytes;
use common::{PATIENCE, Serving, run};
use lumencast_cache::Cache;
use lumencast_codec::{ClientEdit, LightTrack, StateFrame};
use lumencast_scene::{Edit, InstanceSource, LightSpec, NodeId, Scene, Transform};
use lumencast_transport::{
    Broadcast, Client, ConnectOptions, Frame, ReadOptions, TrackReader, TrackWriter,
};

/// Small and quick: what matters here is the way.
const SMALL: [&str; 4] = ["--volume", "3x3x3", "--samples", "8..64"];

/// Runs a test on a runtime of its own, with a time limit.
fn limited(test: impl Future<Output = ()>) {
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(2)
        .enable_all()
        .build()
        .expect("a runtime");
    runtime.block_on(async {
        tokio::time::timeout(2 * PATIENCE, test).await.expect("the test takes too long");
    });
    runtime.shutdown_timeout(Duration::from_secs(1));
}

/// The track that is read.
const LIGHT: LightTrack = LightTrack { field: 0, region: 0, layer: 0 };

/// A client as a program would write one: the transport's tracks into the cache.
struct Follower {
    client: Client,
    cache: Cache,
    catalog: TrackReader,
    state: TrackReader,
    light: TrackReader,
    began: Instant,
}

/// What came.
enum Came {
    Catalog,
    State(StateFrame),
    Light,
    /// What the cache had no use for.
    Nothing,
}

impl Follower {
    /// A client that follows the state from now on: a track is read from its newest group when it is
    /// first asked for, so that what an edit caused until then would never come.
    async fn connect(server: &Serving) -> Self {
        let client =
            Client::connect(&server.url(), ConnectOptions::default()).await.expect("a connection");
        let read = |track, options| client.subscribe(client.scene(), track, options);
        // Every frame of the state counts.
        let all = ReadOptions::default().with_max_age(Duration::from_secs(5));
        let catalog = read("catalog", ReadOptions::default());
        let state = read("state", all);
        let light = read(&LIGHT.to_string(), ReadOptions::default());
        let (cache, began) = (Cache::new(), Instant::now());
        let mut follower = Self { client, cache, catalog, state, light, began };
        follower.next_state().await;
        follower
    }

    fn now(&self) -> f64 {
        self.began.elapsed().as_secs_f64()
    }

    /// Takes in the next frame of any track.
    async fn take(&mut self) -> Came {
        let next = |frame: lumencast_transport::Result<Option<Frame>>| {
            frame.expect("a frame").expect("the client goes on").bytes
        };
        tokio::select! {
            frame = self.catalog.next() => {
                let now = self.now();
                self.cache.add_catalog(&next(frame), now).expect("a catalog");
                Came::Catalog
            }
            frame = self.state.next() => {
                let bytes = next(frame);
                let now = self.now();
                match self.cache.add_state(&bytes, now) {
                    Ok(_) => Came::State(StateFrame::decode(&bytes).expect("a state frame")),
                    Err(_) => Came::Nothing,
                }
            }
            frame = self.light.next() => {
                let now = self.now();
                match self.cache.add_light(LIGHT, &next(frame), now) {
                    Ok(_) => Came::Light,
                    Err(_) => Came::Nothing,
                }
            }
        }
    }

    async fn next_state(&mut self) -> StateFrame {
        loop {
            if let Came::State(state) = self.take().await {
                return state;
            }
        }
    }

    /// Follows the state until it says what is looked for.
    async fn until<T>(&mut self, what: impl Fn(&StateFrame) -> Option<T>) -> T {
        loop {
            if let Some(found) = what(&self.next_state().await) {
                return found;
            }
        }
    }

    /// Mean of the green c0 over the probes once the next light is there, and its scene version.
    async fn next_light(&mut self) -> (f32, u64) {
        while !matches!(self.take().await, Came::Light) {}
        let now = self.now();
        let light = self.cache.light(now);
        let volume = light.volumes().next().expect("a volume");
        let probes = volume.grid.probe_count();
        let sum: f32 = (0..probes).map(|probe| volume.probe(probe)[0].y).sum();
        (sum / probes as f32, light.scene_version.expect("light of a version"))
    }

    fn editor(&self, name: &str) -> Editor {
        let path = format!("{}/edits/{name}", self.client.scene());
        let broadcast = self.client.publish(&path).expect("a broadcast");
        let track = broadcast.track("edits", 0).expect("a track");
        broadcast.announce().expect("announced");
        Editor { _broadcast: broadcast, track, seq: 0, temporary: false }
    }
}

/// A client's edits.
struct Editor {
    _broadcast: Broadcast,
    track: TrackWriter,
    seq: u64,
    temporary: bool,
}

impl Editor {
    fn send(&mut self, edit: Edit) -> u64 {
        self.seq += 1;
        let frame = ClientEdit { seq: self.seq, edit, temporary: self.temporary }.encode();
        self.track.write(frame.into(), false).expect("written");
        self.seq
    }
}

fn lamp() -> NodeId {
    let scene = Scene::builtin("cornell").expect("a built-in scene");
    scene.nodes().find(|node| node.name == "lamp").expect("a lamp").id
}

fn dim(node: NodeId, intensity: f32) -> Edit {
    Edit::SetLight { node, light: LightSpec { intensity: Some(intensity), ..LightSpec::default() } }
}

#[test]
fn an_edit_of_one_client_changes_the_light_of_another() {
    let server = Serving::start("cornell", &SMALL);
    limited(async {
        let mut watcher = Follower::connect(&server).await;
        let author = Follower::connect(&server).await;
        // The light of the first ticks is noisy.
        let mut before = 0.0;
        for _ in 0..5 {
            before = watcher.next_light().await.0;
        }
        assert!(before > 0.0);
        let mut editor = author.editor("author");
        let seq = editor.send(dim(lamp(), 300.0));
        let source = Some(("author".to_owned(), seq));
        let version = watcher
            .until(|state| {
                let accepted = state.edits.iter().any(|edit| edit.source == source);
                accepted.then_some(state.version)
            })
            .await;
        let began = Instant::now();
        loop {
            let (light, from) = watcher.next_light().await;
            if from >= version && light > 5.0 * before {
                break;
            }
            assert!(began.elapsed() < PATIENCE, "{before}, still {light}");
        }
    });
    // Counted at the end of the tick that told of it.
    server.wait_for_metric("lumencast_edits_accepted_total", |n| n == 1.0);
}

#[test]
fn clients_beyond_the_limit_are_refused() {
    let server = Serving::start("cornell", &[&SMALL[..], &["--clients", "1"]].concat());
    limited(async {
        let first = Follower::connect(&server).await;
        let mut options = ConnectOptions::default();
        options.timeout = Duration::from_millis(500);
        assert!(Client::connect(&server.url(), options).await.is_err());
        drop(first);
    });
}

#[test]
fn a_refused_edit_comes_back_with_its_reason() {
    let server = Serving::start("cornell", &SMALL);
    limited(async {
        let mut follower = Follower::connect(&server).await;
        let mut editor = follower.editor("a");
        editor.send(Edit::RemoveNode { node: NodeId(99_999) });
        editor.send(dim(lamp(), -1.0));
        let mut reasons = Vec::new();
        while reasons.len() < 2 {
            let refused = follower.next_state().await.refused;
            reasons.extend(refused.into_iter().map(|r| (r.client, r.seq, r.reason)));
        }
        for ((client, seq, reason), (number, word)) in
            reasons.iter().zip([(1, "99999"), (2, "intensity")])
        {
            assert_eq!((client.as_str(), *seq), ("a", number));
            assert!(reason.contains(word), "{reason}");
        }
    });
    // Counted at the end of the tick that told of it.
    server.wait_for_metric("lumencast_edits_refused_total", |n| n == 2.0);
}

#[test]
fn another_gltf_is_served_once_it_is_in_the_scene() {
    let folder = common::Folder::new("added");
    let model = Serving::start("cornell", &SMALL).get("/scene/cornell.glb").body;
    let scene = folder.file("scene.glb", &model);
    folder.file("model.glb", &model);
    let server = Serving::start(&scene, &SMALL);
    assert_eq!(server.get("/scene/model.glb").status, 404, "not yet part of the scene");
    limited(async {
        let mut follower = Follower::connect(&server).await;
        let mut editor = follower.editor("a");
        for (name, accepted) in [("../outside.glb", false), ("model.glb", true)] {
            let seq = editor.send(Edit::AddInstance {
                node: None,
                name: None,
                source: InstanceSource::File(name.into()),
                parent: None,
                transform: Transform::default(),
            });
            let answer = |state: &StateFrame| {
                let edit = state.edits.iter().find(|e| e.source == Some(("a".into(), seq)));
                let refused = state.refused.iter().any(|r| r.seq == seq);
                edit.map(|e| Some(e.edit.clone())).or(refused.then_some(None))
            };
            let answer = follower.until(answer).await;
            assert_eq!(answer.is_some(), accepted, "{name}");
            if let Some(edit) = answer {
                assert!(matches!(edit, Edit::AddInstance { node: Some(_), .. }), "{edit:?}");
            }
        }
    });
    server.wait_for_metric("lumencast_edits_accepted_total", |n| n == 1.0);
    assert_eq!(server.get("/scene/model.glb").body, model);
}

#[test]
fn rubbish_of_one_client_disturbs_no_other() {
    let server = Serving::start("cornell", &SMALL);
    limited(async {
        let mut good = Follower::connect(&server).await;
        let bad = Follower::connect(&server).await;
        let mut rubbish = bad.editor("rubbish");
        for i in 0..100_u8 {
            let frame = vec![i; 1 + usize::from(i) * 400];
            rubbish.track.write(Bytes::from(frame), i % 7 == 0).expect("written");
        }
        throw_rubbish_at(&server);
        // A client that is gone without a word.
        drop(bad);
        let mut editor = good.editor("good");
        let seq = editor.send(dim(lamp(), 1.0));
        let source = Some(("good".to_owned(), seq));
        good.until(|state| state.edits.iter().any(|e| e.source == source).then_some(())).await;
        let (light, _) = good.next_light().await;
        assert!(light > 0.0);
    });
    assert_eq!(server.get("/healthz").status, 200);
}

/// Bytes that are no HTTP, no TLS and no QUIC.
fn throw_rubbish_at(server: &Serving) {
    let udp = UdpSocket::bind("127.0.0.1:0").expect("a socket");
    for i in 0..200_u32 {
        let bytes: Vec<u8> = (0..i * 6).map(|k| (k.wrapping_mul(i ^ 0x9e37) >> 3) as u8).collect();
        udp.send_to(&bytes, server.address).expect("sent");
        if i % 10 == 0 {
            let mut tcp = TcpStream::connect(server.address).expect("the server listens");
            // It may hang up in the middle.
            let _ = tcp.write_all(&bytes);
        }
    }
}

#[test]
fn a_killed_client_is_not_missed() {
    let server = Serving::start("cornell", &SMALL);
    limited(async {
        let mut follower = Follower::connect(&server).await;
        let mut other = common::Program::start(&["inspect", &server.url(), "--json"]);
        let first = follower.next_state().await.tick;
        other.kill();
        follower.until(|state| (state.tick > first + 25).then_some(())).await;
    });
}

#[test]
fn a_restarted_server_is_found_again() {
    let mut server = Serving::start("cornell", &SMALL);
    let port = server.address.port();
    let old = server.ready["epoch"].clone();
    limited(async {
        let mut follower = Follower::connect(&server).await;
        let (before, _) = follower.next_light().await;
        let epoch = follower.cache.epoch();
        server.program.kill();
        let standing =
            follower.cache.light(follower.now()).volumes().next().expect("a volume").clone();
        assert!(standing.coefficients.iter().any(|c| c.y > 0.0), "the light stays: {before}");

        let restarted = Serving::on("cornell", port, &SMALL);
        assert_ne!(restarted.ready["epoch"], old, "an epoch of its own");
        while follower.cache.epoch() == epoch {
            follower.take().await;
        }
        assert_eq!(serde_json::json!(follower.cache.epoch()), restarted.ready["epoch"]);
        let (after, _) = follower.next_light().await;
        assert!(after > 0.0);
    });
}

#[test]
fn inspect_shows_a_running_server() {
    let server = Serving::start("cornell", &SMALL);
    let ran = run(&["inspect", &server.url(), "--json"]);
    assert_eq!(ran.code, Some(0), "{ran:?}");
    let report = ran.json();
    assert_eq!(report["epoch"], server.ready["epoch"]);
    assert_eq!(report["fields"][0]["epoch"], server.ready["epoch"]);
    assert_eq!(report["fields"][0]["source"], "cpu path tracing");
    assert_eq!(report["fields"][0]["probes"], 27);
    assert!(report["fields"][0]["c0"]["mean"].as_f64().is_some_and(|c0| c0 > 0.0), "{report}");
    assert!(report["state"]["tick"].is_u64());

    let nobody = format!("http://{}/cornell", free_address());
    run(&["inspect", &nobody]).failed_saying(&[&nobody]);
}

/// Ticks are slow here: a look at what the last snapshot held would be seconds behind.
#[test]
fn inspect_tells_what_is_and_not_what_was() {
    let server = Serving::start("cornell", &[&SMALL[..], &["--rate", "5"]].concat());
    limited(async {
        let mut follower = Follower::connect(&server).await;
        let mut editor = follower.editor("a");
        for (edits, intensity) in [(1, 123.5), (2, 23_456.0)] {
            let seq = editor.send(dim(lamp(), intensity));
            let source = Some(("a".to_owned(), seq));
            let accepted = |state: &StateFrame| {
                state.edits.iter().any(|edit| edit.source == source).then_some(state.tick)
            };
            let tick = follower.until(accepted).await;
            let seen = run(&["inspect", &server.url(), "--json"]).json();
            assert!(seen["state"]["tick"].as_u64() >= Some(tick), "{tick}: {seen}");
            assert!(seen["state"]["edits_since_load"].as_u64() >= Some(1), "{edits}: {seen}");
            let light = seen["lights"].as_array().and_then(|lights| lights.first());
            let light = light.unwrap_or_else(|| panic!("no light: {seen}"));
            assert_eq!((&light["name"], &light["node"]), (&"lamp".into(), &lamp().0.into()));
            assert_eq!(light["light"]["intensity"], intensity);
        }
    });
    let words = run(&["inspect", &server.url()]).stdout;
    for said in ["lights (1)", "intensity 23,456 cd", "name lamp", "period: 0.2 s", "cd/m²"] {
        assert!(words.contains(said), "{said}: {words}");
    }
}

/// An address at which nobody listens.
fn free_address() -> std::net::SocketAddr {
    let listener = std::net::TcpListener::bind("127.0.0.1:0").expect("a free port");
    listener.local_addr().expect("an address")
}

#[test]
fn a_token_is_needed_where_one_is_asked_for() {
    let folder = common::Folder::new("access");
    let key = folder.0.join("key.jwk").to_str().expect("text").to_owned();
    let token = run(&["token", "cornell", "--token-key", &key, "--generate"]).stdout;
    let mut arguments = SMALL.to_vec();
    arguments.extend(["--token-key", &key]);
    let server = Serving::start("cornell", &arguments);
    limited(async {
        let mut stranger = Follower::connect(&server).await;
        let mut strange = stranger.editor("stranger");
        strange.send(dim(lamp(), 1.0));

        let mut options = ConnectOptions::default();
        options.token = Some(token.trim().to_owned());
        let client = Client::connect(&server.url(), options).await.expect("a connection");
        let broadcast = client.publish("cornell/edits/bearer").expect("a broadcast");
        let mut track = broadcast.track("edits", 0).expect("a track");
        broadcast.announce().expect("announced");
        let frame = ClientEdit { seq: 1, edit: dim(lamp(), 2.0), temporary: false }.encode();
        track.write(frame.into(), true).expect("written");
        let first = stranger
            .until(|state| Some(state.edits.first()?.source.clone()))
            .await
            .expect("a client's edit");
        assert_eq!(first.0, "bearer");
    });
    // Counted at the end of the tick that told of it.
    server.wait_for_metric("lumencast_edits_accepted_total", |n| n == 1.0);
}

/// Who edits under another's name is not read while the other is there, and those who show its key
/// take over from a connection that is dead.
#[test]
fn a_name_belongs_to_whoever_has_its_key() {
    let server = Serving::start("cornell", &SMALL);
    limited(async {
        let mut victim = Follower::connect(&server).await;
        let mut edits = victim.editor("victim.key");
        let first = edits.send(dim(lamp(), 1.0));
        let accepted = |state: &StateFrame, seq| {
            let source = Some(("victim".to_owned(), seq));
            state.edits.iter().any(|edit| edit.source == source).then(|| state.edits.clone())
        };
        victim.until(|state| accepted(state, first)).await;

        let (impostor, keyless) =
            (Follower::connect(&server).await, Follower::connect(&server).await);
        let mut false_edits = impostor.editor("victim.guess");
        let mut keyless_edits = keyless.editor("victim");
        for intensity in [5.0, 6.0, 7.0] {
            false_edits.send(dim(lamp(), intensity));
            keyless_edits.send(dim(lamp(), intensity));
        }
        let back = Follower::connect(&server).await;
        let mut continued = back.editor("victim.key");
        continued.seq = 10;
        let eleventh = continued.send(dim(lamp(), 2.0));
        let applied = victim.until(|state| accepted(state, eleventh)).await;
        assert_eq!(applied.iter().map(|edit| &edit.edit).collect::<Vec<_>>(), [&dim(lamp(), 2.0)]);
    });
    server.wait_for_metric("lumencast_edits_accepted_total", |n| n == 2.0);
}

/// A broken file of many names, and others who edit meanwhile.
#[test]
fn files_that_edits_name_hold_nobody_up() {
    let folder = common::Folder::new("named");
    let model = Serving::start("cornell", &SMALL).get("/scene/cornell.glb").body;
    let scene = folder.file("scene.glb", &model);
    folder.file("broken.glb", &[b'{'; 1 << 20]);
    let server = Serving::start(&scene, &SMALL);
    limited(async {
        let mut watcher = Follower::connect(&server).await;
        let mut slow = watcher.editor("slow");
        let mut quick = watcher.editor("quick");
        for number in 0..100 {
            let file = format!("{}broken.glb", "./".repeat(number));
            slow.send(Edit::AddInstance {
                node: None,
                name: None,
                source: lumencast_scene::InstanceSource::File(file),
                parent: None,
                transform: lumencast_scene::Transform::default(),
            });
        }
        quick.send(dim(lamp(), 2.0));
        let (mut refused, mut accepted) = (0, 0);
        while refused < 100 || accepted < 1 {
            let state = watcher.next_state().await;
            refused += state.refused.len();
            accepted += state.edits.len();
            assert!(state.refused.iter().all(|r| r.client == "slow" && r.reason.contains("glTF")));
        }
    });
}

/// A name and a lamp of a client that has gone, which go in their time.
#[test]
fn what_a_client_adds_for_its_time_goes_with_it() {
    let server = Serving::start("cornell", &SMALL);
    limited(async {
        let mut watcher = Follower::connect(&server).await;
        let guest = Follower::connect(&server).await;
        let lamp = |name: &str| Edit::AddLight {
            node: None,
            name: lumencast_scene::NodeName::new(name),
            light: Scene::builtin("cornell").expect("built in").lights()[0].light,
            parent: None,
            transform: lumencast_scene::Transform::default(),
        };
        let mut edits = guest.editor("guest");
        edits.send(lamp("it stays"));
        edits.temporary = true;
        edits.send(lamp("it goes"));
        let named = |state: &StateFrame, wanted: &str| {
            state.edits.iter().find_map(|accepted| match &accepted.edit {
                Edit::AddLight { node, name: Some(name), .. } if name.as_str() == wanted => *node,
                _ => None,
            })
        };
        let added = watcher.until(|state| named(state, "it goes")).await;
        drop((edits, guest));
        let removed = watcher.until(|state| {
            let edit = state.edits.first()?;
            Some((edit.source.clone(), edit.edit.clone()))
        });
        assert_eq!(removed.await, (None, Edit::RemoveNode { node: added }));
    });
}
