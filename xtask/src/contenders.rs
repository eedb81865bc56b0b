//! The comparisons of docs/results with programs of others, measured on this machine.
//!
//! Each runs in turns with its contender, so that what else the machine does meets both, and is told
//! as the median of the rounds' ratios:
//! - `rays`: rays and building beside Embree's, on one thread and on two (rays.md, building.md);
//! - `paths`: camera paths a second beside Mitsuba's (paths.md);
//! - `error`: squared error at equal time beside Mitsuba's, against a converged picture (error.md).
//!
//! Nothing else should run meanwhile.

mod error;
mod paths;
mod rays;

use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Context, Result, ensure};
use clap::{Args, ValueEnum};
use serde_json::{Map, Value, json};

use crate::figures::{machine, write};
use crate::oracles::{self, EMBREE_WHEEL, MITSUBA_WHEEL, Mitsuba};
use crate::run::{cargo, root, step, target_dir};

/// Options of `cargo xtask contenders`.
#[derive(Args)]
#[command(after_help = "\
Examples:
  cargo xtask contenders amd-epyc-2-cores
  cargo xtask contenders amd-epyc-2-cores --only paths,error --rounds 3
  cargo xtask contenders try --quick

Embree and Mitsuba are fetched once, by pip, below the target folder. Mitsuba needs python3-venv and
LLVM 19 or newer (libllvm19).")]
pub(crate) struct Contenders {
    /// A name for this machine; the figures go into benches/results/NAME-contenders.json
    name: String,
    /// Where sponza/Sponza.glb and breakfast_room/BreakfastRoom.glb are; ../shared/scenes unless given
    #[arg(long, value_name = "FOLDER")]
    scenes: Option<PathBuf>,
    /// Where conv.py and mitsuba_ref.py are; ../shared/tools unless given
    #[arg(long, value_name = "FOLDER")]
    tools: Option<PathBuf>,
    /// Rounds of paths and of error, 4 unless given (2 if quick); rays always take 15
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100))]
    rounds: Option<u32>,
    /// Samples a pixel of the converged picture, 4096 unless given (128 if quick)
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..=65536))]
    reference_spp: Option<u32>,
    /// Measures these parts alone, and the file holds these alone
    #[arg(long, value_name = "PARTS", value_delimiter = ',')]
    only: Vec<Part>,
    /// Tries it out within a few minutes: few rays and samples, and figures of no worth, which go
    /// into the target folder
    #[arg(long)]
    quick: bool,
    /// Programs that are built already, in place of those of this checkout: FOLDER/lumencast and
    /// FOLDER/examples/against_embree
    #[arg(long, value_name = "FOLDER")]
    built: Option<PathBuf>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Part {
    /// Rays and building, beside Embree
    Rays,
    /// Camera paths a second, beside Mitsuba
    Paths,
    /// Squared error at equal time, beside Mitsuba
    Error,
}

/// How much is measured.
struct Effort {
    /// Threads of rays, one run each.
    threads: &'static [u32],
    /// Rays of each kind.
    rays: u32,
    /// Rounds of paths and of error.
    rounds: u32,
    /// Width and height of the picture whose paths are counted.
    size: (u32, u32),
    /// Our passes of 4 samples a pixel, of whose rates the median counts.
    passes: u32,
    /// Samples a pixel of each of the three runs of Mitsuba's tool, the best of which counts.
    bench_spp: u32,
    /// Samples a pixel of pictures whose error is measured.
    spp: u32,
    /// Samples a pixel of the converged picture, both halves together.
    reference_spp: u32,
}

/// What docs/results is measured with.
const FULL: Effort = Effort {
    threads: &[2, 1],
    rays: 500_000,
    rounds: 4,
    size: (1280, 720),
    passes: 9,
    bench_spp: 8,
    spp: 64,
    reference_spp: 4096,
};

const QUICK: Effort = Effort {
    threads: &[2],
    rays: 20_000,
    rounds: 2,
    size: (640, 360),
    passes: 2,
    bench_spp: 2,
    spp: 8,
    reference_spp: 128,
};

/// A part's figures, for the file and to read.
struct Measured {
    figures: Value,
    /// Markdown, with a line about it.
    table: String,
}

/// A scene for us and for Mitsuba.
struct Subject {
    name: &'static str,
    gltf: PathBuf,
    /// As Mitsuba's tool reads it.
    converted: PathBuf,
}

impl Contenders {
    pub(crate) fn run(&self) -> Result<()> {
        let start = Instant::now();
        let scenes = Scenes::below(self.scenes.clone().unwrap_or_else(oracles::scenes))?;
        let effort = self.effort();
        let wants_mitsuba = self.wants(Part::Paths) || self.wants(Part::Error);
        let embree = self.wants(Part::Rays).then(oracles::embree).transpose()?;
        let mitsuba = wants_mitsuba.then(|| Mitsuba::ready(&self.tools())).transpose()?;
        let built = self.build()?;
        let program = built.join("lumencast");

        let mut report = Map::new();
        report.insert("machine".into(), machine());
        report.insert("quick".into(), self.quick.into());
        let mut tables = String::new();
        let mut add = |name: &str, measured: Measured| {
            report.insert(name.into(), measured.figures);
            tables += &measured.table;
        };
        if let Some(library) = embree {
            let example = built.join("examples/against_embree");
            add("rays", rays::measure(&example, &library, &scenes, &effort)?);
        }
        if let Some(mitsuba) = &mitsuba {
            let subjects = scenes.subjects(mitsuba)?;
            if self.wants(Part::Paths) {
                add("paths", paths::measure(&program, mitsuba, &subjects, &effort)?);
            }
            if self.wants(Part::Error) {
                add("error", error::measure(&program, mitsuba, &subjects, &effort)?);
            }
        }
        let llvm = mitsuba.and_then(|m| Some(m.llvm.file_name()?.to_string_lossy().into_owned()));
        let contenders = json!({ "embree": EMBREE_WHEEL, "mitsuba": MITSUBA_WHEEL, "llvm": llvm });
        report.insert("contenders".into(), contenders);

        println!("{tables}");
        let file = self.file()?;
        write(&file, &report.into())?;
        println!("Written after {:.0} s: {}", start.elapsed().as_secs_f64(), file.display());
        Ok(())
    }

    fn wants(&self, part: Part) -> bool {
        self.only.is_empty() || self.only.contains(&part)
    }

    fn effort(&self) -> Effort {
        let effort = if self.quick { QUICK } else { FULL };
        Effort {
            rounds: self.rounds.unwrap_or(effort.rounds),
            reference_spp: self.reference_spp.unwrap_or(effort.reference_spp),
            ..effort
        }
    }

    fn tools(&self) -> PathBuf {
        self.tools.clone().unwrap_or_else(|| root().join("../shared/tools"))
    }

    /// Builds what is measured, before any of it runs; returns the folder where it is.
    fn build(&self) -> Result<PathBuf> {
        if let Some(folder) = &self.built {
            return absolute(folder);
        }
        if self.wants(Part::Rays) {
            let example = ["--release", "-p", "lumencast-gather", "--example", "against_embree"];
            step("our rays", cargo(&[&["build"][..], &example].concat()))?;
        }
        step("the program", cargo(&["build", "--release", "-p", "lumencast-cli"]))?;
        Ok(target_dir().join("release"))
    }

    fn file(&self) -> Result<PathBuf> {
        let folder = if self.quick { target_dir() } else { root().join("benches/results") };
        std::fs::create_dir_all(&folder).with_context(|| folder.display().to_string())?;
        Ok(folder.join(format!("{}-contenders.json", self.name)))
    }
}

/// Where the scenes are that come as files.
struct Scenes {
    sponza: PathBuf,
    breakfast_room: PathBuf,
}

impl Scenes {
    fn below(folder: PathBuf) -> Result<Self> {
        let folder = absolute(&folder)?;
        let scenes = Self {
            sponza: folder.join("sponza/Sponza.glb"),
            breakfast_room: folder.join("breakfast_room/BreakfastRoom.glb"),
        };
        for file in [&scenes.sponza, &scenes.breakfast_room] {
            ensure!(file.is_file(), "{} is not there: see --scenes", file.display());
        }
        Ok(scenes)
    }

    /// What is compared with Mitsuba, converted for it.
    fn subjects(&self, mitsuba: &Mitsuba) -> Result<Vec<Subject>> {
        [("Sponza", &self.sponza), ("Breakfast room", &self.breakfast_room)]
            .into_iter()
            .map(|(name, gltf)| {
                Ok(Subject { name, gltf: gltf.clone(), converted: mitsuba.scene(gltf)? })
            })
            .collect()
    }
}

/// Commands run in the root, but paths are given from where one is.
fn absolute(path: &Path) -> Result<PathBuf> {
    std::path::absolute(path).with_context(|| path.display().to_string())
}

/// A number within what a program printed, by its JSON pointer.
fn number(value: &Value, pointer: &str) -> Result<f64> {
    let found = value.pointer(pointer).and_then(Value::as_f64);
    found.with_context(|| format!("no number at {pointer} in {value}"))
}

/// Of an even number of values, the mean of the two in the middle.
fn median(values: impl IntoIterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.into_iter().collect();
    values.sort_by(f64::total_cmp);
    let last = values.len() - 1;
    0.5 * (values[last / 2] + values[last.div_ceil(2)])
}

/// Numbers to two digits after the point, with commas between.
fn listed(values: impl IntoIterator<Item = f64>) -> String {
    values.into_iter().map(|value| format!("{value:.2}")).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn medians_of_odd_and_even_numbers() {
        assert_eq!(median([3.0, 1.0, 2.0]), 2.0);
        assert_eq!(median([4.0, 1.0, 3.0, 2.0]), 2.5);
        assert_eq!(median([7.0]), 7.0);
    }
}
