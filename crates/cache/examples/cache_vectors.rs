//! Writes `vectors/cache.json`: what a client's cache is to show of what a server sends.
//!
//! ```sh
//! cargo run -p lumencast-cache --example cache_vectors > vectors/cache.json
//! ```
//!
//! A scenario is a list of steps, each at a time of the client's clock. A step takes in a `catalog`, a
//! `state` frame, `light` of a track (`frame` in hexadecimal digits; `news` tells whether it is newer than
//! what the region had, `refused` why it is not taken in), or a file to `load`. A step that `shows` says what
//! is to be seen then: of each field coefficient 0 of its first and its last probe, red, or null where
//! nothing is shown; the age of the newest light; the scene's time. What is to be seen is written here by
//! hand, from the rules of docs/wire.md.
#![expect(clippy::print_stdout, reason = "a program for the terminal")]

use glam::{Quat, UVec3, Vec3};
use lumencast_codec::{
    Catalog, EncodedRegion, Epoch, FieldInfo, LightFile, ProbeEncoder, SceneInfo, SceneState,
    StateFrame, UpdateInfo,
};
use lumencast_light::{FieldId, Grid, Order, ProbeVolume};
use serde_json::{Value, json};

const TICK: f64 = 0.04;
const FIELD: u32 = 7;

/// A server with one volume of two regions, whose light is the same number everywhere.
struct Server {
    catalog: Catalog,
    volume: ProbeVolume,
    encoder: ProbeEncoder,
    tick: u64,
}

impl Server {
    fn new(epoch: u64, size: f32) -> Self {
        let grid = Grid {
            center: Vec3::ZERO,
            rotation: Quat::IDENTITY,
            size: Vec3::new(12.0, 2.0, 2.0) * size,
            resolution: UVec3::new(12, 2, 2),
        };
        let volume = ProbeVolume::dark(FieldId(FIELD), grid, Order::L1);
        let catalog = Catalog {
            epoch: Epoch(epoch),
            scene: SceneInfo { name: "room".into(), root: "room.glb".into() },
            tick_seconds: TICK,
            fields: vec![FieldInfo::of_volume(&volume, None, "a test")],
            unknown: vec![],
        };
        let encoder = ProbeEncoder::new(grid.resolution, Order::L1);
        Self { catalog, volume, encoder, tick: 0 }
    }

    fn catalog(&self) -> Value {
        json(&self.catalog.encode())
    }

    fn shine(&mut self, value: f32) {
        for probe in 0..self.volume.grid.probe_count() {
            self.volume.probe_mut(probe)[0] = Vec3::splat(value);
        }
    }

    /// The next tick's light, one value everywhere.
    fn light(&mut self, value: f32) -> Vec<EncodedRegion> {
        self.shine(value);
        let info = UpdateInfo { update: self.tick, tick: self.tick, ..UpdateInfo::default() };
        self.tick += 1;
        self.encoder.encode(&self.volume, info, |_| true)
    }
}

/// Steps of a scenario.
struct Steps(Vec<Value>);

impl Steps {
    fn push(&mut self, at: f64, step: Value) {
        let mut step = step;
        step["at"] = at.into();
        self.0.push(step);
    }

    fn catalog(&mut self, at: f64, catalog: Value) {
        self.push(at, json!({ "catalog": catalog }));
    }

    fn snapshot(&mut self, at: f64, tick: u64, time: f64, clock: f64) {
        let snapshot = Some(SceneState::default());
        let frame = StateFrame { tick, time, clock, version: 1, snapshot, ..StateFrame::default() };
        self.push(at, json!({ "state": json(&frame.encode()) }));
    }

    /// Light that is newer than what there was.
    fn light(&mut self, at: f64, frames: &[EncodedRegion]) {
        frames.iter().for_each(|frame| self.frame(at, FIELD, frame, json!({ "news": true })));
    }

    fn frame(&mut self, at: f64, field: u32, frame: &EncodedRegion, outcome: Value) {
        let EncodedRegion { region, layer, .. } = *frame;
        let light =
            json!({ "field": field, "region": region, "layer": layer, "frame": hex(&frame.bytes) });
        let mut step = outcome;
        step["light"] = light;
        self.push(at, step);
    }

    fn shows(&mut self, at: f64, first: Option<f64>, last: Option<f64>) {
        let field = json!({ "field": FIELD, "first": first, "last": last });
        self.push(at, json!({ "shows": { "fields": [field] } }));
    }

    fn shows_all(&mut self, at: f64, value: f64) {
        self.shows(at, Some(value), Some(value));
    }
}

fn json(frame: &[u8]) -> Value {
    serde_json::from_slice(frame).expect("JSON")
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

fn scenario(name: &str, steps: impl FnOnce(&mut Steps)) -> Value {
    let mut written = Steps(Vec::new());
    steps(&mut written);
    json!({ "name": name, "client": "me", "steps": written.0 })
}

fn refused(why: &str) -> Value {
    json!({ "refused": why })
}

fn blending() -> Value {
    scenario("the first light shows at once, the next after as long as it took", |steps| {
        let mut server = Server::new(1, 1.0);
        steps.catalog(0.0, server.catalog());
        steps.shows(0.0, None, None);
        steps.light(1.0, &server.light(1.0));
        steps.shows_all(1.0, 1.0);
        steps.light(1.04, &server.light(2.0));
        steps.shows_all(1.04, 1.0);
        steps.shows_all(1.06, 1.5);
        steps.shows_all(1.08, 2.0);
        steps.shows_all(9.0, 2.0);
        // After a long silence the passage takes half a second at most.
        steps.light(9.0, &server.light(4.0));
        steps.shows_all(9.25, 3.0);
        steps.shows_all(9.5, 4.0);
    })
}

fn regions() -> Value {
    scenario("regions are on their ways apart", |steps| {
        let mut server = Server::new(1, 1.0);
        steps.catalog(0.0, server.catalog());
        steps.light(0.0, &server.light(1.0));
        steps.light(0.04, &server.light(3.0)[1..]);
        steps.shows(0.08, Some(1.0), Some(3.0));
    })
}

fn disorder() -> Value {
    scenario("frames come late, twice and not at all", |steps| {
        let mut server = Server::new(1, 1.0);
        steps.catalog(0.0, server.catalog());
        let light: Vec<_> = [1.0, 2.0, 3.0, 4.0, 5.0].map(|value| server.light(value)).into();
        let [first, second, third, fourth, fifth] = &light[..] else { unreachable!() };
        let missing = |steps: &mut Steps, frame| {
            steps.frame(0.0, FIELD, frame, refused("missing_base"));
        };
        // Nothing has come that they change.
        missing(steps, &second[0]);
        missing(steps, &fifth[0]);
        steps.light(0.0, &first[..1]);
        steps.frame(0.0, FIELD, &first[0], json!({ "news": false }));
        steps.light(0.08, &third[..1]);
        steps.frame(0.09, FIELD, &second[0], json!({ "news": false }));
        steps.light(0.12, &fourth[..1]);
        steps.light(0.16, &fifth[..1]);
        steps.frame(0.17, FIELD, &fourth[0], json!({ "news": false }));
        steps.shows(1.0, Some(5.0), None);
    })
}

fn strangers() -> Value {
    scenario("light of what is not known is refused", |steps| {
        let mut server = Server::new(1, 1.0);
        let light = server.light(1.0);
        steps.frame(0.0, FIELD, &light[0], refused("no_catalog"));
        let mut catalog = server.catalog();
        let hologram =
            json!({ "id": 8, "kind": "hologram", "use": "all", "shape": { "layers": 3 } });
        catalog["fields"].as_array_mut().expect("a list").push(hologram);
        steps.catalog(0.0, catalog);
        steps.frame(0.0, 8, &light[0], refused("unknown"));
        steps.frame(0.0, 9, &light[0], refused("unknown"));
        let elsewhere = EncodedRegion { region: 2, ..light[0].clone() };
        steps.frame(0.0, FIELD, &elsewhere, refused("unknown"));
        let wrong = EncodedRegion { layer: 1, ..light[0].clone() };
        steps.frame(0.0, FIELD, &wrong, refused("malformed"));
        let cut = EncodedRegion { bytes: light[0].bytes[..5].to_vec(), ..light[0].clone() };
        steps.frame(0.0, FIELD, &cut, refused("truncated"));
        steps.shows(0.0, None, None);
        steps.light(0.0, &light);
        steps.shows_all(0.0, 1.0);
    })
}

fn catalogs() -> Value {
    scenario("a catalog with the same shape keeps light and updates", |steps| {
        let mut server = Server::new(1, 1.0);
        steps.catalog(0.0, server.catalog());
        steps.light(0.0, &server.light(1.0));
        let mut other = server.catalog();
        let field = &mut other["fields"][0];
        field["scale_log2"] = 3.into();
        field["source"] = "another".into();
        field["use"] = "static".into();
        steps.catalog(0.01, other);
        steps.shows_all(0.01, 1.0);
        // A delta: it changes what came before the catalog.
        steps.light(0.04, &server.light(2.0));
        steps.shows_all(0.5, 2.0);
    })
}

fn reshaped() -> Value {
    scenario("a field of another shape shows the light of before until its own has come", |steps| {
        let mut server = Server::new(1, 1.0);
        steps.catalog(0.0, server.catalog());
        let light = server.light(2.0);
        steps.light(0.0, &light);
        let mut smaller = Server::new(1, 0.5);
        steps.catalog(0.1, smaller.catalog());
        steps.shows_all(0.1, 2.0);
        smaller.tick = 4;
        steps.light(0.2, &smaller.light(3.0));
        steps.shows_all(1.0, 3.0);
    })
}

fn restarted() -> Value {
    scenario("after a restart light stays, and updates are numbered anew", |steps| {
        let mut server = Server::new(1, 1.0);
        steps.catalog(0.0, server.catalog());
        steps.snapshot(0.0, 0, 0.0, 100.0);
        for value in [1.0, 1.0, 2.0] {
            steps.light(0.0, &server.light(value));
        }
        let mut again = Server::new(2, 1.0);
        steps.catalog(3.0, again.catalog());
        steps.shows_all(3.0, 2.0);
        steps.light(4.0, &again.light(5.0));
        steps.shows_all(4.0, 2.0);
        steps.shows_all(4.25, 3.5);
        steps.shows_all(4.5, 5.0);
    })
}

fn foreign() -> Value {
    scenario("a field of another server has a run of its own", |steps| {
        let mut server = Server::new(1, 1.0);
        server.catalog.fields[0].epoch = Some(Epoch(5));
        steps.catalog(0.0, server.catalog());
        for value in [1.0, 1.0, 2.0] {
            steps.light(0.0, &server.light(value));
        }
        // The catalog's own server restarts: the field's goes on.
        server.catalog.epoch = Epoch(2);
        steps.catalog(1.0, server.catalog());
        steps.light(1.0, &server.light(3.0));
        steps.shows_all(2.0, 3.0);
        // The field's server restarts.
        let mut again = Server::new(2, 1.0);
        again.catalog.fields[0].epoch = Some(Epoch(6));
        steps.catalog(3.0, again.catalog());
        steps.shows_all(3.0, 3.0);
        steps.light(3.0, &again.light(4.0));
        steps.shows_all(4.0, 4.0);
    })
}

fn forgotten() -> Value {
    scenario("a field that is listed no longer is forgotten", |steps| {
        let mut server = Server::new(1, 1.0);
        steps.catalog(0.0, server.catalog());
        steps.light(0.0, &server.light(1.0));
        let listed = server.catalog();
        let mut without = server.catalog();
        without["fields"] = json!([]);
        steps.catalog(1.0, without);
        steps.shows(1.0, None, None);
        let light = server.light(2.0);
        steps.frame(1.0, FIELD, &light[0], refused("unknown"));
        steps.catalog(2.0, listed);
        steps.frame(2.0, FIELD, &light[0], refused("missing_base"));
    })
}

fn saved() -> Value {
    scenario("saved light shows until a server's comes", |steps| {
        let mut server = Server::new(1, 1.0);
        server.shine(4.0);
        let scene = server.catalog.scene.clone();
        let field = server.volume.clone().into();
        let info = UpdateInfo { time: 2.5, ..UpdateInfo::default() };
        let file = LightFile::of_fields(scene, "baked", [&field], info);
        steps.push(0.0, json!({ "load": hex(&file.write()) }));
        steps.push(0.0, json!({ "shows": { "fields": [], "age": null } }));
        steps.shows_all(0.0, 4.0);
        steps.catalog(1.0, server.catalog());
        steps.shows_all(1.0, 4.0);
        steps.light(2.0, &server.light(1.0));
        steps.shows_all(3.0, 1.0);
        // It takes as long as a tick of the server's, not of the file's.
        steps.light(3.0, &server.light(1.0));
        steps.light(3.04, &server.light(2.0));
        steps.shows_all(3.08, 2.0);
    })
}

fn times() -> Value {
    scenario("age and scene time follow the server's clock", |steps| {
        let mut server = Server::new(1, 1.0);
        steps.catalog(0.0, server.catalog());
        let at = |steps: &mut Steps, at: f64, age: Option<f64>, scene: Option<f64>| {
            steps.push(at, json!({ "shows": { "fields": [], "age": age, "scene_time": scene } }));
        };
        at(steps, 0.0, None, None);
        steps.snapshot(0.0, 0, 8.0, 100.0);
        at(steps, 0.02, None, Some(8.02));
        steps.light(0.03, &server.light(1.0));
        at(steps, 0.05, Some(0.05), Some(8.05));
        // A silent server's scene stands still after a second.
        at(steps, 3.0, Some(3.0), Some(9.0));
    })
}

fn main() {
    let scenarios = [
        blending(),
        regions(),
        disorder(),
        strangers(),
        catalogs(),
        reshaped(),
        restarted(),
        foreign(),
        forgotten(),
        saved(),
        times(),
    ];
    println!("{{\n\"scenarios\": [");
    for (i, scenario) in scenarios.iter().enumerate() {
        println!("{scenario}{}", if i + 1 < scenarios.len() { "," } else { "" });
    }
    println!("]\n}}");
}
