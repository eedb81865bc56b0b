//! Reports for people: numbers as people write them, with units, and without the punctuation of JSON.

use serde_json::{Map, Number, Value};

use crate::output;

/// The most digits of a number that count: an f32 has a little over seven.
const DIGITS: i32 = 6;

/// What a number measures.
#[derive(Clone, Copy)]
enum Unit {
    /// A plain number, or one whose name says what it is.
    Plain,
    /// The number of a thing, not an amount.
    Name,
    Bytes,
    /// Given in radians.
    Angle,
    Of(&'static str),
}

/// What is said of a scene that asks for no volumes.
const DEFAULT_VOLUME: &str = "none of its own; a default one is placed where the space is";

/// A list shows so many entries at most.
const SHOWN: usize = 40;

/// A report's lines: one for each plain value, a block for each list.
pub(crate) fn lines(report: &Value) -> Vec<String> {
    let Some(report) = report.as_object() else { return Vec::new() };
    let is_default =
        |key: &str| key == "volumes" && report.get("default_volume") == Some(&Value::Bool(true));
    let mut lines = Vec::new();
    for (key, value) in report {
        match value {
            Value::Null => {}
            // The volumes' own line says it.
            _ if key == "default_volume" => {}
            Value::Array(fields) if key == "unknown_fields" && fields.is_empty() => {}
            Value::Array(_) if is_default(key) => {
                lines.push(format!("{}: {DEFAULT_VOLUME}", label(key)));
            }
            Value::Array(entries) => {
                lines.push(format!("{} ({})", label(key), entries.len()));
                let shown = entries.iter().take(SHOWN);
                lines.extend(shown.map(|entry| format!("  {}", entry_in_words(key, entry))));
                if entries.len() > SHOWN {
                    let more = entries.len() - SHOWN;
                    lines.push(format!("  … and {more} more (--json lists all)"));
                }
            }
            _ => lines.push(format!("{}: {}", label(key), in_words(key, report))),
        }
    }
    lines
}

/// A value in words; `key` is its name in `map`.
fn in_words(key: &str, map: &Map<String, Value>) -> String {
    map.get(key).map(|value| words(value, unit(key, map, Unit::Plain))).unwrap_or_default()
}

/// An entry of a list that is called `key`.
fn entry_in_words(key: &str, value: &Value) -> String {
    let words = words(value, unit(key, &Map::new(), Unit::Plain));
    if words.is_empty() { "nothing is known of it".into() } else { words }
}

/// The name of a value, for people.
fn label(key: &str) -> String {
    match key {
        "tick_seconds" => "period".into(),
        "tick_ms" => "tick took".into(),
        "unknown_fields" => "fields of unknown kinds".into(),
        key => key.replace('_', " "),
    }
}

/// The unit of a value, or that of what it is a part of.
fn unit(key: &str, map: &Map<String, Value>, whole: Unit) -> Unit {
    match key {
        "bytes" => Unit::Bytes,
        "tick_seconds" | "time" | "seconds" => Unit::Of("s"),
        "tick_ms" => Unit::Of("ms"),
        "c0" | "zenith" | "horizon" | "ground" | "radiance" => Unit::Of("cd/m²"),
        "bounds" | "center" | "size" | "texel" | "largest_texel" | "position" | "radius"
        | "range" | "metres" => Unit::Of("m"),
        "illuminance" => Unit::Of("lx"),
        "angle" | "inner" | "outer" => Unit::Angle,
        "intensity" if map.get("type").is_some_and(|kind| kind == "directional") => Unit::Of("lx"),
        "intensity" => Unit::Of("cd"),
        "node" | "parent" | "mesh" | "animation" | "id" | "tick" | "version" => Unit::Name,
        _ => whole,
    }
}

fn words(value: &Value, of: Unit) -> String {
    match value {
        Value::String(text) => text.clone(),
        Value::Object(map) => {
            let known = map.iter().filter(|(_, value)| !value.is_null() && *value != "");
            let pair = |(key, value): (&String, &Value)| {
                format!("{} {}", label(key), words(value, unit(key, map, of)))
            };
            known.map(pair).collect::<Vec<_>>().join(", ")
        }
        Value::Array(list) => {
            let (each, after) = match of {
                Unit::Of(name) if !list.is_empty() => (Unit::Plain, format!(" {name}")),
                of => (of, String::new()),
            };
            let words: Vec<_> = list.iter().map(|value| words(value, each)).collect();
            format!("[{}]{after}", words.join(" "))
        }
        Value::Number(number) => measure(number, of),
        other => other.to_string(),
    }
}

fn measure(number: &Number, of: Unit) -> String {
    let value = number.as_f64().unwrap_or(f64::NAN);
    match (of, number.as_u64()) {
        (Unit::Name, _) => number.to_string(),
        (Unit::Bytes, Some(bytes)) => output::bytes(bytes),
        (Unit::Angle, _) => format!("{}°", in_digits(value.to_degrees())),
        (Unit::Of(name), _) => format!("{} {name}", in_digits(value)),
        (Unit::Plain | Unit::Bytes, _) if number.is_f64() => in_digits(value),
        (Unit::Plain | Unit::Bytes, _) => thousands(&number.to_string()),
    }
}

/// A number in words, with only the digits that count.
fn in_digits(value: f64) -> String {
    let exponent = value.abs().log10().floor();
    if value == 0.0 || !value.is_finite() {
        return if value == 0.0 { "0".into() } else { value.to_string() };
    }
    if !(-4.0..15.0).contains(&exponent) {
        return format!("{value:.*e}", DIGITS as usize - 1)
            .split_once('e')
            .map(|(digits, power)| format!("{}e{power}", without_zeros(digits)))
            .unwrap_or_default();
    }
    let decimals = (DIGITS - 1 - exponent as i32).max(0) as usize;
    thousands(without_zeros(&format!("{value:.decimals$}")))
}

/// Digits without the zeros that say nothing at a fraction's end.
fn without_zeros(digits: &str) -> &str {
    match digits.contains('.') {
        true => digits.trim_end_matches('0').trim_end_matches('.'),
        false => digits,
    }
}

/// Digits with the thousands set apart.
fn thousands(digits: &str) -> String {
    let (sign, digits) = digits.split_at(usize::from(digits.starts_with('-')));
    let (whole, fraction) = digits.split_at(digits.find('.').unwrap_or(digits.len()));
    let mut apart = String::from(sign);
    for (i, digit) in whole.chars().enumerate() {
        if i > 0 && (whole.len() - i).is_multiple_of(3) {
            apart.push(',');
        }
        apart.push(digit);
    }
    apart + fraction
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn numbers_are_written_as_people_write_them() {
        for (number, written) in [
            (1.500_000_02, "1.5"),
            (f64::from(0.1_f32), "0.1"),
            (-1_234.567_8, "-1,234.57"),
            (262_144.0, "262,144"),
            (999_999.96, "1,000,000"),
            (99.999_999_9, "100"),
            (0.000_25, "0.00025"),
            (0.0, "0"),
            (1.5e-7, "1.5e-7"),
            (3.0e20, "3e20"),
            (f64::INFINITY, "inf"),
        ] {
            assert_eq!(in_digits(number), written);
        }
        assert_eq!(thousands("1234567"), "1,234,567");
        assert_eq!(thousands("-123"), "-123");
    }

    #[test]
    fn volumes_are_listed_or_the_default_one_is_told() {
        let volume = json!({ "order": 2 });
        let own = lines(&json!({ "volumes": [volume], "default_volume": false }));
        assert_eq!(own, ["volumes (1)", "  order 2"]);
        let none = lines(&json!({ "volumes": [], "default_volume": true }));
        assert_eq!(none, [format!("volumes: {DEFAULT_VOLUME}")]);
    }

    #[test]
    fn fields_of_unknown_kinds_are_told_where_there_are_some() {
        assert_eq!(lines(&json!({ "unknown_fields": [] })), Vec::<String>::new());
        let some = json!([{ "id": 5, "kind": "spheres" }, { "id": null, "kind": "" }]);
        let told =
            ["fields of unknown kinds (2)", "  id 5, kind spheres", "  nothing is known of it"];
        assert_eq!(lines(&json!({ "unknown_fields": some })), told);
    }

    #[test]
    fn lists_are_cut_and_nothing_is_left_out_silently() {
        let all = lines(&json!({ "names": vec!["a"; SHOWN + 2], "none": null, "lights": [] }));
        assert!(all.contains(&"  … and 2 more (--json lists all)".to_owned()), "{all:?}");
        assert!(all.contains(&"lights (0)".to_owned()), "{all:?}");
        assert_eq!(all.len(), 1 + SHOWN + 1 + 1, "{all:?}");
    }

    #[test]
    fn values_have_units() {
        let light = json!({ "node": 1234, "name": "lamp", "light": {
            "type": "spot", "intensity": 1500.5, "outer": std::f32::consts::FRAC_PI_4, "range": null, "note": "",
        }});
        let said = entry_in_words("lights", &light);
        for part in ["node 1234", "name lamp", "intensity 1,500.5 cd", "outer 45°", "type spot"] {
            assert!(said.split(", ").any(|words| words.ends_with(part)), "{said}");
        }
        assert!(!said.contains("range") && !said.contains("note"), "{said}");
        let report = json!({
            "bounds": { "max": [1.0, 2000.0, f64::from(0.3_f32)] }, "bytes": 12_345, "tick": 12_345,
            "state": { "tick_ms": 31.25, "time": 8.04 }, "triangles": 262_144,
        });
        let map = report.as_object().expect("an object");
        for (key, said) in [
            ("bounds", "max [1 2,000 0.3] m"),
            ("bytes", "12.3 KB"),
            ("tick", "12345"),
            ("state", "tick took 31.25 ms, time 8.04 s"),
            ("triangles", "262,144"),
        ] {
            assert_eq!(in_words(key, map), said);
        }
    }
}
