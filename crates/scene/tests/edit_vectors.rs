//! `vectors/edits.json`: the JSON form of edits, which the TypeScript client reads too.

use lumencast_scene::Edit;
use serde::Deserialize;
use serde_json::Value;

#[derive(Deserialize)]
struct Vectors {
    edits: Vec<Case>,
    refused: Vec<Case>,
}

#[derive(Deserialize)]
struct Case {
    name: String,
    json: Value,
    /// What Rust writes, where that is more than `json`: with the defaults of what was left out.
    full: Option<Value>,
}

fn vectors() -> Vectors {
    let text = include_str!("../../../vectors/edits.json");
    serde_json::from_str(text).expect("vectors/edits.json")
}

/// Whole numbers and the same numbers as floats are alike.
fn alike(a: &Value, b: &Value) -> bool {
    match (a, b) {
        (Value::Number(a), Value::Number(b)) => a.as_f64() == b.as_f64(),
        (Value::Array(a), Value::Array(b)) => {
            a.len() == b.len() && a.iter().zip(b).all(|(a, b)| alike(a, b))
        }
        (Value::Object(a), Value::Object(b)) => {
            a.len() == b.len() && a.iter().all(|(k, a)| b.get(k).is_some_and(|b| alike(a, b)))
        }
        _ => a == b,
    }
}

#[test]
fn edits_are_read_and_written_as_recorded() {
    for case in vectors().edits {
        let edit: Edit = serde_json::from_value(case.json.clone()).expect(&case.name);
        let written = serde_json::to_value(&edit).expect(&case.name);
        let expected = case.full.unwrap_or(case.json);
        assert!(alike(&written, &expected), "{}: {written} instead of {expected}", case.name);
        assert_eq!(serde_json::from_value::<Edit>(written).expect(&case.name), edit);
    }
}

#[test]
fn what_is_no_edit_is_refused() {
    for case in vectors().refused {
        let edit: Result<Edit, _> = serde_json::from_value(case.json);
        assert!(edit.is_err(), "{}: {edit:?}", case.name);
    }
}
