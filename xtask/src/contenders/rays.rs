//! Rays and building beside Embree's: the example `against_embree`, which runs both in turns, 15
//! rounds, and prints medians of ratios. Above 1 ours is faster.

use std::fmt::Write;
use std::path::Path;
use std::process::Command;

use anyhow::{Context, Result, ensure};
use serde_json::{Value, json};

use super::{Effort, Measured, Scenes, number};
use crate::run::command;

/// Trees and modes that the example tells apart: their keys here, and its words.
const LEVELS: [(&str, &str); 3] =
    [("one_level", "one level"), ("as_built", "one level as built"), ("two_levels", "two levels")];
const MODES: [&str; 2] = ["watertight", "fast"];

pub(super) fn measure(
    example: &Path,
    library: &Path,
    scenes: &Scenes,
    effort: &Effort,
) -> Result<Measured> {
    let subjects = [
        ("Sponza", scenes.sponza.as_path()),
        ("Breakfast room", &scenes.breakfast_room),
        ("tomb", Path::new("tomb")),
        ("cornell", Path::new("cornell")),
    ];
    let mut rows = Vec::new();
    for (name, scene) in subjects {
        for threads in effort.threads {
            println!("\n── rays and building beside Embree: {name}, threads: {threads}");
            let mut run = command(&example.to_string_lossy(), &[]);
            run.env("LUMENCAST_EMBREE", library).arg(scene);
            run.args([effort.rays.to_string(), threads.to_string()]);
            let said = said_by(run)?;
            print!("{said}");
            let mut row = row(&said).with_context(|| format!("unexpected: {said}"))?;
            row["scene"] = name.into();
            rows.push(row);
        }
    }
    let table = rays_table(&rows)? + &build_table(&rows)?;
    Ok(Measured { figures: rows.into(), table })
}

fn said_by(mut command: Command) -> Result<String> {
    let program = command.get_program().to_string_lossy().into_owned();
    let output = command.output().with_context(|| format!("cannot start {program}"))?;
    ensure!(
        output.status.success(),
        "{program}: {}",
        String::from_utf8_lossy(&output.stderr).trim()
    );
    Ok(String::from_utf8(output.stdout)?)
}

/// The ratios that one run tells, and its lines.
fn row(said: &str) -> Result<Value> {
    let line = |start: &str| {
        let found = said.lines().find(|line| line.starts_with(start));
        found.with_context(|| format!("no line begins with {start:?}"))
    };
    let head = said.lines().next().context("nothing was said")?;
    let (build, top) = (line("build: ")?, line("top level over ")?);
    let mut row = json!({
        "triangles": before(head, " triangles")?,
        "rays": before(head, " rays")?,
        "threads": before(head, " threads")?,
        "build": {
            "one_level": after(build, "build: ")?,
            "two_levels": after(build, "in two levels ")?,
            "improved": after(build, "improved ")?,
            "top_level": after(top, "instances: ")?,
        },
        // The first has the path of the scene.
        "lines": said.lines().skip(1).collect::<Vec<_>>(),
    });
    for (key, levels) in LEVELS {
        for mode in MODES {
            let line = line(&format!("{mode}, {levels}: "))?;
            row[key][mode] =
                json!({ "closest": after(line, "closest ")?, "any": after(line, " any ")? });
        }
    }
    Ok(row)
}

/// The number that follows some words.
fn after(line: &str, words: &str) -> Result<f64> {
    let rest = line.split_once(words).with_context(|| format!("no {words:?} in {line:?}"))?.1;
    let end = rest.find(|c: char| c != '.' && !c.is_ascii_digit()).unwrap_or(rest.len());
    rest[..end].parse().with_context(|| format!("no number after {words:?} in {line:?}"))
}

/// The whole number that comes before a word.
fn before(line: &str, word: &str) -> Result<u64> {
    let rest = line.rsplit_once(word).with_context(|| format!("no {word:?} in {line:?}"))?.0;
    let digits = rest.rsplit(|c: char| !c.is_ascii_digit()).next().unwrap_or_default();
    digits.parse().with_context(|| format!("no number before {word:?} in {line:?}"))
}

fn rays_table(rows: &[Value]) -> Result<String> {
    let mut table = "\nRays beside Embree's, above 1 ours is faster:\n\n\
        | scene | triangles | threads | levels | closest, watertight | any, watertight | closest, \
        Embree's fast mode | any, fast mode |\n\
        | --- | --- | --- | --- | --- | --- | --- | --- |\n"
        .to_owned();
    for row in rows {
        for (key, levels) in LEVELS {
            let named = [&row["scene"], &row["triangles"], &row["threads"]];
            let [scene, triangles, threads] =
                named.map(|value| value.as_str().map_or(value.to_string(), str::to_owned));
            write!(table, "| {scene} | {triangles} | {threads} | {levels} |")?;
            for mode in MODES {
                for kind in ["closest", "any"] {
                    let ratio = number(row, &format!("/{key}/{mode}/{kind}"))?;
                    write!(table, " {ratio:.2} |")?;
                }
            }
            table.push('\n');
        }
    }
    Ok(table)
}

fn build_table(rows: &[Value]) -> Result<String> {
    let mut table = "\nBuilding beside Embree, above 1 ours is faster:\n\n\
        | scene | threads | one level | two levels | one level, and improved | top level over 1,000 \
        instances |\n\
        | --- | --- | --- | --- | --- | --- |\n"
        .to_owned();
    for row in rows {
        let scene = row["scene"].as_str().unwrap_or_default();
        write!(table, "| {scene} | {} |", row["threads"])?;
        for what in ["one_level", "two_levels", "improved", "top_level"] {
            write!(table, " {:.2} |", number(row, &format!("/build/{what}"))?)?;
        }
        table.push('\n');
    }
    Ok(table)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// As the example prints.
    const SAID: &str = "\
/2 scenes/Sponza.glb: 261839 triangles, 20000 rays, 2 threads
build: 1.32 of Embree's speed, in two levels 1.34; improved 0.43
top level over 1000 instances: 2.07 of Embree's speed (best 0.11 and 0.23 ms)
watertight, one level: closest 1.90 of Embree's speed (best 9.31 and 4.90 M/s), any 2.12 (best 1.00 and 2.00 M/s)
watertight, one level as built: closest 1.70 of Embree's speed (best 9.31 and 4.90 M/s), any 1.80 (best 1.00 and 2.00 M/s)
watertight, two levels: closest 1.91 of Embree's speed (best 9.31 and 4.90 M/s), any 2.13 (best 1.00 and 2.00 M/s)
fast, one level: closest 1.56 of Embree's speed (best 9.31 and 4.90 M/s), any 1.70 (best 1.00 and 2.00 M/s)
fast, one level as built: closest 1.40 of Embree's speed (best 9.31 and 4.90 M/s), any 1.50 (best 1.00 and 2.00 M/s)
fast, two levels: closest 1.57 of Embree's speed (best 9.31 and 4.90 M/s), any 1.71 (best 1.00 and 2.00 M/s)
";

    #[test]
    fn ratios_are_read() {
        let mut row = row(SAID).expect("a row");
        assert_eq!((&row["triangles"], &row["threads"]), (&json!(261_839), &json!(2)));
        assert_eq!(
            row["build"],
            json!({ "one_level": 1.32, "two_levels": 1.34, "improved": 0.43, "top_level": 2.07 })
        );
        row["scene"] = "Sponza".into();
        let table = rays_table(&[row]).expect("a table");
        assert!(
            table.contains("| Sponza | 261839 | 2 | one level | 1.90 | 2.12 | 1.56 | 1.70 |"),
            "{table}"
        );
        assert!(
            table.contains("| Sponza | 261839 | 2 | two levels | 1.91 | 2.13 | 1.57 | 1.71 |"),
            "{table}"
        );
    }

    #[test]
    fn other_words_are_refused() {
        assert!(row(&SAID.replace("fast, two levels", "fast, three levels")).is_err());
        assert!(row(&SAID.replace("any 2.13", "any NaN")).is_err());
    }
}
