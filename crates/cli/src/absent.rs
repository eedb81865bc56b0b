//! What a build without some features says in place of the commands that need them.

use std::ffi::OsString;

use anyhow::{Result, bail};
use clap::Args;

/// What a build without the feature `gpu` says.
pub(crate) const GPU: &str = "this build draws nothing on a graphics adapter; for that, install the \
     program by `cargo install --path crates/cli`, or build it with `--features gpu`";
/// What a build without the feature `window` says.
const WINDOW: &str = "this build opens no window; for that, install the program by \
     `cargo install --path crates/cli`, or build it with `--features window`";

/// Left out of this build, which opens no window.
#[derive(Debug, Args)]
pub(crate) struct View {
    #[arg(hide = true, trailing_var_arg = true, allow_hyphen_values = true)]
    words: Vec<OsString>,
}

impl View {
    pub(crate) fn run(self) -> Result<()> {
        bail!("{WINDOW}")
    }
}

/// Left out of this build, which draws nothing on a graphics adapter.
#[derive(Debug, Args)]
pub(crate) struct Drawing {
    #[arg(hide = true, trailing_var_arg = true, allow_hyphen_values = true)]
    words: Vec<OsString>,
}

impl Drawing {
    pub(crate) fn run(self) -> Result<()> {
        bail!("{GPU}")
    }
}
