//! Running other programs, with a heading, the time it took, and an error that says what failed.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

use anyhow::{Context, Result, bail};

/// The repository's root folder.
pub(crate) fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("xtask lies in the root").to_owned()
}

/// Where cargo puts what it builds.
pub(crate) fn target_dir() -> PathBuf {
    std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| root().join("target"), PathBuf::from)
}

/// A program to run in the repository's root.
pub(crate) fn command(program: &str, args: &[&str]) -> Command {
    let mut command = Command::new(program);
    command.args(args).current_dir(root());
    command
}

/// `cargo`, the one that runs us.
pub(crate) fn cargo(args: &[&str]) -> Command {
    let cargo = std::env::var("CARGO").unwrap_or_else(|_| "cargo".to_owned());
    let mut command = command(&cargo, args);
    // What `cargo run` sets for us is not meant for the cargo that we start.
    command.env_remove("CARGO_MANIFEST_DIR");
    command
}

/// `npm` in the folder of the web packages.
pub(crate) fn npm(args: &[&str]) -> Command {
    let mut command = command("npm", args);
    command.current_dir(root().join("web"));
    command
}

/// Shows what begins now.
pub(crate) fn heading(title: &str) {
    println!("\n── {title}");
}

/// Runs a step and shows its heading and time.
pub(crate) fn step(title: &str, mut command: Command) -> Result<()> {
    heading(title);
    let start = Instant::now();
    let status = command.status().with_context(|| {
        format!("{title}: could not start `{}`", command.get_program().to_string_lossy())
    })?;
    if !status.success() {
        let args: Vec<_> = command.get_args().map(|a| a.to_string_lossy()).collect();
        let program = command.get_program().to_string_lossy();
        bail!("{title}: `{program} {}` ended with {status}", args.join(" "));
    }
    println!("── {title}: done in {:.0} s", start.elapsed().as_secs_f64());
    Ok(())
}

/// Runs the last step in our place where the system can, so that Ctrl-C reaches it alone and its exit
/// code is ours.
pub(crate) fn hand_over(title: &str, command: Command) -> Result<()> {
    #[cfg(unix)]
    {
        use std::os::unix::process::CommandExt;
        let mut command = command;
        heading(title);
        let error = command.exec();
        let program = command.get_program().to_string_lossy();
        Err(error).with_context(|| format!("{title}: could not start `{program}`"))
    }
    #[cfg(not(unix))]
    step(title, command)
}

/// Builds the page and, with it inside, the release program; returns the program's path.
pub(crate) fn build_release() -> Result<PathBuf> {
    build_page()?;
    step("the program", cargo(&["build", "--release", "-p", "lumencast-cli"]))?;
    Ok(target_dir().join("release/lumencast"))
}

/// The same of a program that serves alone, which takes less time to build.
pub(crate) fn build_demo() -> Result<PathBuf> {
    build_page()?;
    let build = ["build", "--profile", "demo", "-p", "lumencast-cli", "--no-default-features"];
    step("the program", cargo(&build))?;
    Ok(target_dir().join("demo/lumencast"))
}

fn build_page() -> Result<()> {
    step("web packages", npm(&["ci", "--no-audit", "--no-fund"]))?;
    step("the page", npm(&["run", "build"]))
}

/// What a program prints on its standard output, or `None` when it can't be run or fails.
pub(crate) fn output(program: &str, args: &[&str]) -> Option<String> {
    let output = Command::new(program).args(args).output().ok()?;
    output.status.success().then(|| String::from_utf8_lossy(&output.stdout).into_owned())
}
