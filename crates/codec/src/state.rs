//! Frames of the `state` track and the edits that clients send (docs/wire.md, "State").

use std::collections::BTreeMap;

use lumencast_scene::Edit;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use crate::error::json as checked;
use crate::{DecodeError, limits};

/// What happened in a tick, and, now and then, what all ticks so far come to.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StateFrame {
    /// Number of the tick.
    pub tick: u64,
    /// Scene time at which animations stand, seconds.
    pub time: f64,
    /// The server's monotonic clock at sending, seconds; only differences mean anything.
    pub clock: f64,
    /// Scene version after this tick's edits and animation.
    pub version: u64,
    /// How long the last tick took, milliseconds.
    pub tick_ms: f64,
    /// Samples a probe in the last tick.
    pub samples: f64,
    /// What the edits since the scene was loaded come to, this tick's included.
    pub snapshot: Option<SceneState>,
    /// What was accepted this tick, in the server's order.
    pub edits: Vec<AcceptedEdit>,
    /// What was refused this tick.
    pub refused: Vec<RefusedEdit>,
}

/// All that has happened to a scene since it was loaded from its file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SceneState {
    /// Edits that turn the scene as it stands in its file into the scene as it is now.
    pub edits: Vec<Edit>,
    /// The last sequence number dealt with, for each client seen in the last minute.
    pub acks: BTreeMap<String, u64>,
}

/// An edit that became part of the scene.
#[derive(Clone, Debug, PartialEq)]
pub struct AcceptedEdit {
    /// Client and sequence number; `None` for the server's own.
    pub source: Option<(String, u64)>,
    /// The edit, its node numbers filled in.
    pub edit: Edit,
}

/// An edit that was refused and changed nothing.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct RefusedEdit {
    /// Who sent it.
    pub client: String,
    /// Its sequence number.
    pub seq: u64,
    /// Why.
    pub reason: String,
}

/// A frame as it is written.
#[derive(Serialize)]
struct Written<'a> {
    #[serde(skip_serializing_if = "Option::is_none")]
    snapshot: Option<&'a [Edit]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    acks: Option<&'a BTreeMap<String, u64>>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    edits: Vec<Entry<'a>>,
    #[serde(skip_serializing_if = "<[_]>::is_empty")]
    refused: &'a [RefusedEdit],
    tick: u64,
    time: f64,
    clock: f64,
    version: u64,
    tick_ms: f64,
    samples: f64,
}

#[derive(Serialize)]
struct Entry<'a> {
    #[serde(skip_serializing_if = "Option::is_none")]
    client: Option<&'a str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    seq: Option<u64>,
    edit: &'a Edit,
}

impl<'a> Entry<'a> {
    fn of(accepted: &'a AcceptedEdit) -> Self {
        let source = accepted.source.as_ref();
        let (client, seq) = source.map(|(client, seq)| (client.as_str(), *seq)).unzip();
        Self { client, seq, edit: &accepted.edit }
    }
}

/// A frame as it is read: what may be passed over is not yet looked into.
#[derive(Deserialize)]
struct Read {
    #[serde(default)]
    snapshot: Option<Vec<Value>>,
    #[serde(default)]
    acks: Value,
    #[serde(default)]
    edits: Vec<Value>,
    #[serde(default)]
    refused: Vec<Value>,
    tick: Value,
    time: f64,
    clock: f64,
    version: Value,
    #[serde(default)]
    tick_ms: Value,
    #[serde(default)]
    samples: Value,
}

impl StateFrame {
    /// The frame as JSON.
    pub fn encode(&self) -> Vec<u8> {
        let acks = self.snapshot.as_ref().map(|state| &state.acks);
        let frame = Written {
            snapshot: self.snapshot.as_ref().map(|state| &state.edits[..]),
            acks: acks.filter(|acks| !acks.is_empty()),
            edits: self.edits.iter().map(Entry::of).collect(),
            refused: &self.refused,
            tick: self.tick,
            time: self.time,
            clock: self.clock,
            version: self.version,
            tick_ms: self.tick_ms,
            samples: self.samples,
        };
        serde_json::to_vec(&frame).expect("numbers, text and lists have a JSON form")
    }

    /// Reads a frame of the `state` track. Edits that this program does not know are left out, and so are
    /// acknowledgements, refusals and senders that are none; the rest is kept.
    ///
    /// # Errors
    /// [`DecodeError`] when the bytes are no state frame or exceed a limit, or when there is no number of
    /// the tick, time, clock or version that can be used.
    pub fn decode(bytes: &[u8]) -> Result<Self, DecodeError> {
        DecodeError::limit("bytes of a frame", bytes.len(), limits::FRAME_BYTES)?;
        let frame: Read = checked(serde_json::from_slice(bytes))?;
        DecodeError::limit("edits in a frame", frame.edits.len(), limits::DELTA_EDITS)?;
        DecodeError::limit("refusals in a frame", frame.refused.len(), limits::DELTA_EDITS)?;
        let measure = |value: &Value| value.as_f64().filter(|v| *v >= 0.0).unwrap_or(0.0);
        let snapshot = match frame.snapshot {
            Some(edits) => Some(SceneState { edits: known_edits(edits)?, acks: acks(&frame.acks) }),
            None => None,
        };
        Ok(Self {
            tick: whole(&frame.tick).ok_or(DecodeError::Malformed("tick"))?,
            time: frame.time,
            clock: frame.clock,
            version: whole(&frame.version).ok_or(DecodeError::Malformed("version"))?,
            tick_ms: measure(&frame.tick_ms),
            samples: measure(&frame.samples),
            snapshot,
            edits: frame.edits.into_iter().filter_map(accepted).collect(),
            refused: frame.refused.iter().filter_map(refused).collect(),
        })
    }
}

/// A number that counts or names something.
fn whole(value: &Value) -> Option<u64> {
    let with_point = || value.as_f64().filter(|v| *v >= 0.0 && v.fract() == 0.0).map(|v| v as u64);
    value.as_u64().or_else(with_point).filter(|number| *number <= limits::LARGEST_NUMBER)
}

fn acks(acks: &Value) -> BTreeMap<String, u64> {
    let entries = acks.as_object().into_iter().flatten();
    entries.filter_map(|(client, seq)| Some((client.clone(), whole(seq)?))).collect()
}

fn accepted(mut entry: Value) -> Option<AcceptedEdit> {
    let edit = known(entry.get_mut("edit")?.take())?;
    let (client, seq) = (entry.get("client").and_then(Value::as_str), entry.get("seq"));
    let source = client.map(str::to_owned).zip(seq.and_then(whole));
    Some(AcceptedEdit { source, edit })
}

fn refused(entry: &Value) -> Option<RefusedEdit> {
    let text = |name: &str| entry.get(name)?.as_str().map(str::to_owned);
    Some(RefusedEdit {
        client: text("client")?,
        seq: whole(entry.get("seq")?)?,
        reason: text("reason")?,
    })
}

/// Edits that turn a scene's file into a scene, as JSON.
pub(crate) fn write_edits(edits: &[Edit]) -> Vec<u8> {
    serde_json::to_vec(&json!({ "edits": edits })).expect("edits have a JSON form")
}

/// The same, read; edits that this program does not know are left out.
pub(crate) fn read_edits(bytes: &[u8]) -> Result<Vec<Edit>, DecodeError> {
    DecodeError::limit("bytes of edits", bytes.len(), limits::FRAME_BYTES)?;
    let mut value: Value = checked(serde_json::from_slice(bytes))?;
    match value.get_mut("edits").map(Value::take) {
        Some(Value::Array(edits)) => known_edits(edits),
        _ => Err(DecodeError::Malformed("edits")),
    }
}

fn known_edits(edits: Vec<Value>) -> Result<Vec<Edit>, DecodeError> {
    DecodeError::limit("edits in a snapshot", edits.len(), limits::SNAPSHOT_EDITS)?;
    Ok(edits.into_iter().filter_map(known).collect())
}

/// The edit, if this program knows it.
fn known(edit: Value) -> Option<Edit> {
    if holds_more_than_32_bits(&edit) {
        return None;
    }
    serde_json::from_value(edit).ok()
}

/// Whether a number of an edit is none that 32 bits can hold.
fn holds_more_than_32_bits(value: &Value) -> bool {
    match value {
        Value::Number(number) => !number.as_f64().is_some_and(|v| (v as f32).is_finite()),
        Value::Array(values) => values.iter().any(holds_more_than_32_bits),
        Value::Object(members) => members.values().any(holds_more_than_32_bits),
        Value::Null | Value::Bool(_) | Value::String(_) => false,
    }
}

/// An edit on its way from a client to the server.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ClientEdit {
    /// Grows by one from 1, for each client; at most [`limits::LARGEST_NUMBER`].
    pub seq: u64,
    /// The edit.
    pub edit: Edit,
    /// Whether the node that it adds goes once all clients have gone that have edited it.
    #[serde(default, skip_serializing_if = "is_false")]
    pub temporary: bool,
}

fn is_false(value: &bool) -> bool {
    !value
}

impl ClientEdit {
    /// The edit as a frame of the client's `edits` track.
    pub fn encode(&self) -> Vec<u8> {
        serde_json::to_vec(self).expect("an edit has a JSON form")
    }

    /// Reads a frame of a client's `edits` track. On an edit that this program does not know, or a
    /// wrong one, the sequence number is told with the error, so that it can be refused by number.
    ///
    /// # Errors
    /// The sequence number, if that much could be read, and why the frame was refused.
    pub fn decode(bytes: &[u8]) -> Result<Self, (Option<u64>, DecodeError)> {
        DecodeError::limit("bytes of an edit", bytes.len(), limits::EDIT_BYTES)
            .map_err(|error| (None, error))?;
        let value: Value = checked(serde_json::from_slice(bytes)).map_err(|error| (None, error))?;
        let seq = value.get("seq").and_then(Value::as_u64);
        if let Some(seq) = seq.filter(|seq| *seq > limits::LARGEST_NUMBER) {
            let (what, limit) = ("sequence number", limits::LARGEST_NUMBER);
            return Err((None, DecodeError::Limit { what, value: seq, limit }));
        }
        if holds_more_than_32_bits(&value) {
            return Err((seq, DecodeError::Malformed("a number beyond 32 bits")));
        }
        checked(serde_json::from_value(value)).map_err(|error| (seq, error))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use lumencast_scene::NodeId;

    fn remove(node: u32) -> Edit {
        Edit::RemoveNode { node: NodeId(node) }
    }

    fn frame() -> StateFrame {
        StateFrame {
            tick: 813,
            time: 32.52,
            clock: 40.55,
            version: 94,
            tick_ms: 31.0,
            samples: 16.0,
            snapshot: Some(SceneState {
                edits: vec![remove(2)],
                acks: [("c".to_owned(), 17)].into(),
            }),
            edits: vec![
                AcceptedEdit { source: Some(("c".into(), 17)), edit: remove(2) },
                AcceptedEdit { source: None, edit: remove(5) },
            ],
            refused: vec![RefusedEdit { client: "c".into(), seq: 18, reason: "no".into() }],
        }
    }

    #[test]
    fn frames_round_trip() {
        assert_eq!(StateFrame::decode(&frame().encode()), Ok(frame()));
        let delta = StateFrame { snapshot: None, edits: vec![], refused: vec![], ..frame() };
        assert_eq!(StateFrame::decode(&delta.encode()), Ok(delta.clone()));
        let text = String::from_utf8(delta.encode()).unwrap();
        assert!(!text.contains("edits") && !text.contains("refused") && !text.contains("acks"));
    }

    #[test]
    fn the_document_s_examples_are_read() {
        let text = br#"{ "edits": [ { "client": "CLIENT", "seq": 17, "edit": {"edit":"remove_node","node":2} } ],
            "refused": [ { "client": "CLIENT", "seq": 18, "reason": "node 999 does not exist" } ],
            "tick": 813, "time": 32.52, "clock": 40.55, "version": 94, "tick_ms": 31.0, "samples": 16 }"#;
        let frame = StateFrame::decode(text).unwrap();
        assert_eq!(
            frame.edits,
            [AcceptedEdit { source: Some(("CLIENT".into(), 17)), edit: remove(2) }]
        );
        assert_eq!((frame.tick, frame.samples, frame.snapshot), (813, 16.0, None));
    }

    #[test]
    fn unknown_edits_are_left_out_and_the_rest_kept() {
        let text = br#"{ "snapshot": [ {"edit":"turn_to_gold","node":1}, {"edit":"remove_node","node":2}, 7 ],
            "edits": [ { "edit": {"edit":"remove_node"} }, { "edit": {"edit":"remove_node","node":5} } ],
            "tick": 1, "time": 0, "clock": 0, "version": 0, "tick_ms": 0, "samples": 0 }"#;
        let frame = StateFrame::decode(text).unwrap();
        assert_eq!(frame.snapshot.unwrap().edits, [remove(2)]);
        assert_eq!(frame.edits, [AcceptedEdit { source: None, edit: remove(5) }]);
    }

    #[test]
    fn rubbish_is_refused() {
        for text in ["", "{}", "null", "[[[[", r#"{"tick":-1}"#, "\u{0}"] {
            assert_eq!(StateFrame::decode(text.as_bytes()).map_err(|e| e.kind()), Err("json"));
        }
        let deep = "[".repeat(100_000);
        assert!(StateFrame::decode(deep.as_bytes()).is_err());
        let many = StateFrame {
            edits: vec![AcceptedEdit { source: None, edit: remove(1) }; limits::DELTA_EDITS + 1],
            ..frame()
        };
        assert_eq!(StateFrame::decode(&many.encode()).map_err(|e| e.kind()), Err("limit"));
        let huge = vec![b' '; limits::FRAME_BYTES + 1];
        assert_eq!(StateFrame::decode(&huge).map_err(|e| e.kind()), Err("limit"));
    }

    #[test]
    fn client_edits_round_trip_and_tell_their_number_when_refused() {
        let edit = ClientEdit { seq: 17, edit: remove(3), temporary: true };
        assert_eq!(ClientEdit::decode(&edit.encode()), Ok(edit));
        let unknown = br#"{ "seq": 4, "edit": { "edit": "turn_to_gold" } }"#;
        assert_eq!(
            ClientEdit::decode(unknown).map_err(|(seq, e)| (seq, e.kind())),
            Err((Some(4), "json"))
        );
        assert_eq!(
            ClientEdit::decode(b"rubbish").map_err(|(seq, e)| (seq, e.kind())),
            Err((None, "json"))
        );
        // Numbers that web clients cannot read, and frames that are too long, are no edits.
        let last = ClientEdit { seq: limits::LARGEST_NUMBER, edit: remove(3), temporary: false };
        assert_eq!(ClientEdit::decode(&last.encode()), Ok(last.clone()));
        let beyond = ClientEdit { seq: limits::LARGEST_NUMBER + 1, ..last };
        let long = [beyond.encode(), vec![b' '; limits::EDIT_BYTES]].concat();
        for frame in [beyond.encode(), long] {
            assert_eq!(
                ClientEdit::decode(&frame).map_err(|(seq, e)| (seq, e.kind())),
                Err((None, "limit"))
            );
        }
    }
}
