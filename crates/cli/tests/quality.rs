//! `lumencast bench quality`: what it measures, and what it writes.

mod common;

use std::path::Path;

use common::{Folder, Ran, run};
use lumencast_picture::{Loaded, compare};
use serde_json::Value;

fn bench(arguments: &[&str]) -> Ran {
    bench_with("64", arguments)
}

fn bench_with(reference_spp: &str, arguments: &[&str]) -> Ran {
    let mut all = vec!["bench", "quality", "cornell", "--size", "72x48", "--volume", "4x4x4"];
    all.extend(["--reference-spp", reference_spp, "--probe-samples", "256", "--samples", "4"]);
    all.extend(arguments);
    let ran = run(&all);
    assert_eq!(ran.code, Some(0), "{ran:?}");
    ran
}

fn number(report: &Value, pointer: &str) -> f64 {
    let found = report.pointer(pointer).and_then(Value::as_f64);
    found.unwrap_or_else(|| panic!("{pointer}: {report}"))
}

#[test]
fn fields_and_the_baseline_are_judged() {
    let folder = Folder::new("quality");
    let [kept, out, document] = ["kept", "out", "results.md"].map(|name| folder.0.join(name));
    let [kept, out, document] = [&kept, &out, &document].map(|path| path.to_str().expect("text"));
    std::fs::write(document, "# Results\n\nBy hand.\n").expect("a document");
    let mut arguments = vec!["--orders", "1,2", "--keep", kept, "--json"];
    let report = bench(
        &[
            &arguments[..],
            &["--baseline-frames", "24", "--resolutions", "16,48", "-o", out],
            &["--document", document],
        ]
        .concat(),
    )
    .json();

    // Two orders, as gathered and fitted, and with a bounce more.
    let fields = report["fields"].as_array().expect("rows");
    let names: Vec<_> = fields.iter().map(|row| row["name"].as_str().expect("a name")).collect();
    let expected = [
        "4x4x4 L1 3 bounces",
        "4x4x4 L1 3 bounces, fitted",
        "4x4x4 L2 3 bounces",
        "4x4x4 L2 3 bounces, fitted",
        "4x4x4 L1 4 bounces",
        "4x4x4 L2 4 bounces",
    ];
    assert_eq!(names, expected);
    let psnr = |row| number(&report, &format!("/fields/{row}/whole/psnr"));
    for row in 0..6 {
        assert!((20.0..40.0).contains(&psnr(row)), "{report}");
    }
    assert!(psnr(3) > psnr(2) + 0.3, "a fit is nearer: {report}");
    let [raw, denoised] = [0, 1].map(|n| number(&report, &format!("/baseline/{n}/whole/psnr")));
    assert!((5.0..22.0).contains(&raw), "{report}");
    assert!(denoised > raw + 5.0, "{report}");
    let ssim = |n| number(&report, &format!("/baseline/{n}/whole/ssim"));
    assert!(ssim(1) > ssim(0) + 0.2, "{report}");
    for (n, side) in [16, 48].into_iter().enumerate() {
        let at = &report["resolutions"][n];
        assert_eq!(at["side"], side);
        assert_eq!(at["field"]["name"], "4x4x4 L1 3 bounces");
        assert_eq!(at["field"]["light_seconds"], fields[0]["light_seconds"], "one update for all");
        assert!(
            number(at, "/field/whole/psnr") > 18.0 && number(at, "/baseline/whole/psnr") > 10.0
        );
    }
    let traced = |n| number(&report, &format!("/resolutions/{n}/baseline/light_seconds"));
    assert!(traced(1) > traced(0), "nine times the paths: {report}");
    what_was_written_is_what_was_measured(&report, Path::new(out));
    a_document_has_it_too(&report, Path::new(document));

    // The reference is kept, and grows no further where that is enough.
    arguments.extend(["--baseline-frames", "0"]);
    let film = |name: &str| {
        let mut files = std::fs::read_dir(kept).expect("a folder").map(|e| e.expect("one").path());
        let of = |path: &std::path::PathBuf| {
            path.to_str().is_some_and(|path| path.ends_with(name) && path.contains("-72x48-"))
        };
        std::fs::read(files.find(of).expect("a film")).expect("bytes")
    };
    let before = film(".indirect.film");
    let again = bench(&arguments).json();
    assert!(before == film(".indirect.film"));
    for told in ["samples", "noise_psnr"] {
        assert_eq!(again["reference"][told], report["reference"][told], "{told}");
    }
    assert!(number(&report, "/reference/sample_seconds") > 0.0);
    assert_eq!(again["reference"]["sample_seconds"], Value::Null, "nothing was traced");
    assert_eq!(again["fields"][1]["whole"], report["fields"][1]["whole"]);
    assert_eq!(again["baseline"], Value::Array(Vec::new()));

    // Where it is not, it goes on.
    let more = bench_with("256", &arguments).json();
    assert!(before != film(".indirect.film"));
    assert_eq!(more["reference"]["samples"], 256);
    let noise = |report| number(report, "/reference/noise_psnr");
    let gain = noise(&more) - noise(&report);
    assert!((4.0..9.0).contains(&gain), "four times the samples are 6 dB, {gain}");
}

/// What a text of markdown links to.
fn shown_in(text: &str) -> Vec<&str> {
    text.split("](").skip(1).filter_map(|s| s.split(')').next()).collect()
}

/// Every picture that quality.md shows is there, and as far from the reference as the table says.
fn what_was_written_is_what_was_measured(report: &Value, folder: &Path) {
    let text = std::fs::read_to_string(folder.join("quality.md")).expect("the tables");
    let shown = shown_in(&text);
    assert_eq!(shown.len(), 1 + 2 * 8 + 2, "{text}");
    for name in &shown {
        assert!(folder.join(name).is_file(), "{name}");
    }
    let picture = |name: &str| Loaded::read(folder.join(name)).expect("a picture");
    let reference = picture("reference.png");
    let rows = ["/fields/2", "/baseline/0", "/baseline/1"]
        .map(|row| &report.pointer(row).expect("it")["whole"]);
    let files = ["4x4x4-L2-3-bounces.png", "1-spp.png", "1-spp-BMFR.png"];
    let psnr =
        files.map(|name| compare(&reference, &picture(name), None, 67.0).expect("sizes").psnr);
    for (psnr, row) in psnr.iter().zip(rows) {
        let told = row["psnr"].as_f64().expect("a number");
        assert!((psnr - told).abs() < 0.1, "{psnr} of 8 bits, {told} told");
        assert!(text.contains(&format!("| {told:.2} |")), "{told} is missing: {text}");
    }
    assert!((psnr[1] - psnr[2]).abs() > 1.0, "the check has no teeth");
    for (name, words) in [("frame-time.svg", ["ms", ">48<"]), ("psnr.svg", ["PSNR, dB", ">48<"])] {
        let svg = std::fs::read_to_string(folder.join(name)).expect("a plot");
        assert!(words.iter().all(|word| svg.contains(word)), "{svg}");
        assert!(svg.contains("1 spp, BMFR") && svg.contains("4x4x4 L1 3 bounces"), "{svg}");
    }
}

/// The tables stand below what stood there, and all that they show is there.
fn a_document_has_it_too(report: &Value, document: &Path) {
    let text = std::fs::read_to_string(document).expect("the document");
    assert!(text.starts_with("# Results\n\nBy hand.\n\n<!-- quality of cornell"), "{text}");
    for row in report["fields"].as_array().expect("rows") {
        let psnr = row["whole"]["psnr"].as_f64().expect("a number");
        assert!(text.contains(&format!("| {psnr:.2} |")), "{text}");
    }
    let shown = shown_in(&text);
    let folder = document.parent().expect("a folder");
    assert_eq!(shown.len(), 3, "{text}");
    assert!(shown.iter().all(|name| folder.join(name).is_file()), "{shown:?}");
    let sheet = std::fs::read(folder.join(shown[0])).expect("a picture");
    assert!(sheet.starts_with(&[0xff, 0xd8, 0xff]), "a JPEG");
}

#[test]
fn tables_are_for_people_too() {
    let ran = bench(&["--orders", "2", "--baseline-frames", "2", "--fit", "0"]);
    assert!(!ran.stdout.contains("fitted"), "{ran:?}");
    for words in ["| 4x4x4 L2 3 bounces |", "| 1 spp |", "| 1 spp, BMFR |", "direct light alone:"] {
        assert!(ran.stdout.contains(words), "{words:?} is missing: {ran:?}");
    }
    for wrong in [&["--resolutions", "0"][..], &["--document", "a.md", "--section", "a-->b"]] {
        let ran = run(&[&["bench", "quality", "cornell"], wrong].concat());
        assert_eq!(ran.code, Some(2), "{ran:?}");
    }
}
