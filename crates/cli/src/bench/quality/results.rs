//! `quality.md`: the tables of a report with its pictures and plots beside it.

use std::path::Path;

use anyhow::Result;
use lumencast_picture::{Picture, ToneMap};

use super::field::UPDATE;
use super::plot::{Plot, Series};
use super::report::{AtResolution, Report, Row};
use crate::out_file;

/// Writes quality.md and what it shows into a folder.
pub(super) fn write(report: &Report, folder: &Path) -> Result<()> {
    let mut text = format!("# {}: how near a client's pictures come\n\n", report.scene);
    text += &report.text();
    text += &format!(
        "\nLight: an update of {UPDATE} samples a probe, or a path a pixel. Picture: drawing it, or \
         denoising it; BMFR's pictures end at white.\n\n## Pictures\n\nAs they are judged: codes \
         v^(1/2.2), clamped. Below each its FLIP difference from the reference, black where there is \
         none.\n\n"
    );
    write_pictures(report, folder)?;
    text += &gallery(report);
    if !report.resolutions.is_empty() {
        let [time, quality] = plots(&report.resolutions);
        out_file::write(&folder.join("frame-time.svg"), time.svg().as_bytes())?;
        out_file::write(&folder.join("psnr.svg"), quality.svg().as_bytes())?;
        text += "\n## By resolution\n\n![Frame time](frame-time.svg)\n![PSNR](psnr.svg)\n";
    }
    out_file::write(&folder.join("quality.md"), text.as_bytes())
}

fn write_pictures(report: &Report, folder: &Path) -> Result<()> {
    let exposure = report.table.exposure;
    let write = |name: &str, picture: &Picture| {
        picture.write_png(folder.join(name), ToneMap::Gamma, exposure)
    };
    write("reference.png", &report.table.picture)?;
    for row in report.table.fields.iter().chain(&report.table.baseline) {
        write(&picture_of(row), &row.picture)?;
        let path = folder.join(difference_of(row));
        row.difference.in_magma().write_png(path, ToneMap::Srgb, 1.0)?;
    }
    Ok(())
}

/// The reference, and every row with its difference.
fn gallery(report: &Report) -> String {
    let mut text = String::from("### Reference\n\n![reference](reference.png)\n");
    for row in report.table.fields.iter().chain(&report.table.baseline) {
        let (name, psnr) = (&row.name, row.whole.psnr);
        let (picture, difference) = (picture_of(row), difference_of(row));
        text += &format!(
            "\n### {name}, {psnr:.2} dB\n\n![{name}]({picture})\n![its difference]({difference})\n"
        );
    }
    text
}

/// Figures 5.7 and 5.8 of the second paper.
pub(super) fn plots(rows: &[AtResolution]) -> [Plot; 2] {
    let of_field = |value: fn(&Row) -> f64| {
        rows.iter().map(|r| (f64::from(r.side), value(&r.field))).collect()
    };
    let of_baseline = |value: fn(&Row) -> f64| {
        let point = |r: &AtResolution| Some((f64::from(r.side), value(r.baseline.as_ref()?)));
        rows.iter().filter_map(point).collect()
    };
    let name = &rows[0].field.name;
    let series = |name: &str, points| Series { name: name.to_owned(), points };
    let milliseconds = |row: &Row| 1e3 * row.frame_seconds();
    let time = Plot {
        title: "Frame time".into(),
        x: "side of a square picture, pixels".into(),
        y: "ms".into(),
        from_zero: true,
        series: vec![
            series(&format!("{name}: update and drawing"), of_field(milliseconds)),
            series("1 spp, BMFR", of_baseline(milliseconds)),
            series(&format!("{name}: update alone"), of_field(|row| 1e3 * row.light_seconds)),
        ],
    };
    let quality = Plot {
        title: "Nearness to the reference".into(),
        y: "PSNR, dB".into(),
        from_zero: false,
        series: vec![
            series(name, of_field(|row| row.whole.psnr)),
            series("1 spp, BMFR", of_baseline(|row| row.whole.psnr)),
        ],
        ..time.clone()
    };
    [time, quality]
}

fn picture_of(row: &Row) -> String {
    format!("{}.png", file_name(row))
}

fn difference_of(row: &Row) -> String {
    format!("{}-difference.png", file_name(row))
}

fn file_name(row: &Row) -> String {
    row.name.replace(',', "").replace(' ', "-")
}
