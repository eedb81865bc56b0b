//! A session with a server in the same process.

use std::sync::Arc;
use std::time::{Duration, Instant};

use glam::Vec3;
use lumencast_client::{ClientError, Replica, Session, SessionOptions, current_tick, download};
use lumencast_gather::path_trace::{CpuPathTracer, Options};
use lumencast_scene::{Scene, Script};
use lumencast_server::{SampleRange, Server, ServerConfig};
use tokio::sync::oneshot;
use tokio::task::JoinHandle;

/// A step that takes longer has failed.
const STEP: Duration = Duration::from_secs(120);

struct Running {
    address: String,
    stop: oneshot::Sender<()>,
    ended: JoinHandle<()>,
}

impl Running {
    /// A server of a built-in scene, on a port that is free or was before.
    async fn new(listen: &str, script: Option<Script>) -> Self {
        let network = lumencast_transport::ServerConfig::new(listen.parse().unwrap());
        let mut config = ServerConfig::new(network);
        config.tick.samples = SampleRange::fixed(2);
        config.tick.script = script;
        let scene = Scene::open("cornell").unwrap();
        let mut volume = scene.volumes()[0];
        volume.grid.resolution = glam::UVec3::splat(3);
        config.tick.volumes = vec![volume];
        let tracer = CpuPathTracer::new(Options::default()).unwrap();
        let server = Server::bind(scene, Box::new(tracer), config).await.unwrap();
        let address = format!("http://{}/{}", server.local_addr(), server.scene_name());
        let (stop, stopped) = oneshot::channel::<()>();
        let ended = tokio::spawn(async {
            let told = async { drop(stopped.await) };
            server.run(told).await.unwrap();
        });
        Self { address, stop, ended }
    }

    async fn end(self) {
        self.stop.send(()).unwrap();
        self.ended.await.unwrap();
    }
}

async fn session(server: &Running) -> Session {
    Session::connect(&server.address, SessionOptions::default()).await.unwrap()
}

/// Waits until something holds.
async fn until(what: &str, mut holds: impl FnMut() -> bool) {
    let began = Instant::now();
    while !holds() {
        assert!(began.elapsed() < STEP, "{what}");
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
}

fn irradiance(session: &Session) -> f32 {
    session.light(Instant::now(), |light| light.irradiance(Vec3::new(0.0, 1.0, 0.0), Vec3::Y).y)
}

#[tokio::test(flavor = "multi_thread")]
async fn light_arrives_and_stays_when_the_server_goes() {
    let server = Running::new("127.0.0.1:0", None).await;
    let session = session(&server).await;
    until("light comes", || irradiance(&session) > 0.0).await;
    until("it has an age", || session.light(Instant::now(), |light| light.age.is_some())).await;
    until("ticks are counted", || session.statistics(Instant::now()).ticks > 1.0).await;
    let statistics = session.statistics(Instant::now());
    assert!(statistics.bytes > 100.0 && statistics.frames > 0.0, "{statistics:?}");
    assert_eq!((statistics.samples, statistics.dropped), (Some(2.0), 0));

    let listen = server.address.trim_start_matches("http://").trim_end_matches("/cornell");
    let listen = listen.to_owned();
    let epoch = session.catalog().unwrap().epoch;
    server.end().await;
    until("the loss is noticed", || {
        session.connection() != lumencast_transport::ConnectionState::Connected
    })
    .await;
    assert!(irradiance(&session) > 0.0, "the light stays");
    let server = Running::new(&listen, None).await;
    until("the new server is known", || session.catalog().unwrap().epoch != epoch).await;
    until("its light comes", || {
        session.light(Instant::now(), |light| light.tick.is_some_and(|tick| tick > 0))
    })
    .await;
    server.end().await;
}

/// Downloaded, with the edits of the server's script, at the server's time.
#[tokio::test(flavor = "multi_thread")]
async fn the_replica_is_the_servers_scene() {
    let lamp = {
        let scene = Scene::open("cornell").unwrap();
        scene.nodes().find(|node| node.light.is_some()).expect("a lamp").id
    };
    let dim = |at: f64, intensity: f32| {
        let edit = serde_json::json!({ "edit": "set_light", "node": lamp, "intensity": intensity });
        serde_json::json!({ "at": at, "edit": edit }).to_string()
    };
    let script = Script::parse(&[dim(0.0, 3.0), dim(1.5, 7.0)].join("\n")).unwrap();
    let server = Running::new("127.0.0.1:0", Some(script)).await;
    let mut heard = Vec::new();
    let files = download(&server.address, |done, all| heard.push((done, all))).await.unwrap();
    assert_eq!(heard.last().map(|(done, all)| done == all), Some(true));
    let scene = Scene::load(files.root()).unwrap();
    let session = session(&server).await;
    let mut replica = Replica::new(scene);
    let intensity = |replica: &Replica| {
        let node = replica.scene().nodes().find(|node| node.id == lamp);
        node.and_then(|node| node.light).map(|light| light.intensity)
    };
    until("the second edit is followed", || {
        replica.update(&session, Instant::now());
        intensity(&replica) == Some(7.0)
    })
    .await;
    assert_eq!(replica.missed(), 0);
    let before = replica.snapshot();
    until("what is animated moves", || {
        replica.update(&session, Instant::now());
        !Arc::ptr_eq(&replica.snapshot(), &before)
    })
    .await;
    let apart = replica.scene().time() - session.scene_time(Instant::now()).unwrap();
    assert!(apart.abs() < 0.5, "{apart} s");
    let folder = files.folder().to_owned();
    drop(files);
    assert!(!folder.exists(), "nothing is left behind");
    server.end().await;
}

/// Whoever has reached the tick that the server tells knows of nothing older.
#[tokio::test(flavor = "multi_thread")]
async fn what_is_reached_is_no_older_than_the_question() {
    let server = Running::new("127.0.0.1:0", None).await;
    for _ in 0..3 {
        let session = session(&server).await;
        let tick = current_tick(&server.address).await.unwrap();
        tokio::time::timeout(STEP, session.reached(tick)).await.expect("light of now");
        assert!(session.state().unwrap().tick >= tick);
        assert_eq!(session.edits(), Some(Vec::new()));
        let light = session.light(Instant::now(), |light| light.tick);
        assert!(light >= Some(tick), "{light:?}, asked at {tick}");
        assert!(session.statistics(Instant::now()).received > 100);
    }
    server.end().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn what_is_not_there_is_told() {
    let server = Running::new("127.0.0.1:0", None).await;
    let elsewhere = server.address.replace("cornell", "sponza");
    let error = Session::connect(&elsewhere, SessionOptions::default()).await.err();
    let error = error.expect("no such scene");
    assert!(matches!(error, ClientError::NoScene { .. }), "{error}");
    assert!(error.to_string().contains("sponza"), "{error}");
    let closed = server.address.clone();
    server.end().await;
    let error = download(&closed, |_, _| ()).await.expect_err("nobody is there").to_string();
    assert!(error.contains(&closed[..20]) && error.contains("refused"), "{error}");
}
