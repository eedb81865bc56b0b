//! Ctrl-C.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;

use anyhow::{Context, Result};

use crate::output::tell;

/// Exit code of a program that was interrupted.
pub(crate) const EXIT_CODE: i32 = 130;

/// Turns true at the first Ctrl-C (or SIGTERM); the second one ends the program.
pub(crate) fn flag() -> Result<Arc<AtomicBool>> {
    let flag = Arc::new(AtomicBool::new(false));
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build()
        .context("cannot wait for Ctrl-C")?;
    let raised = flag.clone();
    thread::Builder::new()
        .name("interrupt".into())
        .spawn(move || {
            runtime.block_on(async {
                first().await;
                raised.store(true, Ordering::Relaxed);
                std::future::pending::<()>().await;
            });
        })
        .context("cannot wait for Ctrl-C")?;
    Ok(flag)
}

/// Ends at the first Ctrl-C (or SIGTERM); the second one ends the program.
pub(crate) async fn first() {
    signal().await;
    tell!("Stopping; Ctrl-C again stops at once.");
    tokio::spawn(async {
        signal().await;
        std::process::exit(EXIT_CODE);
    });
}

#[cfg(unix)]
async fn signal() {
    use tokio::signal::unix::{SignalKind, signal};
    let terminated = async {
        match signal(SignalKind::terminate()) {
            Ok(mut signal) => drop(signal.recv().await),
            Err(_) => std::future::pending().await,
        }
    };
    tokio::select! {
        _ = tokio::signal::ctrl_c() => {}
        () = terminated => {}
    }
}

#[cfg(not(unix))]
async fn signal() {
    let _ = tokio::signal::ctrl_c().await;
}
