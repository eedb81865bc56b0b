//! What the workspace needs of the machine. As root on Debian it is installed; otherwise the exact
//! commands are printed.

use std::collections::BTreeSet;
use std::fs;

use anyhow::{Context, Result, bail};

use crate::run::{cargo, command, output, step};

/// What the machine is set up for.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Purpose {
    /// Building and running the server and its page.
    Demo,
    /// All tests.
    Test,
}

/// A Debian package, how to see that it is not needed, and why it is wanted.
struct Package {
    name: &'static str,
    release: Release,
    purpose: Purpose,
    why: &'static str,
    present: fn() -> bool,
}

#[derive(PartialEq, Eq)]
enum Release {
    Stable,
    Backports,
}

const PACKAGES: &[Package] = &[
    Package {
        name: "build-essential",
        release: Release::Stable,
        purpose: Purpose::Demo,
        why: "a C compiler for the cryptography of QUIC",
        present: || runs("cc", "--version"),
    },
    Package {
        name: "cmake",
        release: Release::Stable,
        purpose: Purpose::Demo,
        why: "builds the cryptography of QUIC",
        present: || runs("cmake", "--version"),
    },
    Package {
        name: "nasm",
        release: Release::Stable,
        purpose: Purpose::Demo,
        why: "assembler of cryptography and of video; without it they are slower, silently",
        present: || runs("nasm", "--version"),
    },
    Package {
        name: "chromium",
        release: Release::Stable,
        purpose: Purpose::Test,
        why: "the browser of the browser test",
        present: || runs("chromium", "--version"),
    },
    Package {
        name: "openssl",
        release: Release::Stable,
        purpose: Purpose::Test,
        why: "makes the certificate of the browser test",
        present: || runs("openssl", "version"),
    },
    Package {
        name: "mesa-vulkan-drivers",
        release: Release::Backports,
        purpose: Purpose::Test,
        why: "a GPU in software (lavapipe 25 or newer)",
        present: || installed_version("mesa-vulkan-drivers").is_some_and(|major| major >= 25),
    },
];

/// Programs of cargo that the tests call.
const CARGO_TOOLS: &[(&str, &str)] =
    &[("cargo-nextest", "runs the tests"), ("cargo-deny", "checks licences and duplicates")];

/// Installs what is missing, or says how.
pub(crate) fn install(purpose: Purpose) -> Result<()> {
    check_node()?;
    install_packages(purpose)?;
    if purpose == Purpose::Test {
        for (tool, why) in CARGO_TOOLS {
            if !runs(tool, "--version") {
                step(&format!("install {tool} ({why})"), cargo(&["install", "--locked", tool]))?;
            }
        }
    }
    Ok(())
}

fn check_node() -> Result<()> {
    const MINIMUM: u32 = 20;
    let version = output("node", &["--version"]).unwrap_or_default();
    let major = version.trim().trim_start_matches('v').split('.').next().map(str::parse::<u32>);
    match major {
        Some(Ok(major)) if major >= MINIMUM && runs("npm", "--version") => Ok(()),
        Some(Ok(major)) => bail!("Node {major} is too old: the web page needs {MINIMUM} or newer"),
        _ => bail!("Node {MINIMUM} or newer with npm is missing; install it from nodejs.org"),
    }
}

fn install_packages(purpose: Purpose) -> Result<()> {
    let wanted: Vec<_> =
        PACKAGES.iter().filter(|p| p.purpose <= purpose && !(p.present)()).collect();
    if wanted.is_empty() {
        return Ok(());
    }
    let names = |release: Release| -> Vec<&str> {
        wanted.iter().filter(|p| p.release == release).map(|p| p.name).collect()
    };
    let (stable, backports) = (names(Release::Stable), names(Release::Backports));
    for package in &wanted {
        println!("missing: {} ({})", package.name, package.why);
    }
    if !runs("apt-get", "--version") {
        bail!("this set-up knows Debian 12 only; install the packages named above by other means");
    }
    if output("id", &["-u"]).is_none_or(|id| id.trim() != "0") {
        println!("\nRun this as root, then start again:\n");
        if !backports.is_empty() && backports_source()?.is_some() {
            println!("  cargo xtask setup    # as root: adds bookworm-backports too, or by hand:");
            println!("  add the suite bookworm-backports to your Debian sources");
        }
        println!("  apt-get update");
        for (release, names) in [("", &stable), ("-t bookworm-backports ", &backports)] {
            if !names.is_empty() {
                println!("  apt-get install -y {release}{}", names.join(" "));
            }
        }
        bail!("packages are missing, and only root may install them");
    }
    if !backports.is_empty()
        && let Some(source) = backports_source()?
    {
        fs::write("/etc/apt/sources.list.d/bookworm-backports.sources", source)
            .context("could not add bookworm-backports to the package sources")?;
    }
    step("package lists", apt(&["update", "-q"]))?;
    if !stable.is_empty() {
        step("packages", apt(&[&["install", "-y", "-q"], &stable[..]].concat()))?;
    }
    if !backports.is_empty() {
        let flags = ["install", "-y", "-q", "-t", "bookworm-backports"];
        step("packages from backports", apt(&[&flags, &backports[..]].concat()))?;
    }
    Ok(())
}

/// A source entry for bookworm-backports at the mirrors that the machine uses already; `None` when
/// the suite is known.
fn backports_source() -> Result<Option<String>> {
    let mut mirrors = BTreeSet::new();
    let mut files = vec!["/etc/apt/sources.list".into()];
    if let Ok(folder) = fs::read_dir("/etc/apt/sources.list.d") {
        files.extend(folder.flatten().map(|entry| entry.path()));
    }
    for file in files {
        let enabled = file.extension().is_some_and(|e| e == "list" || e == "sources");
        let Ok(text) = fs::read_to_string(&file) else { continue };
        if !enabled {
            continue;
        }
        if text.contains("bookworm-backports") {
            return Ok(None);
        }
        for line in text.lines().map(str::trim).filter(|line| !line.starts_with('#')) {
            mirrors.extend(
                line.split_whitespace()
                    .filter(|word| word.starts_with("http") && word.ends_with("/debian"))
                    .map(str::to_owned),
            );
        }
    }
    let mirror = mirrors.first().context(
        "no Debian mirror in /etc/apt/sources.list*: add the suite bookworm-backports by hand",
    )?;
    Ok(Some(format!(
        "Types: deb\nURIs: {mirror}\nSuites: bookworm-backports\nComponents: main\n\
         Signed-By: /usr/share/keyrings/debian-archive-keyring.gpg\n"
    )))
}

fn apt(args: &[&str]) -> std::process::Command {
    let mut command = command("apt-get", args);
    command.env("DEBIAN_FRONTEND", "noninteractive");
    command
}

fn runs(program: &str, flag: &str) -> bool {
    output(program, &[flag]).is_some()
}

/// Major version of an installed Debian package.
fn installed_version(package: &str) -> Option<u32> {
    let version = output("dpkg-query", &["-W", "-f", "${Version}", package])?;
    version.split(['.', '-']).next()?.parse().ok()
}
