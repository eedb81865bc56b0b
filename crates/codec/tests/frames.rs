//! `vectors/frames.json`, which the TypeScript client reads too: of frames with members that cannot be
//! used, what is kept.

use lumencast_codec::{Catalog, StateFrame};
use serde::Deserialize;
use serde_json::Value;

#[derive(Deserialize)]
struct Vectors {
    frames: Vec<Case>,
}

#[derive(Deserialize)]
struct Case {
    name: String,
    track: String,
    frame: Value,
    /// What the frame comes to, written as a frame; absent where it is refused.
    kept: Option<Value>,
}

/// The frame read and written again.
fn again(track: &str, frame: &Value) -> Option<Value> {
    let bytes = frame.to_string();
    let written = match track {
        "state" => StateFrame::decode(bytes.as_bytes()).ok()?.encode(),
        "catalog" => Catalog::decode(bytes.as_bytes()).ok()?.encode(),
        other => panic!("a track {other}"),
    };
    Some(serde_json::from_slice(&written).expect("JSON"))
}

#[test]
fn what_cannot_be_used_is_passed_over() {
    let text = include_str!("../../../vectors/frames.json");
    let vectors: Vectors = serde_json::from_str(text).expect("vectors/frames.json");
    assert!(vectors.frames.len() > 70);
    for Case { name, track, frame, kept } in vectors.frames {
        assert_eq!(again(&track, &frame), kept, "{name}");
        if let Some(kept) = kept {
            assert_eq!(again(&track, &kept), Some(kept), "{name}, of which all is kept");
        }
    }
}
