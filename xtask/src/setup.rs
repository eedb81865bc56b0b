//! What the workspace needs of the machine. As root on Debian it is installed; otherwise the exact
//! commands are printed.

use std::fs;
use std::path::PathBuf;

use anyhow::{Context, Result, bail, ensure};

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

/// A library that windows look for when they are opened.
const fn of_windows(name: &'static str, present: fn() -> bool) -> Package {
    Package {
        name,
        release: Release::Stable,
        purpose: Purpose::Test,
        why: "a part of X11 that windows need",
        present,
    }
}

const PACKAGES: &[Package] = &[
    Package {
        name: "build-essential",
        release: Release::Stable,
        purpose: Purpose::Demo,
        why: "compilers of C for the cryptography of QUIC, of C++ for video",
        present: || runs("cc", "--version") && runs("c++", "--version"),
    },
    Package {
        name: "nasm",
        release: Release::Stable,
        purpose: Purpose::Demo,
        why: "the assembler of the video library, which is far slower without",
        present: || cfg!(not(target_arch = "x86_64")) || runs("nasm", "-v"),
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
        name: "iproute2",
        release: Release::Stable,
        purpose: Purpose::Test,
        why: "makes the slow link of the browser test",
        present: || runs("tc", "-V"),
    },
    Package {
        name: "xvfb",
        release: Release::Stable,
        purpose: Purpose::Test,
        why: "a display for the test of the window",
        present: || runs("Xvfb", "-help"),
    },
    of_windows("libx11-6", || has_library("libX11.so.6")),
    of_windows("libx11-xcb1", || has_library("libX11-xcb.so.1")),
    of_windows("libxcursor1", || has_library("libXcursor.so.1")),
    of_windows("libxi6", || has_library("libXi.so.6")),
    of_windows("libxkbcommon-x11-0", || has_library("libxkbcommon-x11.so.0")),
    Package {
        name: "python3-pip",
        release: Release::Stable,
        purpose: Purpose::Test,
        why: "fetches Embree, which rays are compared with",
        present: || {
            output("python3", &["-m", "pip", "--version"]).is_some_and(|text| text.contains("pip"))
        },
    },
    Package {
        name: "mesa-vulkan-drivers",
        release: Release::Backports,
        purpose: Purpose::Test,
        why: "a GPU in software (lavapipe 25 or newer), for machines without one",
        present: || installed_version("mesa-vulkan-drivers").is_some_and(|major| major >= 25),
    },
];

/// Where bookworm-backports is added to the package sources.
const BACKPORTS_FILE: &str = "/etc/apt/sources.list.d/bookworm-backports.sources";

/// Installs what is missing, or says how.
pub(crate) fn install(purpose: Purpose) -> Result<()> {
    check_node()?;
    install_packages(purpose)?;
    if purpose == Purpose::Test && !runs("cargo-nextest", "--version") {
        let install = cargo(&["install", "--locked", "cargo-nextest"]);
        step("install cargo-nextest (runs the tests)", install)?;
    }
    Ok(())
}

fn check_node() -> Result<()> {
    let (major, minor) = node_wanted()?;
    let advice = format!("install Node {major}.{minor} or newer, with npm, from nodejs.org");
    let version = output("node", &["--version"]).unwrap_or_default();
    let Some(found) = major_and_minor(version.trim().trim_start_matches('v')) else {
        bail!("the web page needs Node: {advice}");
    };
    ensure!(found >= (major, minor), "Node {} is too old: {advice}", version.trim());
    ensure!(runs("npm", "--version"), "npm is missing: {advice}");
    Ok(())
}

/// The oldest Node with which the web packages work, as they say themselves.
fn node_wanted() -> Result<(u32, u32)> {
    let package: serde_json::Value = serde_json::from_str(include_str!("../../web/package.json"))?;
    let wanted = package["engines"]["node"].as_str().and_then(|text| text.strip_prefix(">="));
    wanted.and_then(major_and_minor).context("web/package.json asks for no Node of the form >=1.2")
}

/// `20.19.5` or `20.19`
fn major_and_minor(version: &str) -> Option<(u32, u32)> {
    let mut numbers = version.split('.').map(str::parse);
    Some((numbers.next()?.ok()?, numbers.next()?.ok()?))
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
    ensure!(is_bookworm(), "only on Debian 12 are they installed: install them by other means");
    let source = if backports.is_empty() { None } else { backports_source(&package_sources()) };
    if !is_root() {
        let commands = commands(&stable, &backports, source.as_deref());
        ask_root(&commands);
        bail!("packages are missing, and only root may install them");
    }
    install_as_root(&stable, &backports, source)
}

fn install_as_root(stable: &[&str], backports: &[&str], source: Option<String>) -> Result<()> {
    if let Some(source) = source {
        fs::write(BACKPORTS_FILE, source)
            .context("could not add bookworm-backports to the package sources")?;
    }
    step("package lists", apt(&["update", "-q"]))?;
    if !stable.is_empty() {
        step("packages", apt(&[&["install", "-y", "-q"], stable].concat()))?;
    }
    if !backports.is_empty() {
        let flags = ["install", "-y", "-q", "-t", "bookworm-backports"];
        step("packages from backports", apt(&[&flags, backports].concat()))?;
    }
    Ok(())
}

/// Prints what root has to type.
pub(crate) fn ask_root(commands: &str) {
    println!("\nPaste this into a shell of root (`su -` or `sudo -i`), and start again:\n");
    println!("{commands}");
}

/// What root types to install packages, as one block.
fn commands(stable: &[&str], backports: &[&str], source: Option<&str>) -> String {
    let mut commands = String::new();
    if let Some(source) = source {
        commands += &format!("cat > {BACKPORTS_FILE} <<'END'\n{source}END\n");
    }
    commands += "apt-get update";
    for (release, names) in [("", stable), ("-t bookworm-backports ", backports)] {
        if !names.is_empty() {
            commands += &format!(" &&\napt-get install -y {release}{}", names.join(" "));
        }
    }
    commands + "\n"
}

/// The package sources of apt that count.
fn package_sources() -> String {
    let mut files = vec![PathBuf::from("/etc/apt/sources.list")];
    if let Ok(folder) = fs::read_dir("/etc/apt/sources.list.d") {
        files.extend(folder.flatten().map(|entry| entry.path()));
    }
    files.retain(|file| file.extension().is_some_and(|e| e == "list" || e == "sources"));
    files.iter().filter_map(|file| fs::read_to_string(file).ok()).collect::<Vec<_>>().join("\n")
}

/// A source entry for bookworm-backports at the mirror that the machine uses already, or else at
/// Debian's own; `None` when the suite is among the `sources`.
fn backports_source(sources: &str) -> Option<String> {
    let lines = sources.lines().filter(|line| !line.trim_start().starts_with('#'));
    let words = lines.flat_map(str::split_whitespace);
    if words.clone().any(|word| word == "bookworm-backports") {
        return None;
    }
    let mirror = words
        .map(|word| word.trim_end_matches('/'))
        .find(|word| word.starts_with("http") && word.ends_with("/debian"))
        .unwrap_or("http://deb.debian.org/debian");
    Some(format!(
        "Types: deb\nURIs: {mirror}\nSuites: bookworm-backports\nComponents: main\n\
         Signed-By: /usr/share/keyrings/debian-archive-keyring.gpg\n"
    ))
}

/// Whether this is Debian 12.
pub(crate) fn is_bookworm() -> bool {
    let release = fs::read_to_string("/etc/os-release").unwrap_or_default();
    release.contains("VERSION_CODENAME=bookworm")
}

/// Whether this process may do anything on this machine.
pub(crate) fn is_root() -> bool {
    output("id", &["-u"]).is_some_and(|id| id.trim() == "0")
}

pub(crate) fn apt(args: &[&str]) -> std::process::Command {
    let mut command = command("apt-get", args);
    command.env("DEBIAN_FRONTEND", "noninteractive");
    command
}

fn runs(program: &str, flag: &str) -> bool {
    output(program, &[flag]).is_some()
}

/// Whether a shared library is where Debian puts them.
fn has_library(name: &str) -> bool {
    let Ok(folders) = fs::read_dir("/usr/lib") else { return false };
    folders.flatten().any(|folder| folder.path().join(name).exists())
}

/// Major version of an installed Debian package.
fn installed_version(package: &str) -> Option<u32> {
    let version = output("dpkg-query", &["-W", "-f", "${Version}", package])?;
    version.split(['.', '-']).next()?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn libraries_are_found() {
        // Every program needs it.
        assert!(has_library("libc.so.6") || !is_bookworm());
        assert!(!has_library("libnothing-of-the-kind.so.1"));
    }

    #[test]
    fn node_is_asked_for_as_in_the_packages() {
        assert!(node_wanted().expect("a version") >= (20, 19));
        assert_eq!(major_and_minor("20.19.5"), Some((20, 19)));
        assert_eq!(major_and_minor("22"), None);
        assert!(major_and_minor("20.9.0") < major_and_minor("20.19.0"));
    }

    #[test]
    fn backports_are_added_where_they_are_missing() {
        let fresh = "deb http://ftp.de.debian.org/debian/ bookworm main\n# bookworm-backports\n";
        let source = backports_source(fresh).expect("a source");
        assert!(source.contains("URIs: http://ftp.de.debian.org/debian\n"), "{source}");
        let elsewhere = backports_source("URIs: mirror+file:///etc/apt/mirrors/debian.list");
        assert!(elsewhere.expect("a source").contains("URIs: http://deb.debian.org/debian\n"));
        assert_eq!(backports_source("Suites: bookworm bookworm-backports"), None);
    }

    /// The block is for pasting: a shell without rights to install runs it, with a stand-in for apt.
    #[test]
    fn commands_for_root_can_be_pasted() {
        let file = std::env::temp_dir().join(format!("lumencast-setup-{}", std::process::id()));
        let file = file.to_string_lossy();
        let block = commands(&["cc", "b"], &["mesa"], Some("Types: deb\nSuites: $x\n"))
            .replace(BACKPORTS_FILE, &file)
            .replace("apt-get", "apt_get");
        let script = format!("apt_get() {{ echo \"apt $*\"; }}\n{block}cat {file}\nrm {file}\n");
        let said = output("sh", &["-ec", &script]).expect("the commands run");
        assert_eq!(
            said,
            "apt update\napt install -y cc b\napt install -y -t bookworm-backports mesa\n\
             Types: deb\nSuites: $x\n"
        );
        assert_eq!(commands(&["cc"], &[], None), "apt-get update &&\napt-get install -y cc\n");
    }
}
