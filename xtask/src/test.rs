//! Everything that CI runs, in the order in which mistakes are found soonest.

use anyhow::Result;
use clap::Args;

use crate::run::{cargo, heading, npm, step, target_dir};
use crate::setup::{self, Purpose};
use crate::{assembly, licences, oracles};

/// Options of `cargo xtask test`.
#[derive(Args)]
pub(crate) struct Test {
    /// Leave out the browser test
    #[arg(long)]
    no_browser: bool,
}

impl Test {
    pub(crate) fn run(&self) -> Result<()> {
        let mut left_out = Vec::new();
        setup::install(Purpose::Test)?;
        step("formatting", cargo(&["fmt", "--all", "--check"]))?;
        step("web packages", npm(&["ci", "--no-audit", "--no-fund"]))?;
        step("web: formatting", npm(&["run", "format:check"]))?;
        step("web: types", npm(&["run", "check"]))?;
        step("web: tests", npm(&["test"]))?;
        step("web: page", npm(&["run", "build"]))?;
        let clippy = ["clippy", "--workspace", "--all-targets"];
        let fuzz = ["--features", "lumencast-fuzz/libfuzzer"];
        let mut lints = cargo(&[&clippy[..], &fuzz, &["--", "-D", "warnings"]].concat());
        // Nothing is linked, so that libFuzzer need not be compiled.
        lints.env("CUSTOM_LIBFUZZER_PATH", target_dir().join("libFuzzer.a"));
        step("lints, of fuzz targets too", lints)?;
        let mut tests = cargo(&["nextest", "run", "--workspace"]);
        match oracles::embree() {
            Ok(library) => drop(tests.env("LUMENCAST_EMBREE", library)),
            Err(why) => left_out.push(format!("hits beside Embree's: {why:#}")),
        }
        let scenes = oracles::scenes();
        if !scenes.is_dir() {
            let scenes = scenes.display();
            left_out.push(format!("light beside Mitsuba's in real scenes: {scenes} is not here"));
        }
        step("tests", tests)?;
        heading("assembly of the video library");
        assembly::check()?;
        step("doctests", cargo(&["test", "--workspace", "--doc", "--quiet"]))?;
        let mut documentation = cargo(&["doc", "--workspace", "--no-deps", "--quiet"]);
        documentation.env("RUSTDOCFLAGS", "-D warnings");
        step("documentation", documentation)?;
        heading("licences and sources of dependencies");
        licences::check()?;
        if !self.no_browser {
            // The program that the tests were built with.
            let mut browser = npm(&["run", "test:browser"]);
            browser.env("LUMENCAST_BIN", target_dir().join("debug/lumencast"));
            // Others than root may be forbidden to make the slow link; then its test is left out.
            if cfg!(target_os = "linux") && setup::is_root() {
                browser.env("LUMENCAST_LINK", "required");
            }
            step("the page in a real browser", browser)?;
        } else {
            left_out.push("the page in a real browser: --no-browser".to_owned());
        }
        println!("\nAll steps passed.");
        for what in left_out {
            println!("Left out: {what}");
        }
        Ok(())
    }
}
