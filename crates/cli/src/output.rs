//! What goes to the terminal.

use std::borrow::Cow;
use std::fmt;
use std::io::{self, ErrorKind, Write};
use std::time::Duration;

use anyhow::Result;
use indicatif::{ProgressBar, ProgressStyle};

use crate::printable::{printable, printable_error, printable_json};

/// Prints a line to standard output: what a command was asked for.
macro_rules! say {
    ($($words:tt)*) => { $crate::output::line(format_args!($($words)*)) };
}
pub(crate) use say;

/// Tells people a line on standard error: warnings, and what goes on.
macro_rules! tell {
    ($($words:tt)*) => { $crate::output::note(format_args!($($words)*)) };
}
pub(crate) use tell;

/// Exit code of a program that SIGPIPE ended.
const BROKEN_PIPE: i32 = 141;

/// Prints a line, printable.
pub(crate) fn line(words: fmt::Arguments<'_>) {
    print(&format!("{}\n", printable(&words.to_string())));
}

/// Prints lines, each printable.
pub(crate) fn lines(text: &str) {
    text.lines().for_each(|words| say!("{words}"));
}

/// Prints JSON, and nothing but it.
pub(crate) fn json(value: &serde_json::Value) -> Result<()> {
    print(&format!("{}\n", printable_json(&serde_json::to_string_pretty(value)?)));
    Ok(())
}

/// Prints JSON on one line.
pub(crate) fn json_line(value: &serde_json::Value) {
    print(&format!("{}\n", printable_json(&value.to_string())));
}

/// Writes to standard output. Where that fails the program ends, as nothing more can be printed: where
/// nobody reads on, `lumencast inspect FILE | head` for instance, quietly and with the code of SIGPIPE, as
/// Unix's own programs do.
pub(crate) fn print(text: &str) {
    let mut out = io::stdout().lock();
    end_unless_printed(out.write_all(text.as_bytes()).and_then(|()| out.flush()));
}

/// Ends the program where something could not be printed.
pub(crate) fn end_unless_printed(printed: io::Result<()>) {
    match printed {
        Ok(()) => {}
        Err(error) if error.kind() == ErrorKind::BrokenPipe => std::process::exit(BROKEN_PIPE),
        Err(error) => {
            tell!("error: cannot write to standard output: {error}");
            std::process::exit(1);
        }
    }
}

/// Tells why a command failed.
pub(crate) fn error(error: &anyhow::Error) {
    to_stderr(&format!("error: {}\n", printable_error(error)));
}

/// Tells a line, printable.
pub(crate) fn note(words: fmt::Arguments<'_>) {
    to_stderr(&format!("{}\n", printable(&words.to_string())));
}

/// Where standard error fails there is nobody to tell.
fn to_stderr(text: &str) {
    let _ = io::stderr().lock().write_all(text.as_bytes());
}

/// A line that turns while something of unknown length goes on; on standard error, and only if
/// that is a terminal.
pub(crate) fn spinner(message: String) -> ProgressBar {
    let bar = ProgressBar::new_spinner().with_message(printable(&message).into_owned());
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
