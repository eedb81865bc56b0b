//! From a fresh machine to a scene in the browser, in one command.

use anyhow::Result;
use clap::Args;

use crate::run::{build_demo, command, hand_over};
use crate::setup::{self, Purpose};

/// Options of `cargo xtask demo`.
#[derive(Args)]
pub(crate) struct Demo {
    /// A glTF file, or one of the built-in scenes: cornell, door, tomb
    #[arg(default_value = "cornell")]
    scene: String,
    /// Further options of `lumencast serve`
    #[arg(last = true)]
    serve: Vec<String>,
}

impl Demo {
    pub(crate) fn run(&self) -> Result<()> {
        setup::install(Purpose::Demo)?;
        let program = build_demo()?;
        let mut serve = command(&program.to_string_lossy(), &["serve", &self.scene]);
        serve.args(&self.serve);
        // Relative paths are meant from where the user stands.
        serve.current_dir(std::env::current_dir()?);
        hand_over("Lumencast (Ctrl-C stops it)", serve)
    }
}
