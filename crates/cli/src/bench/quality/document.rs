//! A section of a document of results. A run replaces what the last one put there; one picture of
//! pictures and the plots lie beside the document.

use std::path::{Path, PathBuf};

use anyhow::{Error, Result};
use lumencast_picture::ToneMap;

use super::report::{Report, Row};
use super::results::plots;
use super::sheet;
use crate::bench::section::Section;
use crate::out_file;

/// The folder of pictures beside the document.
const FOLDER: &str = "pictures";

/// Finds out whether a section can be written, before what takes hours is measured for it.
pub(super) fn check(name: &str, document: &Path) -> Result<()> {
    parse_name(name).map_err(Error::msg)?;
    section(name).check(document)?;
    out_file::check_folder(&pictures_beside(document))
}

/// Puts a report into a document, in place of the section of that name or, where there is none, at the
/// end. All else in the document stays as it is.
pub(super) fn write(report: &Report, name: &str, document: &Path) -> Result<()> {
    let text = format!("{}\n{}", report.text(), show(report, name, document)?);
    section(name).replace(document, &text)
}

fn section(name: &str) -> Section {
    Section { title: format!("quality of {name}"), command: "quality" }
}

/// A section's name. Its files are called by it too.
pub(super) fn parse_name(text: &str) -> Result<String, String> {
    let is_plain = |c: char| c.is_alphanumeric() || " _.-".contains(c);
    if text.trim().is_empty() || text.contains("--") || !text.chars().all(is_plain) {
        return Err(format!("{text:?} is no name for a section: give letters, digits and spaces"));
    }
    Ok(text.to_owned())
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

#[cfg(test)]
mod tests {
    use super::*;

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
