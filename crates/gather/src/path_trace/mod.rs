//! Gathering by path tracing.

mod aim;
pub(crate) mod beam;
mod columns;
mod group;
pub(crate) mod integrator;
mod job;
pub(crate) mod paths;
#[cfg(test)]
mod tests;
mod vertex;

use std::collections::HashMap;
use std::num::NonZeroUsize;
use std::sync::atomic::Ordering;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::Instant;

use crate::accel::Kernel;
use crate::world::{World, WorldCache};
use crate::{Gather, Gathered, Job, Progress, Ticket};

pub use crate::accel::{Levels, Trees};
pub use crate::surface::MaterialModel;
use job::Watch;

/// Settings of a [`CpuPathTracer`].
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Which materials to believe.
    pub materials: MaterialModel,
    /// Threads to trace with; as many as there are cores when absent.
    pub threads: Option<NonZeroUsize>,
    /// How rays find surfaces: two levels for scenes that move, one where jobs share a moment.
    pub levels: Levels,
}

/// A path tracer on the CPU.
///
/// Jobs are worked on in the order in which they were submitted, each by all threads. Acceleration
/// structures are kept from job to job. Dropping it gives its jobs up and waits for its threads.
#[derive(Debug)]
pub struct CpuPathTracer {
    shared: Arc<Shared>,
    /// Absent only while dropping.
    jobs: Option<Sender<(Ticket, Job)>>,
    worker: Option<JoinHandle<()>>,
    next: u64,
}

#[derive(Debug, Default)]
struct Shared {
    states: Mutex<HashMap<Ticket, State>>,
    changed: Condvar,
}

#[derive(Debug)]
enum State {
    Working { watch: Arc<Watch>, samples: u64 },
    Done(Gathered),
}

impl Shared {
    fn states(&self) -> MutexGuard<'_, HashMap<Ticket, State>> {
        self.states.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// A state is dropped where the job cannot be done any more, so that nobody waits for it.
    fn finish(&self, ticket: Ticket, result: Option<Gathered>) {
        let mut states = self.states();
        match result {
            Some(gathered) if states.contains_key(&ticket) => {
                states.insert(ticket, State::Done(gathered));
            }
            _ => {
                states.remove(&ticket);
            }
        }
        self.changed.notify_all();
    }
}

impl CpuPathTracer {
    /// Starts the threads.
    ///
    /// # Errors
    /// Where the system gives no thread.
    pub fn new(options: Options) -> std::io::Result<Self> {
        let shared = Arc::new(Shared::default());
        let (jobs, incoming) = channel();
        let worker = std::thread::Builder::new().name("gather".into()).spawn({
            let shared = shared.clone();
            move || work(&options, &incoming, &shared)
        })?;
        Ok(Self { shared, jobs: Some(jobs), worker: Some(worker), next: 0 })
    }
}

impl Gather for CpuPathTracer {
    fn submit(&mut self, job: Job) -> Ticket {
        let ticket = Ticket(self.next);
        self.next += 1;
        let samples = job.receivers.iter().map(|r| u64::from(r.samples)).sum();
        let state = State::Working { watch: Arc::default(), samples };
        self.shared.states().insert(ticket, state);
        let sent = self.jobs.as_ref().is_some_and(|jobs| jobs.send((ticket, job)).is_ok());
        if !sent {
            self.shared.finish(ticket, None);
        }
        ticket
    }

    fn poll(&mut self, ticket: Ticket) -> Progress {
        let mut states = self.shared.states();
        match states.get(&ticket) {
            None => Progress::Unknown,
            Some(State::Working { watch, samples }) => {
                let done = watch.samples_done.load(Ordering::Relaxed);
                Progress::Working((done as f64 / (*samples).max(1) as f64) as f32)
            }
            Some(State::Done(_)) => match states.remove(&ticket) {
                Some(State::Done(gathered)) => Progress::Done(gathered),
                _ => Progress::Unknown,
            },
        }
    }

    fn wait(&mut self, ticket: Ticket) -> Option<Gathered> {
        let working =
            |states: &mut HashMap<_, _>| matches!(states.get(&ticket), Some(State::Working { .. }));
        let states = self.shared.states();
        let waited = self.shared.changed.wait_while(states, working);
        match waited.unwrap_or_else(PoisonError::into_inner).remove(&ticket)? {
            State::Done(gathered) => Some(gathered),
            State::Working { .. } => None,
        }
    }

    fn cancel(&mut self, ticket: Ticket) {
        if let Some(State::Working { watch, .. }) = self.shared.states().remove(&ticket) {
            watch.cancelled.store(true, Ordering::Relaxed);
        }
    }
}

impl Drop for CpuPathTracer {
    fn drop(&mut self) {
        self.jobs = None;
        for (_, state) in self.shared.states().drain() {
            if let State::Working { watch, .. } = state {
                watch.cancelled.store(true, Ordering::Relaxed);
            }
        }
        if let Some(worker) = self.worker.take() {
            // A panic there has been reported by its own thread.
            let _ = worker.join();
        }
    }
}

/// The worker: runs jobs one after the other in a pool that ends with it.
fn work(options: &Options, jobs: &Receiver<(Ticket, Job)>, shared: &Shared) {
    let threads = options.threads.map_or(0, NonZeroUsize::get);
    let pool =
        rayon::ThreadPoolBuilder::new().num_threads(threads).thread_name(|i| format!("gather {i}"));
    let ended = pool.build_scoped(rayon::ThreadBuilder::run, |pool| {
        let mut cache = WorldCache::new(options.levels);
        while let Ok((ticket, job)) = jobs.recv() {
            let Some(watch) = watch(shared, ticket) else { continue };
            let run = || pool.install(|| run(options.materials, &job, &mut cache, &watch));
            // A panic in one job must not leave the caller waiting for it for ever.
            let result = std::panic::catch_unwind(std::panic::AssertUnwindSafe(run));
            shared.finish(ticket, result.ok().flatten());
        }
    });
    if let Err(error) = ended {
        tracing::error!(%error, "no threads to trace with");
        while let Ok((ticket, _)) = jobs.recv() {
            shared.finish(ticket, None);
        }
    }
}

/// The watch of a job that nobody has given up.
fn watch(shared: &Shared, ticket: Ticket) -> Option<Arc<Watch>> {
    match shared.states().get(&ticket) {
        Some(State::Working { watch, .. }) => Some(watch.clone()),
        _ => None,
    }
}

/// One job: acceleration structure, then paths.
fn run(model: MaterialModel, job: &Job, cache: &mut WorldCache, watch: &Watch) -> Option<Gathered> {
    let start = Instant::now();
    let world = World::new(job.scene.clone(), model, Kernel::detect(), cache);
    let built = Instant::now();
    let (sums, rays) = job::gather(job, &world, watch)?;
    Some(Gathered {
        sums,
        scene_version: world.version(),
        build_seconds: (built - start).as_secs_f64(),
        trace_seconds: built.elapsed().as_secs_f64(),
        rays,
    })
}
