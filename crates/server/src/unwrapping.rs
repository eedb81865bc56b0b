//! Lumels of instances that came later, cut into charts and placed beside the ticks.

use std::num::NonZeroUsize;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;

use lumencast_charts::Store;
use lumencast_gather::path_trace::{CpuPathTracer, Options};
use lumencast_solve::{Newcomers, Placed, SolveError};

/// One cutting at a time, on a thread of its own. It ends when this is dropped.
#[derive(Default)]
pub(crate) struct Unwrapping {
    store: Option<Store>,
    under_way: Option<UnderWay>,
}

struct UnderWay {
    newcomers: Newcomers,
    goes_on: Arc<AtomicBool>,
    thread: JoinHandle<Result<Placed, SolveError>>,
}

impl Unwrapping {
    pub(crate) fn new(store: Option<Store>) -> Self {
        Self { store, under_way: None }
    }

    pub(crate) fn is_idle(&self) -> bool {
        self.under_way.is_none()
    }

    pub(crate) fn start(&mut self, newcomers: Newcomers) {
        let goes_on = Arc::new(AtomicBool::new(true));
        let (store, own, flag) = (self.store.clone(), newcomers.clone(), goes_on.clone());
        let work = move || {
            let options = Options { threads: NonZeroUsize::new(1), ..Options::default() };
            let mut looks = CpuPathTracer::new(options).map_err(|_| SolveError::Gather)?;
            own.place(store.as_ref(), &mut looks, &|| flag.load(Ordering::Relaxed))
        };
        match std::thread::Builder::new().name("unwrap".into()).spawn(work) {
            Ok(thread) => self.under_way = Some(UnderWay { newcomers, goes_on, thread }),
            Err(error) => tracing::warn!(%error, "no thread to cut new surfaces into charts"),
        }
    }

    /// What was placed, once it is, or at once where that is waited for.
    pub(crate) fn poll(&mut self, waits: bool) -> Option<(Newcomers, Option<Placed>)> {
        let UnderWay { newcomers, thread, .. } =
            self.under_way.take_if(|under_way| waits || under_way.thread.is_finished())?;
        let placed = match thread.join() {
            Ok(Ok(placed)) => {
                for note in &placed.notes {
                    tracing::warn!("{note}");
                }
                if placed.left_out > 0 {
                    let surfaces = placed.left_out;
                    tracing::warn!(surfaces, "no room for lumels: probes light them");
                }
                Some(placed)
            }
            Ok(Err(error)) => {
                tracing::warn!(%error, "new surfaces have no lumels");
                None
            }
            Err(_) => {
                tracing::warn!("new surfaces have no lumels: cutting them has failed");
                None
            }
        };
        Some((newcomers, placed))
    }
}

impl Drop for Unwrapping {
    fn drop(&mut self) {
        if let Some(under_way) = &self.under_way {
            under_way.goes_on.store(false, Ordering::Relaxed);
        }
    }
}
