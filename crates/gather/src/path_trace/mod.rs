//! Gathers light by path tracing.

mod aim;
pub(crate) mod beam;
mod columns;
mod group;
pub(crate) mod integrator;
pub(crate) mod paths;
#[cfg(test)]
mod tests;
mod tiles;
mod vertex;

use std::num::NonZeroUsize;
use std::time::Instant;

use crate::accel::Kernel;
use crate::queue::{Jobs, Queue, Watch};
use crate::world::{World, WorldCache};
use crate::{Gather, Gathered, Job, Progress, Ticket};

pub use crate::accel::{Levels, Trees};
pub use crate::surface::MaterialModel;

/// Settings of a [`CpuPathTracer`].
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// The material model.
    pub materials: MaterialModel,
    /// Number of threads; `None` for the number of cores.
    pub threads: Option<NonZeroUsize>,
    /// Levels of hierarchies: two for scenes that move, one for many jobs of the same moment.
    pub levels: Levels,
}

/// A path tracer on the CPU.
///
/// It works on jobs in the order of submission, each with all threads. It keeps acceleration
/// structures from job to job. Dropping it cancels its jobs and waits for its threads.
#[derive(Debug)]
pub struct CpuPathTracer {
    queue: Queue,
}

impl CpuPathTracer {
    /// Starts the threads.
    ///
    /// # Errors
    /// Where the system gives no thread.
    pub fn new(options: Options) -> std::io::Result<Self> {
        Ok(Self { queue: Queue::start("gather", move |jobs| work(&options, jobs))? })
    }
}

impl Gather for CpuPathTracer {
    fn submit(&mut self, job: Job) -> Ticket {
        self.queue.submit(job)
    }

    fn poll(&mut self, ticket: Ticket) -> Progress {
        self.queue.poll(ticket)
    }

    fn wait(&mut self, ticket: Ticket) -> Option<Gathered> {
        self.queue.wait(ticket)
    }

    fn cancel(&mut self, ticket: Ticket) {
        self.queue.cancel(ticket);
    }
}

/// Runs jobs in a thread pool that lives as long as the queue.
fn work(options: &Options, jobs: &Jobs) {
    let threads = options.threads.map_or(0, NonZeroUsize::get);
    let pool =
        rayon::ThreadPoolBuilder::new().num_threads(threads).thread_name(|i| format!("gather {i}"));
    let ended = pool.build_scoped(rayon::ThreadBuilder::run, |pool| {
        let mut cache = WorldCache::new(options.levels);
        jobs.run(|job, watch| pool.install(|| run(options.materials, job, &mut cache, watch)));
    });
    if let Err(error) = ended {
        tracing::error!(%error, "no threads to trace with");
    }
}

/// Runs one job: updates the acceleration structure, then traces paths.
fn run(model: MaterialModel, job: &Job, cache: &mut WorldCache, watch: &Watch) -> Option<Gathered> {
    let start = Instant::now();
    let world = World::new(job.scene.clone(), model, Kernel::detect(), cache);
    let built = Instant::now();
    let (sums, rays) = tiles::gather(job, &world, watch)?;
    Some(Gathered {
        sums,
        scene_version: world.version(),
        build_seconds: (built - start).as_secs_f64(),
        trace_seconds: built.elapsed().as_secs_f64(),
        rays,
    })
}
