//! What dependencies may be: from crates.io, and under licences that anybody may build on.

use std::fmt::Write;

use anyhow::{Context, Result, bail, ensure};
use serde_json::Value;
use spdx::{Expression, ParseMode};

use crate::run::cargo;

/// Licences that any crate may have.
const ALLOWED: &[&str] = &[
    "MIT",
    "Apache-2.0",
    "Apache-2.0 WITH LLVM-exception",
    "BSD-2-Clause",
    "BSD-3-Clause",
    "Zlib",
    "MPL-2.0",
    "ISC",
    "0BSD",
    "CC0-1.0",
    "Unicode-3.0",
    "CDLA-Permissive-2.0",
    "BSL-1.0",
];

/// Further licences, of single crates.
const EXCEPTIONS: &[(&str, &[&str])] = &[
    // Of fonts, not of code: both allow embedding in any program.
    ("epaint_default_fonts", &["OFL-1.1", "Ubuntu-font-1.0"]),
    // libFuzzer's own, of a tool that no release holds.
    ("libfuzzer-sys", &["NCSA"]),
];

const CRATES_IO: &str = "registry+https://github.com/rust-lang/crates.io-index";

/// Checks every crate that any feature of the workspace takes in.
pub(crate) fn check() -> Result<()> {
    let metadata = ["metadata", "--format-version", "1", "--all-features", "--locked"];
    let output = cargo(&metadata).output().context("could not start cargo")?;
    ensure!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let metadata: Value = serde_json::from_slice(&output.stdout)?;
    let packages = metadata["packages"].as_array().context("cargo lists no packages")?;
    let mut faults = String::new();
    for package in packages {
        if let Err(fault) = judge(package) {
            writeln!(faults, "{} {}: {fault}", text(package, "name"), text(package, "version"))?;
        }
    }
    if !faults.is_empty() {
        bail!("crates that may not be used (the rules are in xtask/src/licences.rs):\n{faults}");
    }
    println!(
        "{} crates, all of crates.io or here, under licences that are allowed",
        packages.len()
    );
    Ok(())
}

fn text<'a>(package: &'a Value, member: &str) -> &'a str {
    package[member].as_str().unwrap_or_default()
}

fn judge(package: &Value) -> Result<()> {
    let dependencies = package["dependencies"].as_array().map_or(&[][..], Vec::as_slice);
    match package["source"].as_str() {
        // Ours.
        None => {
            let any = dependencies.iter().find(|d| d["req"] == "*" && d["path"].is_null());
            if let Some(dependency) = any {
                bail!("{} is taken in any version", text(dependency, "name"));
            }
        }
        Some(CRATES_IO) => {}
        Some(other) => bail!("comes from {other}"),
    }
    let licence = text(package, "license");
    let expression = Expression::parse_mode(licence, ParseMode::LAX)
        .with_context(|| format!("{licence:?} is no expression of licences"))?;
    let of_its_own = EXCEPTIONS.iter().find(|(name, _)| *name == text(package, "name"));
    let more = of_its_own.map_or(&[][..], |(_, licences)| licences);
    let is_allowed = expression.evaluate(|wanted| {
        let wanted = wanted.to_string();
        ALLOWED.iter().chain(more).any(|licence| *licence == wanted)
    });
    ensure!(is_allowed, "its licence is {licence}");
    Ok(())
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn of(name: &str, licence: &str) -> Result<()> {
        judge(&json!({ "name": name, "source": CRATES_IO, "license": licence }))
    }

    #[test]
    fn licences_are_weighed_as_expressions() {
        for good in
            ["MIT", "Apache-2.0 / MIT", "MIT OR GPL-3.0-only", "(MIT OR GPL-2.0-only) AND ISC"]
        {
            of("a", good).expect(good);
        }
        for bad in
            ["", "GPL-3.0-only", "MIT AND NCSA", "Apache-2.0 WITH Bison-exception-2.2", "what?"]
        {
            of("a", bad).expect_err(bad);
        }
        of("libfuzzer-sys", "(MIT OR Apache-2.0) AND NCSA").expect("an exception");
    }

    #[test]
    fn crates_come_from_crates_io_in_stated_versions() {
        let git = json!({ "source": "git+https://host/a", "license": "MIT" });
        assert!(judge(&git).expect_err("git").to_string().contains("git+https://host/a"));
        let ours =
            |dependency: Value| judge(&json!({ "license": "MIT", "dependencies": [dependency] }));
        ours(json!({ "name": "b", "req": "*", "path": "/b" })).expect("ours");
        ours(json!({ "name": "b", "req": "^1" })).expect("a version");
        ours(json!({ "name": "b", "req": "*" })).expect_err("any version");
    }
}
