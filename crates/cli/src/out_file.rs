//! Files that commands write.

use std::fs;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail, ensure};
use lumencast_picture::{check_place, write_whole};

/// Checks that a file can be written there: people learn that before hours of work, not after.
pub(crate) fn check(path: &Path) -> Result<()> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    let folder = folder.unwrap_or(Path::new("."));
    ensure!(folder.is_dir(), "{}: there is no such folder as {}", path.display(), folder.display());
    ensure!(!path.is_dir(), "{}: is a folder", path.display());
    check_place(path).with_context(|| cannot_write(path))
}

/// Checks that files can be written into a folder, which is made where it is missing.
pub(crate) fn check_folder(folder: &Path) -> Result<()> {
    fs::create_dir_all(folder).with_context(|| format!("cannot make {}", folder.display()))?;
    check_place(&folder.join("file")).with_context(|| cannot_write(folder))
}

/// Refuses to write over what is read, by whatever name or link it is reached.
pub(crate) fn check_apart<'a>(
    outputs: impl IntoIterator<Item = &'a PathBuf>,
    inputs: &[PathBuf],
) -> Result<()> {
    for output in outputs {
        if let Some(input) = inputs.iter().find(|input| is_same_file(output, input)) {
            bail!(
                "{}: this is {}, which is read; name another file to write",
                output.display(),
                input.display()
            );
        }
    }
    Ok(())
}

#[cfg(unix)]
fn is_same_file(a: &Path, b: &Path) -> bool {
    use std::os::unix::fs::MetadataExt as _;
    let file = |path| fs::metadata(path).ok().filter(fs::Metadata::is_file);
    let number = |path| file(path).map(|there| (there.dev(), there.ino()));
    number(a).is_some_and(|a| Some(a) == number(b))
}

#[cfg(not(unix))]
fn is_same_file(a: &Path, b: &Path) -> bool {
    let whole = |path: &Path| path.canonicalize().ok();
    whole(a).is_some_and(|a| Some(a) == whole(b))
}

/// Writes a file: all of it, or nothing of what was there is lost.
pub(crate) fn write(path: &Path, bytes: &[u8]) -> Result<()> {
    write_whole(path, |out| out.write_all(bytes)).with_context(|| cannot_write(path))
}

fn cannot_write(path: &Path) -> String {
    format!("cannot write {}", path.display())
}
