//! Edits at set times, for demonstrations, tests and measurements.

use serde::Deserialize;

use crate::Edit;

/// Edits with the scene time at which each is due.
///
/// As text a script is a JSON array, or lines of one JSON object each: `{"at": 1.5, "edit":
/// {"edit": "move_node", "node": 3, "translation": [0, 1, 0]}}`. Empty lines and lines that begin
/// with `#` are ignored. One object may be `{"repeat": 10}`, which repeats the script every ten
/// seconds.
///
/// ```
/// let script = lumencast_scene::Script::parse(
///     r#"{"at": 0.5, "edit": {"edit": "remove_node", "node": 3}}
///        {"repeat": 2}"#,
/// )?;
/// assert_eq!(script.due(0.0, 0.5).count(), 0);
/// assert_eq!(script.due(0.5, 0.6).count(), 1);
/// assert_eq!(script.due(2.4, 2.6).count(), 1);
/// # Ok::<(), lumencast_scene::ScriptError>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Script {
    /// Times and edits, in ascending order of time.
    entries: Vec<(f64, Edit)>,
    repeat: Option<f64>,
}

/// A script that cannot be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ScriptError {
    /// The text is not JSON, or lacks the structure of a script.
    #[error("{place}: {error}")]
    Json {
        /// Line or entry, from 1.
        place: String,
        /// What is wrong.
        error: serde_json::Error,
    },
    /// A time is negative, not finite, or past the repetition.
    #[error("{place}: times are finite, not negative, and before the repetition")]
    Time {
        /// Line or entry, from 1.
        place: String,
    },
}

enum Entry {
    At(At),
    Repeat(f64),
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct At {
    at: f64,
    edit: Edit,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Repeat {
    repeat: f64,
}

impl Script {
    /// Reads a script.
    ///
    /// # Errors
    /// Text of another structure, and times out of range; the message says where.
    pub fn parse(text: &str) -> Result<Self, ScriptError> {
        let mut script = Self::default();
        if text.trim_start().starts_with('[') {
            let json = |error| ScriptError::Json { place: "script".into(), error };
            let values: Vec<serde_json::Value> = serde_json::from_str(text).map_err(json)?;
            for (index, value) in values.into_iter().enumerate() {
                script.add(value, format!("entry {}", index + 1))?;
            }
        } else {
            let lines = text.lines().map(str::trim).enumerate();
            for (index, line) in lines.filter(|(_, l)| !l.is_empty() && !l.starts_with('#')) {
                let place = format!("line {}", index + 1);
                let value = serde_json::from_str(line)
                    .map_err(|error| ScriptError::Json { place: place.clone(), error })?;
                script.add(value, place)?;
            }
        }
        script.entries.sort_by(|a, b| a.0.total_cmp(&b.0));
        let last = script.entries.last().map_or(0.0, |(at, _)| *at);
        if script.repeat.is_some_and(|repeat| last >= repeat) {
            return Err(ScriptError::Time { place: "repeat".into() });
        }
        Ok(script)
    }

    fn add(&mut self, value: serde_json::Value, place: String) -> Result<(), ScriptError> {
        // The variants are told apart by hand: serde's message for an untagged enum says nothing.
        let entry = match value.get("repeat") {
            Some(_) => serde_json::from_value(value).map(|Repeat { repeat }| Entry::Repeat(repeat)),
            None => serde_json::from_value(value).map(Entry::At),
        };
        match entry.map_err(|error| ScriptError::Json { place: place.clone(), error })? {
            Entry::At(At { at, edit }) if at.is_finite() && at >= 0.0 => {
                self.entries.push((at, edit));
            }
            Entry::Repeat(repeat) if repeat.is_finite() && repeat > 0.0 => {
                self.repeat = Some(repeat);
            }
            _ => return Err(ScriptError::Time { place }),
        }
        Ok(())
    }

    /// The edits due from scene time `from` to before `to`, in order. A script that repeats gives
    /// each edit at most once.
    pub fn due(&self, from: f64, to: f64) -> impl Iterator<Item = &Edit> {
        let (from, to) = match self.repeat {
            None => (from, to),
            Some(repeat) => {
                let start = (from / repeat).floor() * repeat;
                (from - start, (to - start).min(from - start + repeat))
            }
        };
        let wrapped = self.repeat.map_or(f64::NEG_INFINITY, |repeat| to - repeat);
        let this_round = self.entries.iter().filter(move |(at, _)| *at >= from && *at < to);
        let next_round = self.entries.iter().filter(move |(at, _)| *at < wrapped);
        this_round.chain(next_round).map(|(_, edit)| edit)
    }
}
