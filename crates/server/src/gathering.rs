//! The jobs that a tick has a gatherer do, and how long it waits for them.

use std::time::{Duration, Instant};

use lumencast_gather::{Gather, Gathered, Progress, Ticket};
use lumencast_light::FieldId;
use lumencast_solve::{Asked, Request};

use crate::published::Moment;

/// Time from one poll of jobs under way to the next.
const POLL_INTERVAL: Duration = Duration::from_micros(250);

/// How long a tick waits for the jobs that it has submitted.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Patience {
    /// Until all are done, however long that takes: equal calls give equal light.
    Endless,
    /// Until then. What is not done goes on; a later tick takes it in.
    Until(Instant),
}

/// The gatherer, and the jobs that it is at: one a field at most.
pub(crate) struct Gathering {
    gatherer: Box<dyn Gather>,
    under_way: Vec<UnderWay>,
}

struct UnderWay {
    ticket: Ticket,
    asked: Asked,
    moment: Moment,
}

impl UnderWay {
    fn is_waited_for(&self) -> bool {
        self.asked.lumel_samples().is_none()
    }
}

/// What became of a job; nothing was gathered where it has failed.
pub(crate) struct Brought {
    pub(crate) asked: Asked,
    /// The moment of the scene that it is of.
    pub(crate) moment: Moment,
    pub(crate) gathered: Option<Gathered>,
}

impl Gathering {
    pub(crate) fn new(gatherer: Box<dyn Gather>) -> Self {
        Self { gatherer, under_way: Vec::new() }
    }

    /// Whether a job for the field is under way.
    pub(crate) fn is_at(&self, field: FieldId) -> bool {
        self.under_way.iter().any(|job| job.asked.field == field)
    }

    /// Whether any job is under way that ticks wait for.
    pub(crate) fn is_late(&self) -> bool {
        self.under_way.iter().any(UnderWay::is_waited_for)
    }

    pub(crate) fn submit(&mut self, request: Request, moment: Moment) {
        let Request { job, asked } = request;
        let ticket = self.gatherer.submit(job);
        self.under_way.push(UnderWay { ticket, asked, moment });
    }

    /// What is done by now, in the order in which it was asked for.
    pub(crate) fn poll(&mut self) -> Vec<Brought> {
        let Self { gatherer, under_way } = self;
        let mut brought = Vec::new();
        under_way.retain(|UnderWay { ticket, asked, moment }| {
            let gathered = match gatherer.poll(*ticket) {
                Progress::Working(_) => return true,
                Progress::Done(gathered) => Some(gathered),
                Progress::Unknown => None,
            };
            brought.push(Brought { asked: asked.clone(), moment: *moment, gathered });
            false
        });
        brought
    }

    /// Waits for the jobs that were submitted in a tick, but for those of lumels, and tells what is done.
    pub(crate) fn wait(&mut self, tick: u64, patience: Patience) -> Vec<Brought> {
        match patience {
            Patience::Endless => {
                let Self { gatherer, under_way } = self;
                let bring = |UnderWay { ticket, asked, moment }| Brought {
                    asked,
                    moment,
                    gathered: gatherer.wait(ticket),
                };
                under_way.drain(..).map(bring).collect()
            }
            Patience::Until(deadline) => {
                let mut brought = self.poll();
                let is_of_now = |job: &UnderWay| job.moment.tick == tick && job.is_waited_for();
                while self.under_way.iter().any(is_of_now) && Instant::now() < deadline {
                    std::thread::sleep(POLL_INTERVAL);
                    brought.extend(self.poll());
                }
                brought
            }
        }
    }

    /// Gives up the jobs of fields that are gone.
    pub(crate) fn keep(&mut self, is_there: impl Fn(FieldId) -> bool) {
        let Self { gatherer, under_way } = self;
        under_way.retain(|job| {
            let stays = is_there(job.asked.field);
            if !stays {
                gatherer.cancel(job.ticket);
            }
            stays
        });
    }
}
