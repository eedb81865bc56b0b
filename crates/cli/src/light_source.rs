//! Light fields from where people have them: files and servers.

use std::path::Path;

use anyhow::{Context, Result};
use lumencast_codec::LightFile;
use lumencast_light::ProbeVolume;

use crate::remote;

/// Whether it is the address of a server's scene.
pub(crate) fn is_address(what: &str) -> bool {
    what.starts_with("http://") || what.starts_with("https://")
}

/// The volumes of a file, or the newest ones of a server's scene.
pub(crate) fn volumes(what: &str) -> Result<Vec<ProbeVolume>> {
    if is_address(what) {
        return Ok(remote::look(what)?.volumes);
    }
    let bytes = std::fs::read(Path::new(what)).with_context(|| format!("cannot read {what}"))?;
    let read = || LightFile::read(&bytes)?.volumes();
    read().with_context(|| format!("{what} is no light field"))
}
