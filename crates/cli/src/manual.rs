//! `lumencast completions` and `lumencast man`: the commands as shells and `man` know them.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use clap::{Args, Command};
use clap_complete::Shell;
use clap_mangen::Man;

use crate::output::say;
use crate::{out_file, output};

/// Prints completions for a shell.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  lumencast completions bash > ~/.local/share/bash-completion/completions/lumencast
  lumencast completions zsh > ~/.zfunc/_lumencast
  lumencast completions fish > ~/.config/fish/completions/lumencast.fish")]
pub(crate) struct Completions {
    /// The shell that is to complete what is typed.
    shell: Shell,
}

impl Completions {
    pub(crate) fn run(self, mut program: Command) -> Result<()> {
        let name = program.get_name().to_owned();
        let mut script = Vec::new();
        clap_complete::generate(self.shell, &mut program, name, &mut script);
        print(script)
    }
}

/// Prints the manual page, or writes it and those of all commands into a folder.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  lumencast man | man -l -
  lumencast man -o ~/.local/share/man/man1")]
pub(crate) struct Manual {
    /// Writes lumencast.1, lumencast-bake.1 and so on into this folder.
    #[arg(short, long, value_name = "FOLDER")]
    output: Option<PathBuf>,
}

impl Manual {
    pub(crate) fn run(self, program: Command) -> Result<()> {
        // `help` has no page; every command has --help.
        let mut program = program.disable_help_subcommand(true);
        // Gives commands of commands their whole names.
        program.build();
        let Some(folder) = &self.output else { return print(page(&program)?) };
        out_file::check_folder(folder)?;
        write(&program, folder)
    }
}

fn print(bytes: Vec<u8>) -> Result<()> {
    output::print(&String::from_utf8(bytes)?);
    Ok(())
}

/// The pages of a command and of those below it.
fn write(command: &Command, folder: &Path) -> Result<()> {
    let path = folder.join(name(command)).with_extension("1");
    out_file::write(&path, &page(command)?)?;
    say!("{}", path.display());
    command.get_subcommands().try_for_each(|below| write(below, folder))
}

fn name(command: &Command) -> &str {
    command.get_display_name().unwrap_or_else(|| command.get_name())
}

fn page(command: &Command) -> Result<Vec<u8>> {
    let mut page = Vec::new();
    Man::new(command.clone()).render(&mut page).context("the manual page")?;
    Ok(page)
}
