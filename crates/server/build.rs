//! Compiles the page into the server, if it has been built (`web/viewer/dist`).

use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::{env, fs, io};

fn main() -> io::Result<()> {
    let viewer = Path::new(&env::var("CARGO_MANIFEST_DIR").unwrap_or_default())
        .join("../../web/viewer")
        .components()
        .collect::<PathBuf>();
    // The folder above, so that the page's first build is noticed too.
    if viewer.exists() {
        println!("cargo::rerun-if-changed={}", viewer.display());
    }
    let mut files = Vec::new();
    collect(&viewer.join("dist"), "", &mut files)?;
    files.sort();

    let mut code = String::from("pub(super) static FILES: &[(&str, &[u8])] = &[\n");
    for (name, path) in &files {
        let path = fs::canonicalize(path)?;
        let _ = writeln!(code, "    ({name:?}, include_bytes!({path:?})),");
    }
    code.push_str("];\n");
    fs::write(Path::new(&env::var("OUT_DIR").unwrap_or_default()).join("page.rs"), code)
}

/// Adds the files of a folder, if there is one, named from its root with forward slashes.
fn collect(folder: &Path, prefix: &str, files: &mut Vec<(String, PathBuf)>) -> io::Result<()> {
    if !folder.is_dir() {
        return Ok(());
    }
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        let name = format!("{prefix}{}", entry.file_name().to_string_lossy());
        if entry.file_type()?.is_dir() {
            collect(&entry.path(), &format!("{name}/"), files)?;
        } else if !name.ends_with(".map") {
            files.push((name, entry.path()));
        }
    }
    Ok(())
}
