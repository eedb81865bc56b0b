//! Programs of others that tests compare with.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, ensure};

use crate::run::{command, output, root, step, target_dir};

/// The Python wheel that carries Embree 4.4 as a library of its own.
pub(crate) const EMBREE_WHEEL: &str = "embreex==4.4.0.post1";

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
    empty(&partial)?;
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

/// Scenes in which light is compared with what Mitsuba computed there; where tests look for them.
pub(crate) fn scenes() -> PathBuf {
    std::env::var_os("LUMENCAST_SCENES").map_or(root().join("../shared/scenes"), PathBuf::from)
}

/// The Python wheel of Mitsuba.
pub(crate) const MITSUBA_WHEEL: &str = "mitsuba==3.9.1";

/// The oldest LLVM with which Mitsuba works: 15 ends with "Cannot select fminimum". What results
/// were published with; 22 works too.
const OLDEST_LLVM: u32 = 19;

/// Mitsuba 3 in a Python environment of its own, and the tools that drive it.
pub(crate) struct Mitsuba {
    python: PathBuf,
    tools: PathBuf,
    /// LLVM's library, by which Mitsuba compiles.
    pub(crate) llvm: PathBuf,
}

impl Mitsuba {
    /// Mitsuba, installed once below the target folder; `tools` holds `conv.py` and `mitsuba_ref.py`,
    /// or a folder `mitsuba` with both.
    pub(crate) fn ready(tools: &Path) -> Result<Self> {
        let has_tools = |folder: &PathBuf| {
            ["conv.py", "mitsuba_ref.py"].iter().all(|name| folder.join(name).is_file())
        };
        let folders = [tools.to_owned(), tools.join("mitsuba")];
        let tools = folders.into_iter().find(has_tools).with_context(|| {
            format!("{} holds no conv.py and mitsuba_ref.py: see --tools", tools.display())
        })?;
        Ok(Self { tools, llvm: llvm()?, python: mitsuba_python()? })
    }

    /// One of the tools, to be run.
    pub(crate) fn tool(&self, script: &str, args: &[&str]) -> Command {
        let mut tool = command(&self.python.to_string_lossy(), &[]);
        tool.env("DRJIT_LIBLLVM_PATH", &self.llvm).arg(self.tools.join(script)).args(args);
        tool
    }

    /// Converts a glTF file; returns what Mitsuba's tool reads.
    pub(crate) fn scene(&self, gltf: &Path) -> Result<PathBuf> {
        let stem = gltf.file_stem().context("a scene needs a name")?;
        let folder = target_dir().join("oracles/mitsuba-scenes").join(stem);
        // It keeps textures that are there.
        empty(&folder)?;
        let mut convert = self.tool("conv.py", &[]);
        convert.arg(gltf).arg(&folder);
        step(&format!("{} for Mitsuba", stem.display()), convert)?;
        Ok(folder.join("scene.json"))
    }
}

/// The Python that has Mitsuba and what the tools import.
fn mitsuba_python() -> Result<PathBuf> {
    let folder = target_dir().join("oracles/mitsuba");
    let python = folder.join("bin/python");
    if python.is_file() {
        return Ok(python);
    }
    ensure!(
        output("python3", &["-c", "import venv, ensurepip"]).is_some(),
        "Mitsuba needs a Python environment of its own: install the Debian package python3-venv"
    );
    // Elsewhere first, so that an interrupted installation leaves nothing that looks whole.
    let partial = folder.with_extension("part");
    empty(&partial)?;
    let mut environment = command("python3", &["-m", "venv"]);
    environment.arg(&partial);
    step("a Python environment for Mitsuba", environment)?;
    let install = ["-m", "pip", "install", "--quiet", "--disable-pip-version-check"];
    let mut install = command(&partial.join("bin/python").to_string_lossy(), &install);
    install.args(["--only-binary=:all:", MITSUBA_WHEEL, "numpy", "pillow"]);
    step("Mitsuba, to compare pictures with", install)?;
    fs::rename(&partial, &folder).with_context(|| folder.display().to_string())?;
    Ok(python)
}

/// LLVM's library: the one named, or of those installed the oldest with which Mitsuba works.
fn llvm() -> Result<PathBuf> {
    if let Some(path) = std::env::var_os("DRJIT_LIBLLVM_PATH").map(PathBuf::from) {
        ensure!(path.is_file(), "DRJIT_LIBLLVM_PATH names no file: {}", path.display());
        return Ok(path);
    }
    // Where Debian has this processor's libraries; those of others may lie beside.
    let folder = format!("/usr/lib/{}-linux-gnu", std::env::consts::ARCH);
    let files = fs::read_dir(folder).into_iter().flatten().flatten();
    let found = files.filter_map(|file| {
        let version = llvm_version(file.file_name().to_str()?)?;
        (version >= OLDEST_LLVM).then(|| (version, file.path()))
    });
    let (_, library) = found.min().with_context(|| {
        format!(
            "Mitsuba needs LLVM {OLDEST_LLVM} or newer: install the Debian package \
             libllvm{OLDEST_LLVM}, or name its library in DRJIT_LIBLLVM_PATH"
        )
    })?;
    Ok(library)
}

/// `libLLVM.so.19.1` or `libLLVM-19.so`
fn llvm_version(name: &str) -> Option<u32> {
    let rest = name.strip_prefix("libLLVM.so.").or_else(|| name.strip_prefix("libLLVM-"))?;
    rest.split('.').next()?.parse().ok()
}

/// Makes a folder that is empty.
fn empty(folder: &Path) -> Result<()> {
    fs::remove_dir_all(folder)
        .or_else(|e| match e.kind() {
            std::io::ErrorKind::NotFound => Ok(()),
            _ => Err(e),
        })
        .and_then(|()| fs::create_dir_all(folder))
        .with_context(|| folder.display().to_string())
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn versions_of_llvm_are_read_from_names() {
        assert_eq!(llvm_version("libLLVM.so.19.1"), Some(19));
        assert_eq!(llvm_version("libLLVM-14.0.6.so.1"), Some(14));
        assert_eq!(llvm_version("libLLVM-22.so"), Some(22));
        assert_eq!(llvm_version("libLLVM.so"), None);
        assert_eq!(llvm_version("libLLVMSPIRVLib.so.19.1"), None);
    }
}
