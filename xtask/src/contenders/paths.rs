//! Camera paths a second beside Mitsuba's llvm variant, on all cores: all materials Lambert, 4
//! bounces, no roulette, the scene's first camera. Ours is the median of the passes of `lumencast
//! bench paths`, Mitsuba's the best of three runs of its tool, after loading.

use std::fmt::Write;
use std::path::Path;

use anyhow::Result;
use serde_json::json;

use super::{Effort, Measured, Subject, listed, median, number};
use crate::figures::json_of;
use crate::oracles::Mitsuba;
use crate::run::command;

/// Surface scattering events on a path.
const BOUNCES: &str = "4";

pub(super) fn measure(
    program: &Path,
    mitsuba: &Mitsuba,
    subjects: &[Subject],
    effort: &Effort,
) -> Result<Measured> {
    let mut figures = Vec::new();
    let mut table = "\nPaths, above 1 ours is faster:\n\n\
        | scene | ours, M a second | Mitsuba's | ratio, median | rounds |\n\
        | --- | --- | --- | --- | --- |\n"
        .to_owned();
    for subject in subjects {
        println!("\n── paths beside Mitsuba: {}", subject.name);
        let mut rounds = Vec::new();
        for round in 1..=effort.rounds {
            let ours = ours(program, subject, effort)?;
            let theirs = theirs(mitsuba, subject, effort)?;
            println!(
                "round {round}: {:.3} M a second beside {:.3}, {:.2}",
                1e-6 * ours,
                1e-6 * theirs,
                ours / theirs
            );
            rounds.push([ours, theirs]);
        }
        let ratios = || rounds.iter().map(|[ours, theirs]| ours / theirs);
        let rates = [0, 1].map(|which| median(rounds.iter().map(|round| round[which])));
        writeln!(
            table,
            "| {} | {:.2} | {:.2} | {:.2} | {} |",
            subject.name,
            1e-6 * rates[0],
            1e-6 * rates[1],
            median(ratios()),
            listed(ratios()),
        )?;
        figures.push(json!({
            "scene": subject.name,
            "size": effort.size,
            "paths_a_second": { "ours": rates[0], "mitsuba": rates[1] },
            "ratio": median(ratios()),
            "rounds": rounds.iter().map(|[ours, theirs]| json!({
                "ours": ours, "mitsuba": theirs, "ratio": ours / theirs,
            })).collect::<Vec<_>>(),
        }));
    }
    Ok(Measured { figures: figures.into(), table })
}

fn ours(program: &Path, subject: &Subject, effort: &Effort) -> Result<f64> {
    let (width, height) = effort.size;
    let mut bench = command(&program.to_string_lossy(), &["bench", "paths", "--json"]);
    bench.arg(&subject.gltf).args(["--materials", "lambert", "--bounces", BOUNCES]);
    bench.args(["--size", &format!("{width}x{height}"), "--rounds", &effort.passes.to_string()]);
    number(&json_of(bench)?, "/paths_a_second/median")
}

fn theirs(mitsuba: &Mitsuba, subject: &Subject, effort: &Effort) -> Result<f64> {
    let (width, height) = effort.size;
    let mut bench = mitsuba.tool("mitsuba_ref.py", &["bench"]);
    bench.arg(&subject.converted).args(["--bounces", BOUNCES]);
    bench.args(["--width", &width.to_string(), "--height", &height.to_string()]);
    bench.args(["--spp", &effort.bench_spp.to_string()]);
    number(&json_of(bench)?, "/paths_per_s")
}
