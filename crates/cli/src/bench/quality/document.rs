//! A section of a document of results: what was measured, in place of what had been measured before,
//! with one picture of pictures and the plots beside it.

use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use anyhow::{Context, Error, Result, bail, ensure};
use lumencast_picture::ToneMap;

use super::report::{Report, Row};
use super::results::plots;
use super::sheet;
use crate::out_file;

/// Beside the document.
const FOLDER: &str = "pictures";

/// Finds out whether a section can be written, before what takes hours is measured for it.
pub(super) fn check(name: &str, document: &Path) -> Result<()> {
    parse_name(name).map_err(Error::msg)?;
    out_file::check(document)?;
    out_file::check_folder(&pictures_beside(document))?;
    with_section(&read(document)?, name, "").map(drop)
}

/// Puts a report into a document, in place of the section of that name or, where there is none, at the
/// end. All else in the document stays as it is.
pub(super) fn write(report: &Report, name: &str, document: &Path) -> Result<()> {
    let section = format!("{}\n{}", report.text(), show(report, name, document)?);
    out_file::write(document, with_section(&read(document)?, name, &section)?.as_bytes())
}

/// A section's name, of which files are named too.
pub(super) fn parse_name(text: &str) -> Result<String, String> {
    let is_plain = |c: char| c.is_alphanumeric() || " _.-".contains(c);
    if text.trim().is_empty() || text.contains("--") || !text.chars().all(is_plain) {
        return Err(format!("{text:?} is no name for a section: give letters, digits and spaces"));
    }
    Ok(text.to_owned())
}

/// The document, empty where there is none.
fn read(document: &Path) -> Result<String> {
    match fs::read_to_string(document) {
        Err(e) if e.kind() == ErrorKind::NotFound => Ok(String::new()),
        read => read.with_context(|| format!("cannot read {}", document.display())),
    }
}

fn pictures_beside(document: &Path) -> PathBuf {
    document.parent().unwrap_or(Path::new("")).join(FOLDER)
}

/// Writes what the section shows, and what shows it.
fn show(report: &Report, name: &str, document: &Path) -> Result<String> {
    let folder = pictures_beside(document);
    let stem = format!("quality-{}", name.to_lowercase().replace(' ', "-"));

    let table = &report.table;
    // The first grid's first order as gathered and fitted, and the baseline.
    let rows: Vec<&Row> = table.fields.iter().take(2).chain(table.baseline.last()).collect();
    let pictures = format!("{stem}.jpg");
    sheet::of(&table.picture, &rows, table.exposure).write_jpeg(
        folder.join(&pictures),
        ToneMap::Srgb,
        1.0,
    )?;
    let names: Vec<_> = rows.iter().map(|row| row.name.as_str()).collect();
    let mut text = format!(
        "![{name}: the reference; {}; below each its FLIP difference]({FOLDER}/{pictures})\n",
        names.join("; ")
    );
    if !report.resolutions.is_empty() {
        let of = ["frame-time", "psnr"].map(|what| format!("{stem}-{what}.svg"));
        for (plot, file) in plots(&report.resolutions).iter().zip(&of) {
            out_file::write(&folder.join(file), plot.svg().as_bytes())?;
            text += &format!("![{name}: {} by resolution]({FOLDER}/{file})\n", plot.title);
        }
    }
    Ok(text)
}

/// The document with another section of that name.
fn with_section(document: &str, name: &str, section: &str) -> Result<String> {
    let begin = format!("<!-- quality of {name}, by lumencast bench quality -->\n");
    let end = format!("<!-- end of quality of {name} -->\n");
    let whole = format!("{begin}{section}{end}");
    match (document.find(&begin), document.find(&end)) {
        (None, None) if document.is_empty() => Ok(whole),
        (None, None) => Ok(format!("{}\n\n{whole}", document.trim_end_matches('\n'))),
        (Some(from), Some(to)) => {
            ensure!(from < to, "in the document, section {name:?} ends before it begins");
            Ok(format!("{}{whole}{}", &document[..from], &document[to + end.len()..]))
        }
        _ => bail!("in the document, only one end of section {name:?} is marked"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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

    #[test]
    fn names_are_plain() {
        for right in ["Breakfast room", "sponza-2.1_b"] {
            assert_eq!(parse_name(right).as_deref(), Ok(right));
        }
        for wrong in ["", " ", "a-->b", "a--", "a\nb", "../a"] {
            assert!(parse_name(wrong).is_err(), "{wrong}");
        }
    }
}
