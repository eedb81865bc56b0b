//! Programs of others that tests compare with.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

use crate::run::{command, step, target_dir};

/// The Python wheel that carries Embree 4.4 as a library of its own.
const EMBREE_WHEEL: &str = "embreex==4.4.0.post1";

/// Embree's library, fetched once; an error where that does not work, which leaves its test out.
pub(crate) fn embree() -> Result<PathBuf> {
    if let Some(path) = std::env::var_os("LUMENCAST_EMBREE") {
        return Ok(path.into());
    }
    let folder = target_dir().join("oracles/embree");
    if let Some(library) = library_in(&folder) {
        return Ok(library);
    }
    // Elsewhere first, so that an interrupted fetch leaves nothing that looks whole.
    let partial = folder.with_extension("part");
    fs::remove_dir_all(&partial).or_else(|e| match e.kind() {
        std::io::ErrorKind::NotFound => Ok(()),
        _ => Err(e),
    })?;
    fs::create_dir_all(&partial).with_context(|| partial.display().to_string())?;
    let mut fetch = command("python3", &["-m", "pip", "download", "--quiet", "--no-deps"]);
    fetch.args(["--disable-pip-version-check", "--only-binary=:all:", "--dest"]);
    step("Embree, to compare rays with", {
        fetch.arg(&partial).arg(EMBREE_WHEEL);
        fetch
    })?;
    let wheel = first(&partial, |name| name.ends_with(".whl")).context("no wheel came")?;
    let mut unpack = command("python3", &["-m", "zipfile", "--extract"]);
    unpack.arg(&wheel).arg(&partial);
    step("unpack Embree", unpack)?;
    fs::rename(&partial, &folder).with_context(|| folder.display().to_string())?;
    library_in(&folder).context("the wheel holds no libembree4")
}

fn library_in(folder: &Path) -> Option<PathBuf> {
    first(&folder.join("embreex.libs"), |name| name.starts_with("libembree4"))
}

fn first(folder: &Path, is_wanted: impl Fn(&str) -> bool) -> Option<PathBuf> {
    let entries = fs::read_dir(folder).ok()?.flatten();
    entries
        .map(|e| e.path())
        .find(|path| path.file_name().and_then(|name| name.to_str()).is_some_and(&is_wanted))
}
