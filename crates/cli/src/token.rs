//! `lumencast token`: who may edit a server that is not on loopback.

use std::path::PathBuf;
use std::time::Duration;

use anyhow::{Result, ensure};
use clap::Args;
use lumencast_transport::Key;

use crate::out_file;
use crate::output::say;

/// Issues a token that lets its bearer edit a scene.
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  lumencast token sponza --token-key key.jwk --generate
  lumencast serve sponza.glb --listen 0.0.0.0:4443 --token-key key.jwk
  lumencast token sponza --token-key key.jwk --days 1

The token goes into the query of the page's address: https://HOST:4443/?jwt=TOKEN")]
pub(crate) struct Token {
    /// Name of the scene, as `serve` prints it.
    scene: String,
    /// The key that signs; the same file is given to `serve`.
    #[arg(long, value_name = "FILE")]
    token_key: PathBuf,
    /// Makes the key first; the file must not exist.
    #[arg(long)]
    generate: bool,
    /// The token is valid for so many days.
    #[arg(long, default_value_t = 30, value_parser = clap::value_parser!(u32).range(1..=3650))]
    days: u32,
}

impl Token {
    pub(crate) fn run(self) -> Result<()> {
        let path = &self.token_key;
        let key = if self.generate {
            ensure!(!path.exists(), "{} exists: leave --generate out to use it", path.display());
            out_file::check(path)?;
            let key = Key::generate()?;
            // Part of a key is of no use, and would be taken for one.
            key.write(path).inspect_err(|_| drop(std::fs::remove_file(path)))?;
            key
        } else {
            ensure!(path.exists(), "{} does not exist: --generate makes it", path.display());
            Key::read(path)?
        };
        let lifetime = Duration::from_secs(u64::from(self.days) * 24 * 60 * 60);
        say!("{}", key.issue_token(&self.scene, Some(lifetime))?);
        Ok(())
    }
}
