//! Jobs that wait their turn: tickets, and the thread that works on them one after the other. It knows
//! no gatherer.

use std::collections::HashMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;

use crate::gatherer::{Gather, Gathered, Progress, Ticket};
use crate::job::Job;

/// How far a job is.
#[derive(Debug, Default)]
pub(crate) struct Watch {
    pub(crate) samples_done: AtomicU64,
    pub(crate) cancelled: AtomicBool,
}

/// A queue of jobs with its worker. Dropping it gives its jobs up and waits for the worker.
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

    /// The watch of a job that nobody has given up.
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
    /// Works on jobs, in the order in which they were submitted, until the queue is dropped. `work`
    /// gives nothing where the job was cancelled.
    pub(crate) fn run(&self, mut work: impl FnMut(&Job, &Watch) -> Option<Gathered>) {
        while let Ok((ticket, job)) = self.incoming.recv() {
            let Some(watch) = self.shared.watch(ticket) else { continue };
            // A panic in one job must not leave the caller waiting for it for ever.
            let result = catch_unwind(AssertUnwindSafe(|| work(&job, &watch)));
            self.shared.finish(ticket, result.ok().flatten());
        }
    }
}

impl Queue {
    /// Starts the worker: a thread of this name that calls `worker` once.
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
            // Jobs that the worker has not done are given up.
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
            // A panic there has been reported by its own thread.
            let _ = worker.join();
        }
    }
}
