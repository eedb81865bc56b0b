//! The library tests of `gather`, those of its NEON kernel among them, built for aarch64 and run in
//! emulation. Debian's Rust builds them: it has a standard library for aarch64 in a package, which
//! brings arm64's libc6 along. They run with that one: with the cross compiler's (`qemu -L`), the
//! first thread that is started hangs.

use anyhow::{Result, bail, ensure};

use crate::run::{cargo, command, output, step};
use crate::setup::{apt, ask_root, is_bookworm, is_root};

const PACKAGES: &[&str] = &[
    "gcc-aarch64-linux-gnu",
    "libc6-dev-arm64-cross",
    "libstd-rust-web-dev:arm64",
    "qemu-user-static",
    "rustc-web",
];
const INSTALL: &[&str] = &["install", "-y", "-q", "--no-install-recommends"];

pub(crate) fn run() -> Result<()> {
    install()?;
    let args = ["test", "--target", "aarch64-unknown-linux-gnu", "-p", "lumencast-gather", "--lib"];
    let mut tests = cargo(&args);
    tests.env("RUSTC", "/usr/bin/rustc");
    tests.env("CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_LINKER", "aarch64-linux-gnu-gcc");
    tests.env("CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_RUNNER", "qemu-aarch64-static");
    step("tests for aarch64, in emulation", tests)
}

/// Installs what is missing, or says how.
fn install() -> Result<()> {
    let missing: Vec<_> = PACKAGES.iter().copied().filter(|name| !is_installed(name)).collect();
    if missing.is_empty() {
        return Ok(());
    }
    println!("missing: {}", missing.join(", "));
    ensure!(is_bookworm(), "only on Debian 12 are they installed: install them by other means");
    if !is_root() {
        ask_root(&commands(&missing));
        bail!("packages are missing, and only root may install them");
    }
    step("packages for aarch64", command("dpkg", &["--add-architecture", "arm64"]))?;
    step("package lists", apt(&["update", "-q"]))?;
    step("packages", apt(&[INSTALL, &missing].concat()))
}

/// What root types to install packages, as one block.
fn commands(packages: &[&str]) -> String {
    format!(
        "dpkg --add-architecture arm64 &&\napt-get update &&\napt-get {} {}\n",
        INSTALL.join(" "),
        packages.join(" "),
    )
}

fn is_installed(package: &str) -> bool {
    output("dpkg-query", &["-W", "-f", "${db:Status-Status}", package])
        .is_some_and(|status| status == "installed")
}
