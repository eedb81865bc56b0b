//! Reference pictures, by Mitsuba 3.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail, ensure};
use clap::Args;
use lumencast_picture::{Loaded, Picture};

use super::subjects::Subject;
use crate::bench::traced::SIZE;
use crate::output::tell;

/// Mitsuba's arguments for samples a pixel and bounces.
const EFFORT: [&str; 4] = ["--spp", "1024", "--bounces", "4"];

/// Where references are, and how they are made.
#[derive(Debug, Args)]
pub(super) struct References {
    /// The folder of the references, such as sponza.exr; those that are not there are made.
    #[arg(long, value_name = "FOLDER")]
    references: PathBuf,
    /// The folder of conv.py and mitsuba_ref.py, which make references.
    #[arg(long, value_name = "FOLDER")]
    tools: Option<PathBuf>,
    /// A Python that has Mitsuba 3, NumPy and Pillow.
    #[arg(long, value_name = "PROGRAM", default_value = "python3")]
    python: PathBuf,
}

impl References {
    /// The reference of a scene whose file is `scene`.
    pub(super) fn read(&self, subject: &Subject, scene: &Path) -> Result<Picture> {
        let path = self.references.join(subject.name).with_extension("exr");
        if !path.is_file() {
            self.make(scene, &path)?;
        }
        let reference = Loaded::read(&path)?.linear();
        let size = glam::UVec2::new(reference.width(), reference.height());
        ensure!(size == SIZE, "{}: {size} pixels instead of {SIZE}", path.display());
        Ok(reference)
    }

    fn make(&self, scene: &Path, path: &Path) -> Result<()> {
        let Some(tools) = &self.tools else {
            bail!(
                "{} is not there: give --tools, the folder of mitsuba_ref.py, to make it",
                path.display()
            );
        };
        std::fs::create_dir_all(&self.references)
            .with_context(|| format!("cannot make {}", self.references.display()))?;
        tell!("Mitsuba draws {}: this takes minutes.", path.display());
        let plain = path.with_extension("scene");
        self.python(&tools.join("conv.py"), |run| {
            run.arg(scene).arg(&plain);
        })?;
        let [width, height] = SIZE.to_array().map(|n| n.to_string());
        self.python(&tools.join("mitsuba_ref.py"), |run| {
            run.arg("render").arg(plain.join("scene.json")).arg(path);
            run.args(["--width", &width, "--height", &height, "--alpha", "opaque"]).args(EFFORT);
        })
    }

    fn python(&self, script: &Path, arguments: impl FnOnce(&mut Command)) -> Result<()> {
        let mut run = Command::new(&self.python);
        run.arg(script);
        arguments(&mut run);
        let output =
            run.output().with_context(|| format!("cannot start {}", self.python.display()))?;
        ensure!(
            output.status.success(),
            "{}: {}",
            script.display(),
            String::from_utf8_lossy(&output.stderr).trim()
        );
        Ok(())
    }
}
