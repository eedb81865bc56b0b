//! `vectors/cache.json`, which the TypeScript client runs through its cache too.

use lumencast_cache::{Cache, CacheError};
use lumencast_codec::LightTrack;
use lumencast_light::Field;
use serde::Deserialize;
use serde_json::Value;

#[derive(Deserialize)]
struct Vectors {
    scenarios: Vec<Scenario>,
}

#[derive(Deserialize)]
struct Scenario {
    name: String,
    client: String,
    steps: Vec<Step>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Step {
    at: f64,
    catalog: Option<Value>,
    state: Option<Value>,
    load: Option<String>,
    light: Option<Light>,
    news: Option<bool>,
    refused: Option<String>,
    shows: Option<Value>,
}

#[derive(Deserialize)]
struct Light {
    field: u32,
    region: u32,
    layer: u8,
    frame: String,
}

fn bytes(hex: &str) -> Vec<u8> {
    (0..hex.len()).step_by(2).map(|i| u8::from_str_radix(&hex[i..i + 2], 16).unwrap()).collect()
}

/// Why light was refused, in the words of the vectors.
fn word(error: &CacheError) -> &'static str {
    match error {
        CacheError::Decode(error) => error.kind(),
        CacheError::NoCatalog => "no_catalog",
        CacheError::UnknownField(_) | CacheError::UnknownRegion { .. } => "unknown",
        CacheError::WrongLayer { .. } => "malformed",
        _ => "another reason",
    }
}

/// Red of coefficient 0 of the first and the last probe; 0 where nothing is shown.
fn ends(cache: &mut Cache, field: u32, now: f64) -> [f32; 2] {
    let light = cache.light(now);
    match light.fields().iter().find(|shown| shown.id().0 == field) {
        Some(Field::Volume(volume)) => {
            [0, volume.grid.probe_count() - 1].map(|probe| volume.probe(probe)[0].x)
        }
        Some(Field::Lightmap(_)) | None => [0.0; 2],
    }
}

fn check(cache: &mut Cache, shows: &Value, now: f64, at: &str) {
    for field in shows["fields"].as_array().expect("a list") {
        let id = field["field"].as_u64().unwrap() as u32;
        let ends = ends(cache, id, now);
        for (end, found) in ["first", "last"].into_iter().zip(ends) {
            let expected = field[end].as_f64().unwrap_or(0.0) as f32;
            let near = (found - expected).abs() <= 0.01 * expected + 1e-6;
            assert!(near, "{at}: {end} is {found}, not {expected}");
        }
    }
    let same = |found: Option<f64>, what: &str| {
        let Some(expected) = shows.get(what) else { return };
        let near = match (found, expected.as_f64()) {
            (Some(found), Some(expected)) => (found - expected).abs() <= 1e-6,
            (found, expected) => found == expected,
        };
        assert!(near, "{at}: {what} is {found:?}, not {expected}");
    };
    same(cache.light(now).age, "age");
    same(cache.scene_time(now), "scene_time");
}

#[test]
fn scenarios_end_as_recorded() {
    let text = include_str!("../../../vectors/cache.json");
    let vectors: Vectors = serde_json::from_str(text).expect("vectors/cache.json");
    assert!(vectors.scenarios.len() > 10);
    for Scenario { name, client, steps } in vectors.scenarios {
        let mut cache = Cache::of_client(client);
        for (number, step) in steps.into_iter().enumerate() {
            let at = format!("{name}, step {number}");
            let now = step.at;
            if let Some(catalog) = step.catalog {
                cache.add_catalog(catalog.to_string().as_bytes(), now).expect(&at);
            }
            if let Some(state) = step.state {
                cache.add_state(state.to_string().as_bytes(), now).expect(&at);
            }
            if let Some(file) = step.load {
                cache.load(&bytes(&file), now).expect(&at);
            }
            if let Some(Light { field, region, layer, frame }) = step.light {
                let track = LightTrack { field, region, layer };
                let added = cache.add_light(track, &bytes(&frame), now);
                let refused = added.as_ref().err().map(word);
                assert_eq!(refused, step.refused.as_deref(), "{at}");
                assert_eq!(added.ok().map(|added| added.news), step.news, "{at}");
            }
            if let Some(shows) = step.shows {
                check(&mut cache, &shows, now, &at);
            }
        }
    }
}
