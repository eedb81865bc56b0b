//! What goes to the terminal.

use std::borrow::Cow;
use std::io::{ErrorKind, Write};
use std::path::Path;
use std::time::Duration;

use anyhow::{Context, Result, ensure};
use indicatif::{ProgressBar, ProgressStyle};

/// Ends the program as Unix's own do when nobody reads on, `lumencast inspect FILE | head` for
/// instance: quietly, with the code of SIGPIPE. For `println!`, which panics then, and for all other
/// panics the usual message.
pub(crate) fn end_quietly_where_nobody_reads() {
    let report = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| {
        let message = panic.payload_as_str().unwrap_or_default();
        if message.starts_with("failed printing to stdout") && message.contains("Broken pipe") {
            std::process::exit(BROKEN_PIPE);
        }
        report(panic);
    }));
}

/// Exit code of a program that SIGPIPE ended.
const BROKEN_PIPE: i32 = 141;

/// Prints JSON, and nothing but it, to standard output.
pub(crate) fn json(value: &serde_json::Value) -> Result<()> {
    let mut out = std::io::stdout().lock();
    let written = serde_json::to_writer_pretty(&mut out, value)
        .map_err(std::io::Error::from)
        .and_then(|()| writeln!(out));
    match written {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => std::process::exit(BROKEN_PIPE),
        written => written.context("cannot write to standard output"),
    }
}

/// Whether a file can be written there: said before hours of work, not after.
pub(crate) fn check_file(path: &Path) -> Result<()> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    let folder = folder.unwrap_or(Path::new("."));
    ensure!(folder.is_dir(), "{}: there is no such folder as {}", path.display(), folder.display());
    ensure!(!path.is_dir(), "{}: is a folder", path.display());
    Ok(())
}

/// A line that turns while something of unknown length goes on; on standard error, and only if
/// that is a terminal.
pub(crate) fn spinner(message: String) -> ProgressBar {
    let bar = ProgressBar::new_spinner().with_message(message);
    bar.enable_steady_tick(Duration::from_millis(100));
    bar
}

/// A bar with the time left; on standard error, and only if that is a terminal.
pub(crate) fn bar(length: u64, message: impl Into<Cow<'static, str>>) -> ProgressBar {
    let style = ProgressStyle::with_template("{msg} {wide_bar} {pos}/{len}, {eta} left")
        .unwrap_or_else(|_| ProgressStyle::default_bar());
    ProgressBar::new(length).with_style(style).with_message(message)
}

/// Positions of a [`share_bar`].
pub(crate) const SHARE_BAR_LENGTH: f64 = 10_000.0;

/// A bar of work whose parts are not worth counting: percent and the time left; on standard error,
/// and only if that is a terminal.
pub(crate) fn share_bar(message: &'static str) -> ProgressBar {
    let style = ProgressStyle::with_template("{msg} {wide_bar} {percent} %, {eta} left")
        .unwrap_or_else(|_| ProgressStyle::default_bar());
    ProgressBar::new(SHARE_BAR_LENGTH as u64).with_style(style).with_message(message)
}

/// Bytes for people.
pub(crate) fn bytes(n: u64) -> String {
    match n {
        0..10_000 => format!("{n} B"),
        10_000..10_000_000 => format!("{:.1} KB", n as f64 / 1e3),
        _ => format!("{:.1} MB", n as f64 / 1e6),
    }
}
