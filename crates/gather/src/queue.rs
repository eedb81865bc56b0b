//! A queue of jobs: tickets, and the thread that works on the jobs one after the other. It does not
//! depend on any gatherer.

use std::collections::HashMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;

use crate::gatherer::{Gather, Gathered, Progress, Ticket};
use crate::job::Job;

/// Progress and cancellation of a job, shared between caller and worker.
#[derive(Debug, Default)]
pub(crate) struct Watch {
    pub(crate) samples_done: AtomicU64,
    pub(crate) cancelled: AtomicBool,
}

/// A queue of jobs with its worker. Dropping it cancels its jobs and waits for the worker.
#[derive(Debug)]
pub(crate) struct Queue {
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

    /// Stores a job's result. Without a result it drops the job's state, so that nobody waits for
    /// it.
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

    /// The watch of a job that has not been cancelled.
    fn watch(&self, ticket: Ticket) -> Option<Arc<Watch>> {
        match self.states().get(&ticket) {
            Some(State::Working { watch, .. }) => Some(watch.clone()),
            _ => None,
        }
    }
}

/// The worker's end of a queue.
pub(crate) struct Jobs {
    incoming: Receiver<(Ticket, Job)>,
    shared: Arc<Shared>,
}

impl Jobs {
    /// Works on jobs in the order of submission until the queue is dropped. `work` returns `None`
    /// where the job was cancelled.
    pub(crate) fn run(&self, mut work: impl FnMut(&Job, &Watch) -> Option<Gathered>) {
        while let Ok((ticket, job)) = self.incoming.recv() {
            let Some(watch) = self.shared.watch(ticket) else { continue };
            // The caller would wait for ever if a panic in one job ended the worker.
            let result = catch_unwind(AssertUnwindSafe(|| work(&job, &watch)));
            self.shared.finish(ticket, result.ok().flatten());
        }
    }
}

impl Queue {
    /// Starts the worker: a thread named `name` that calls `worker` once.
    ///
    /// # Errors
    /// Where the system gives no thread.
    pub(crate) fn start(
        name: &str,
        worker: impl FnOnce(&Jobs) + Send + 'static,
    ) -> std::io::Result<Self> {
        let shared = Arc::new(Shared::default());
        let (jobs, incoming) = channel();
        let ends = Jobs { incoming, shared: shared.clone() };
        let body = move || {
            worker(&ends);
            // If the worker has returned, the remaining jobs are cancelled.
            ends.run(|_, _| None);
        };
        let worker = std::thread::Builder::new().name(name.into()).spawn(body)?;
        Ok(Self { shared, jobs: Some(jobs), worker: Some(worker), next: 0 })
    }
}

impl Gather for Queue {
    fn submit(&mut self, job: Job) -> Ticket {
        let ticket = Ticket(self.next);
        self.next += 1;
        let state = State::Working { watch: Arc::default(), samples: job.samples() };
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

impl Drop for Queue {
    fn drop(&mut self) {
        self.jobs = None;
        for (_, state) in self.shared.states().drain() {
            if let State::Working { watch, .. } = state {
                watch.cancelled.store(true, Ordering::Relaxed);
            }
        }
        if let Some(worker) = self.worker.take() {
            // The worker's thread has reported its panic itself.
            let _ = worker.join();
        }
    }
}
