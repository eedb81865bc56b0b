//! The figures of docs/results (tick.md, link.md, settling.md), measured on this machine.

use std::path::Path;
use std::process::Command;

use anyhow::{Context, Result, ensure};
use clap::Args;
use serde_json::{Map, Value, json};

use crate::run::{build_release, command, npm, output, root, step, target_dir};
use crate::setup::{self, Purpose};

/// Options of `cargo xtask figures`.
#[derive(Args)]
pub(crate) struct Figures {
    /// A name for this machine; the figures go into benches/results/NAME.json
    name: String,
    /// Sponza as glTF; what needs it is left out otherwise
    #[arg(long, default_value = "../shared/scenes/sponza/Sponza.glb")]
    sponza: String,
}

/// Ticks that are measured, by name, as arguments of `lumencast bench tick`.
const TICKS: &[(&str, &[&str])] = &[
    ("cornell 8x8x8, as many samples as fit", &["cornell", "--seconds", "30"]),
    (
        "cornell 8x8x8, 16 samples, the minute",
        &["cornell", "--samples", "16", MINUTE, "--seconds", "60"],
    ),
    ("cornell 8x8x8, 64 samples", &["cornell", "--samples", "64", "--seconds", "20"]),
    (
        "cornell 16x16x16, 4 samples, the minute",
        &["cornell", "--volume", "16x16x16", "--samples", "4", MINUTE, "--seconds", "60"],
    ),
    ("sponza 10x6x7, as many samples as fit", &["SPONZA", "--volume", "10x6x7", "--seconds", "30"]),
];
const MINUTE: &str = "--edits=benches/minute.jsonl";

impl Figures {
    pub(crate) fn run(&self) -> Result<()> {
        setup::install(Purpose::Test)?;
        let program = build_release()?;
        let has_sponza = root().join(&self.sponza).is_file();

        let mut ticks = Map::new();
        for (name, arguments) in TICKS {
            if arguments.contains(&"SPONZA") && !has_sponza {
                println!("left out: {name} ({} is not there)", self.sponza);
                continue;
            }
            println!("{name}");
            let arguments =
                arguments.iter().map(|a| if *a == "SPONZA" { &self.sponza } else { *a });
            let mut bench = command(&program.to_string_lossy(), &["bench", "tick", "--json"]);
            bench.args(arguments);
            ticks.insert((*name).to_owned(), json_of(bench)?);
        }

        let folder = root().join("benches/results");
        std::fs::create_dir_all(&folder).context("cannot make benches/results")?;
        let page_file = target_dir().join("page-figures.json");
        let mut page = npm(&["run", "figures"]);
        page.env("LUMENCAST_BIN", &program).env("LUMENCAST_FIGURES", &page_file);
        step("the way to the page", page)?;
        let page = std::fs::read(&page_file).context("the page's figures are missing")?;

        let report = json!({
            "machine": machine(),
            "ticks": ticks,
            "page": serde_json::from_slice::<Value>(&page)?,
        });
        let file = folder.join(format!("{}.json", self.name));
        write(&file, &report)?;
        println!("\nWritten: {}", file.display());
        Ok(())
    }
}

/// What a program prints as JSON.
pub(crate) fn json_of(mut command: Command) -> Result<Value> {
    let output = command
        .output()
        .with_context(|| format!("cannot start {}", command.get_program().to_string_lossy()))?;
    ensure!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr).trim());
    Ok(serde_json::from_slice(&output.stdout)?)
}

pub(crate) fn write(file: &Path, report: &Value) -> Result<()> {
    let text = serde_json::to_string_pretty(report)? + "\n";
    std::fs::write(file, text).with_context(|| format!("cannot write {}", file.display()))
}

/// What was measured on.
pub(crate) fn machine() -> Value {
    let cpuinfo = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model =
        cpuinfo.lines().find_map(|line| line.strip_prefix("model name")?.split(": ").nth(1));
    json!({
        "processor": model,
        "cores": std::thread::available_parallelism().map_or(1, usize::from),
        "system": output("uname", &["-sr"]).map(|text| text.trim().to_owned()),
        "compiler": output("rustc", &["--version"]).map(|text| text.trim().to_owned()),
        "browser": output("chromium", &["--version"]).map(|text| text.trim().to_owned()),
    })
}
