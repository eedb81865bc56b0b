//! What one runs by hand in this repository: `cargo xtask demo`, `cargo xtask test`,
//! `cargo xtask arm`, `cargo xtask figures`, `cargo xtask contenders`, `cargo xtask setup`.
#![expect(clippy::print_stdout, reason = "a program for the terminal")]

mod arm;
mod assembly;
mod contenders;
mod demo;
#[cfg(test)]
mod documents;
mod figures;
#[cfg(test)]
mod imports;
mod licences;
mod oracles;
mod run;
mod setup;
mod test;

use std::process::ExitCode;

use clap::{Parser, Subcommand};

#[derive(Parser)]
#[command(name = "cargo xtask", about = "Set-up, tests and demo of Lumencast", version)]
struct Args {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Install what is missing, build everything, serve a scene and print the page's address
    Demo(demo::Demo),
    /// Everything that CI runs: formatting, lints, tests, licences, the web packages, the browser
    Test(test::Test),
    /// The library tests of `gather` for aarch64, in emulation; installs what that needs (as root)
    Arm,
    /// Measure this machine: ticks, and the way to a page; writes benches/results/NAME.json
    Figures(figures::Figures),
    /// Measure beside Embree and Mitsuba, in turns; writes benches/results/NAME-contenders.json
    Contenders(contenders::Contenders),
    /// Install what building and testing need (as root), or print the commands that do
    Setup,
}

fn main() -> ExitCode {
    let outcome = match Args::parse().command {
        Command::Demo(demo) => demo.run(),
        Command::Test(test) => test.run(),
        Command::Arm => arm::run(),
        Command::Figures(figures) => figures.run(),
        Command::Contenders(contenders) => contenders.run(),
        Command::Setup => setup::install(setup::Purpose::Test),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("\nerror: {error:#}");
            ExitCode::FAILURE
        }
    }
}
