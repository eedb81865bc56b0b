//! Documents are short, and what they point to is there.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::{fs, io};

use crate::run::root;

/// The most bytes that documents have, by the beginning of their path; the first that fits counts.
const SIZES: &[(&str, u64)] = &[
    ("README.md", 6 << 10),
    ("CONTRIBUTING.md", 4 << 10),
    ("docs/ARCHITECTURE.md", 8 << 10),
    ("docs/math.md", 10 << 10),
    ("docs/drawing.md", 8 << 10),
    ("docs/results/README.md", 3 << 10),
    ("docs/results/", 6 << 10),
    ("docs/guides/", 6 << 10),
];
/// The most words of a decision.
const DECISION: usize = 250;

/// All documents: paths relative to the root, with forward slashes.
fn documents() -> io::Result<Vec<String>> {
    let mut found = Vec::new();
    let mut open = vec![root()];
    while let Some(folder) = open.pop() {
        for entry in fs::read_dir(&folder)? {
            let path = entry?.path();
            let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            if path.is_dir() {
                let is_ours =
                    !name.starts_with('.') && !["target", "node_modules"].contains(&&*name);
                open.extend(is_ours.then_some(path));
            } else if name.ends_with(".md") {
                let relative = path.strip_prefix(root()).expect("below the root");
                found.push(relative.to_string_lossy().replace('\\', "/"));
            }
        }
    }
    Ok(found)
}

/// A document without its blocks of code.
fn prose(text: &str) -> String {
    text.split("```").step_by(2).collect()
}

/// The anchors of a document's headings, as GitHub makes them.
fn anchors(text: &str) -> BTreeSet<String> {
    let anchor = |heading: &str| -> String {
        let kept = |c: &char| c.is_alphanumeric() || ['-', '_', ' '].contains(c);
        let text = heading.trim_start_matches('#').trim().to_lowercase();
        text.chars().filter(kept).map(|c| if c == ' ' { '-' } else { c }).collect()
    };
    prose(text).lines().filter(|line| line.starts_with('#')).map(anchor).collect()
}

/// Links of a document that lead nowhere.
fn broken_links(document: &Path, text: &str) -> Vec<String> {
    let targets = prose(text).split("](").skip(1).map(str::to_owned).collect::<Vec<_>>();
    let links = targets.iter().filter_map(|target| target.split([')', ' ']).next());
    let leads_nowhere = |link: &&str| {
        if link.contains("://") {
            return false;
        }
        let (file, anchor) = link.split_once('#').unwrap_or((link, ""));
        let folder = document.parent().expect("a document lies in a folder");
        let target = if file.is_empty() { document.to_owned() } else { folder.join(file) };
        let is_there = target.exists();
        let is_document = target.extension().is_some_and(|extension| extension == "md");
        let has_anchor = || {
            let text = fs::read_to_string(&target).unwrap_or_default();
            anchors(&text).contains(anchor)
        };
        !is_there || is_document && !anchor.is_empty() && !has_anchor()
    };
    links.filter(leads_nowhere).map(str::to_owned).collect()
}

#[test]
fn documents_are_short_and_their_links_lead_somewhere() {
    let mut faults = Vec::new();
    for name in documents().expect("documents") {
        let path: PathBuf = root().join(&name);
        let text = fs::read_to_string(&path).expect("text");
        let limit = SIZES.iter().find(|(start, _)| name.starts_with(start));
        if let Some((_, most)) = limit.filter(|(_, most)| text.len() as u64 > *most) {
            faults.push(format!("{name} has {} bytes, at most {most} are meant", text.len()));
        }
        let words = text.split_whitespace().count();
        let is_decision = name.starts_with("docs/decisions/0");
        if is_decision && words > DECISION {
            faults.push(format!("{name} has {words} words, at most {DECISION} are meant"));
        }
        faults.extend(broken_links(&path, &text).iter().map(|link| format!("{name}: {link}")));
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn faults_are_found() {
    let folder = root().join("docs");
    let text = "# A b, c\n[a](wire.md#files) [b](wire.md#nothing) [c](gone.md)\n\
                [d](#a-b-c) [e](#a) [f](https://a.b/c)\n```\n[g](gone)\n```\n";
    let document = std::env::temp_dir().join(format!("lumencast-{}.md", std::process::id()));
    fs::write(&document, text).expect("written");
    assert_eq!(anchors(text), BTreeSet::from(["a-b-c".to_owned()]));
    assert_eq!(broken_links(&document, text).len(), 4, "nothing of docs is beside it");
    fs::remove_file(&document).expect("removed");
    assert_eq!(
        broken_links(&folder.join("x.md"), "[a](wire.md#files) [b](wire.md#nothing)").len(),
        1
    );
}
