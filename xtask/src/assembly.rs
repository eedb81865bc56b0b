//! Whether the video library was built with its assembly: without, it is 2.6 times slower and says
//! nothing of it.

use std::fs;

use anyhow::{Result, ensure};

use crate::run::target_dir;

/// What the library's build writes where it goes without.
const WITHOUT: &str = "not using any assembly";

/// Looks through what builds of the library have written.
pub(crate) fn check() -> Result<()> {
    if !cfg!(target_arch = "x86_64") {
        return Ok(());
    }
    let mut builds = 0;
    for folder in fs::read_dir(target_dir().join("debug/build"))? {
        let folder = folder?;
        if !folder.file_name().to_string_lossy().starts_with("openh264-sys2-") {
            continue;
        }
        // The build script itself has a folder too, which has written nothing.
        let Ok(written) = fs::read_to_string(folder.path().join("output")) else { continue };
        let advice = "install nasm and run `cargo clean -p openh264-sys2`";
        ensure!(!written.contains(WITHOUT), "openh264 was built without its assembly: {advice}");
        builds += 1;
    }
    ensure!(builds > 0, "openh264 was not built");
    Ok(())
}
