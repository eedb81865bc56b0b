//! A section of a document of markdown: a command writes what it measures in place of what its last run
//! wrote.

use std::fs;
use std::io::ErrorKind;
use std::path::Path;

use anyhow::{Context, Result, bail, ensure};

use crate::out_file;

/// A section, told by its title.
pub(super) struct Section {
    pub(super) title: String,
    /// The command of `bench` that writes it.
    pub(super) command: &'static str,
}

impl Section {
    /// Finds out whether it can be written, before what takes hours is measured for it.
    pub(super) fn check(&self, document: &Path) -> Result<()> {
        out_file::check(document)?;
        self.within(&read(document)?, "").map(drop)
    }

    /// Writes it in place of its older self or, where there is none, at the end. All else in the
    /// document stays as it is.
    pub(super) fn replace(&self, document: &Path, text: &str) -> Result<()> {
        out_file::write(document, self.within(&read(document)?, text)?.as_bytes())
    }

    /// The document with another text in this section.
    fn within(&self, document: &str, text: &str) -> Result<String> {
        let Self { title, command } = self;
        let begin = format!("<!-- {title}, by lumencast bench {command} -->\n");
        let end = format!("<!-- end of {title} -->\n");
        let whole = format!("{begin}{text}{end}");
        match (document.find(&begin), document.find(&end)) {
            (None, None) if document.is_empty() => Ok(whole),
            (None, None) => Ok(format!("{}\n\n{whole}", document.trim_end_matches('\n'))),
            (Some(from), Some(to)) => {
                ensure!(from < to, "in the document, section {title:?} ends before it begins");
                Ok(format!("{}{whole}{}", &document[..from], &document[to + end.len()..]))
            }
            _ => bail!("in the document, only one end of section {title:?} is marked"),
        }
    }
}

/// The document, empty where there is none.
fn read(document: &Path) -> Result<String> {
    match fs::read_to_string(document) {
        Err(e) if e.kind() == ErrorKind::NotFound => Ok(String::new()),
        read => read.with_context(|| format!("cannot read {}", document.display())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn with_section(document: &str, name: &str, text: &str) -> Result<String> {
        Section { title: name.to_owned(), command: "test" }.within(document, text)
    }

    #[test]
    fn a_section_replaces_its_older_self_and_nothing_else() {
        let first = with_section("", "one", "a\n").expect("an empty document");
        let both = with_section(&first, "two", "b\n").expect("a document");
        let whole = format!("# Title\n\n{both}\nThe end.\n");
        let again = with_section(&whole, "one", "c\nd\n").expect("a document");
        assert_eq!(again, whole.replace("a\n<!--", "c\nd\n<!--"));
        assert_eq!(with_section(&again, "one", "a\n").expect("a document"), whole);
    }

    #[test]
    fn a_document_that_somebody_broke_is_left_alone() {
        let whole = with_section("", "one", "a\n").expect("an empty document");
        let (begin, end) = whole.split_once("a\n").expect("both ends");
        for broken in [begin, end, &format!("{end}{begin}")] {
            assert!(with_section(broken, "one", "b\n").is_err(), "{broken}");
        }
    }
}
