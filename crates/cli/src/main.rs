//! The `lumencast` program.

#![cfg_attr(
    not(all(feature = "gpu", feature = "window")),
    expect(dead_code, reason = "what drawing needs stands beside what others need too")
)]
// All that is printed goes through `output`: it bears a full disk, and names from anywhere.
#![warn(clippy::print_stderr)]

#[cfg(not(all(feature = "gpu", feature = "window")))]
mod absent;
mod arguments;
mod bake;
mod bench;
mod camera;
mod charting;
mod compare;
mod doctor;
mod environment;
mod film_file;
mod fingerprint;
mod inspect;
mod interrupt;
mod light_source;
mod lightmap_report;
mod manual;
mod out_file;
mod output;
mod printable;
mod probe;
mod remote;
mod render;
mod serve;
mod token;
mod values;
#[cfg(feature = "window")]
mod view;
mod warnings;
mod words;

use std::io::IsTerminal;
use std::process::ExitCode;

use clap::{CommandFactory as _, Parser, Subcommand};
use tracing_subscriber::EnvFilter;
use tracing_subscriber::field::MakeExt as _;
use tracing_subscriber::fmt::format;

use crate::printable::printable;

/// Computes the indirect light of a 3D scene and casts it, live, to any number of clients.
#[derive(Debug, Parser)]
#[command(name = "lumencast", version, arg_required_else_help = true, after_help = EXAMPLES)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

const EXAMPLES: &str = "\
Examples:
  lumencast serve cornell                 a built-in scene; prints the page's address
  lumencast serve sponza.glb              a scene of your own
  lumencast view sponza.glb               in a window, without a browser
  lumencast bake sponza.glb -o sponza.light
  lumencast doctor                        when something does not work

Log messages go to standard error; RUST_LOG=debug shows more of them.
Exit codes: 0 done, 1 failed, 2 wrong usage, 130 interrupted.";

/// What is logged unless RUST_LOG says otherwise. The transport's libraries warn of much that is no
/// fault here: a client that leaves, small socket buffers, addresses without a name.
const LOGGED: &str = "warn,moq_sock=error,moq_tokio=error,moq_net=error,moq_relay=off,\
     web_transport_moq=error,winit=error";

#[derive(Debug, Subcommand)]
enum Command {
    Serve(serve::Serve),
    #[cfg(feature = "window")]
    View(Box<view::View>),
    #[cfg(not(feature = "window"))]
    View(absent::View),
    Bake(bake::Bake),
    Inspect(inspect::Inspect),
    Probe(probe::Probe),
    Render(Box<render::Render>),
    Compare(compare::Compare),
    Doctor(doctor::Doctor),
    Token(token::Token),
    Completions(manual::Completions),
    #[command(name = "man")]
    Manual(manual::Manual),
    #[command(subcommand)]
    Bench(bench::Bench),
}

fn main() -> ExitCode {
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        // Help and the version come this way too, and go to standard output.
        Err(message) => {
            let printed = message.print();
            if !message.use_stderr() {
                output::end_unless_printed(printed);
            }
            return u8::try_from(message.exit_code()).map_or(ExitCode::FAILURE, ExitCode::from);
        }
    };
    log();

    let result = match cli.command {
        Command::Serve(command) => command.run(),
        Command::View(command) => command.run(),
        Command::Bake(command) => command.run(),
        Command::Inspect(command) => command.run(),
        Command::Probe(command) => command.run(),
        Command::Render(command) => command.run(),
        Command::Compare(command) => command.run(),
        Command::Doctor(command) => command.run(),
        Command::Token(command) => command.run(),
        Command::Completions(command) => command.run(Cli::command()),
        Command::Manual(command) => command.run(Cli::command()),
        Command::Bench(command) => command.run(),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            output::error(&error);
            ExitCode::FAILURE
        }
    }
}

/// Logs to standard error.
fn log() {
    let filter = EnvFilter::try_from_default_env().unwrap_or_else(|_| EnvFilter::new(LOGGED));
    let fields = format::debug_fn(|out, field, value| {
        let value = format!("{value:?}");
        match field.name() {
            "message" => write!(out, "{}", printable(&value)),
            name => write!(out, "{name}={}", printable(&value)),
        }
    });
    tracing_subscriber::fmt()
        .with_env_filter(filter)
        .fmt_fields(fields.delimited(" "))
        .with_writer(std::io::stderr)
        .with_ansi(std::io::stderr().is_terminal())
        .log_internal_errors(false)
        .init();
}

#[cfg(test)]
mod tests {
    use super::*;

    /// No two arguments of a command have one name, and so on.
    #[test]
    fn commands_are_sound() {
        Cli::command().debug_assert();
    }
}
