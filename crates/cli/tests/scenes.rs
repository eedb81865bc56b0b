//! `lumencast bench scenes`: every built-in scene's indirect light is as near to the path tracer's as it
//! is known to be.

mod common;

use common::{Folder, run};

/// The indirect part is at least so near after the filter, dB, with few samples and a rough reference.
const LEAST: [(&str, f64); 3] = [("cornell", 28.0), ("door", 26.0), ("tomb", 24.0)];

#[test]
fn built_in_scenes_are_near_their_references() {
    let folder = Folder::new("scenes");
    let document = folder.0.join("results.md");
    let document = document.to_str().expect("text");
    let few = ["--noise", "off", "--probe-samples", "256", "--reference-spp", "64"];
    let few = [&few[..], &["--lumel-samples", "8", "--lightmap", "128"]].concat();
    for (name, least) in LEAST {
        let scene = ["bench", "scenes", name, "--json", "--document", document];
        let ran = run(&[&scene[..], &few].concat());
        assert_eq!(ran.code, Some(0), "{ran:?}");
        let report = ran.json();
        let row = &report["scenes"][0];
        assert!(row["scene"] == name && row["psnr"]["filtered"].as_f64() >= Some(least), "{row}");
        let text = std::fs::read_to_string(document).expect("the document");
        assert!(text.contains(&format!("| {name} |")), "{text}");
    }
}
