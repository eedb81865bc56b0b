//! Text that may go to a terminal.
//!
//! Names in files and from servers are chosen by others. Control characters in them could move the cursor,
//! change what was printed or retitle the window, and marks of writing direction could show a text in
//! another order. All that commands print, messages and logs included, goes through here.

use std::borrow::Cow;
use std::fmt::Write as _;

/// Whether a terminal would obey it instead of showing it.
fn steers(c: char) -> bool {
    // C0, DEL and C1; separators of lines; marks, embeddings, overrides and isolates of direction.
    c.is_control()
        || matches!(c, '\u{61c}' | '\u{200e}' | '\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{206f}')
}

/// Text with what would steer a terminal as escapes, on one line.
pub(crate) fn printable(text: &str) -> Cow<'_, str> {
    escaped(text, |c, out| out.extend(c.escape_debug()))
}

/// JSON as it was, with all that would steer a terminal, which is in its strings, as escapes of JSON.
pub(crate) fn printable_json(json: &str) -> Cow<'_, str> {
    escaped(json, |c, out| match c {
        // Between values.
        '\n' => out.push('\n'),
        c => {
            let _ = write!(out, "\\u{:04x}", u32::from(c));
        }
    })
}

fn escaped(text: &str, escape: impl Fn(char, &mut String)) -> Cow<'_, str> {
    if !text.contains(steers) {
        return text.into();
    }
    let mut out = String::with_capacity(text.len() + 16);
    for c in text.chars() {
        match steers(c) {
            true => escape(c, &mut out),
            false => out.push(c),
        }
    }
    out.into()
}

/// An error with its causes, each said once: one that was said as part of another adds nothing. Lines after
/// the first are indented, so that none of them looks like a message of its own.
pub(crate) fn printable_error(error: &anyhow::Error) -> String {
    let mut said: Vec<String> = Vec::new();
    for cause in error.chain().map(|cause| cause.to_string()) {
        if said.iter().any(|before| before.contains(&cause)) {
            continue;
        }
        said.pop_if(|before| cause.contains(before.as_str()));
        said.push(cause);
    }
    let said = said.join(": ");
    let lines: Vec<_> = said.trim_end().lines().map(printable).collect();
    lines.join("\n    ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use anyhow::anyhow;

    #[test]
    fn what_would_steer_a_terminal_is_escaped() {
        assert_eq!(printable("Wohnzimmer – 居間 🛋"), "Wohnzimmer – 居間 🛋");
        for (name, shown) in [
            ("\u{1b}]0;title\u{7}", r"\u{1b}]0;title\u{7}"),
            ("\u{9b}31mred", r"\u{9b}31mred"),
            ("a\rb\nc\td\0", r"a\rb\nc\td\0"),
            ("\u{7f}\u{202e}gnp.exe\u{2066}", r"\u{7f}\u{202e}gnp.exe\u{2066}"),
        ] {
            assert_eq!(printable(name), shown);
        }
    }

    #[test]
    fn json_says_the_same_without_steering() {
        let value =
            serde_json::json!({ "na\u{9b}me": "\u{1b}[2J\u{7f}\u{85}\u{202e}\n", "n": [1, 2] });
        let pretty = serde_json::to_string_pretty(&value).expect("plain values");
        let json = printable_json(&pretty);
        assert!(!json.chars().any(|c| steers(c) && c != '\n'), "{json:?}");
        let read: serde_json::Value = serde_json::from_str(&json).expect("JSON");
        assert_eq!(read, value);
    }

    #[test]
    fn causes_are_said_once() {
        let nothing = || std::io::Error::from_raw_os_error(2);
        let told = anyhow!("cannot read a.png: {}", nothing());
        assert_eq!(printable_error(&told), told.to_string());
        let doubled = anyhow::Error::from(nothing()).context(told.to_string()).context("--light");
        assert_eq!(printable_error(&doubled), format!("--light: {told}"));
        let lines = anyhow!("TOML\nat \u{1b}[line\n").context("a.toml");
        assert_eq!(printable_error(&lines), "a.toml: TOML\n    at \\u{1b}[line");
    }
}
