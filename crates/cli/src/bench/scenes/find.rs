//! Which scenes are meant.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};
use lumencast_scene::BUILTINS;

/// The scenes that are named, and those in the folders that are, in the order of their names; folders
/// within folders count. The built-in scenes where nothing is named.
pub(super) fn scenes(named: &[PathBuf]) -> Result<Vec<PathBuf>> {
    if named.is_empty() {
        return Ok(BUILTINS.iter().map(PathBuf::from).collect());
    }
    let mut found = Vec::new();
    for path in named {
        let before = found.len();
        add(path, &mut found)?;
        ensure!(found.len() > before, "there is no .glb or .gltf file in {}", path.display());
    }
    Ok(found)
}

fn add(path: &Path, found: &mut Vec<PathBuf>) -> Result<()> {
    if !path.is_dir() {
        found.push(path.to_owned());
        return Ok(());
    }
    let read = || -> std::io::Result<Vec<PathBuf>> {
        path.read_dir()?.map(|entry| Ok(entry?.path())).collect()
    };
    let mut within = read().with_context(|| format!("cannot read {}", path.display()))?;
    within.sort();
    let is_scene = |path: &Path| path.extension().is_some_and(|e| e == "glb" || e == "gltf");
    for path in within.iter().filter(|path| path.is_dir() || is_scene(path)) {
        add(path, found)?;
    }
    Ok(())
}
