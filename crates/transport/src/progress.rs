//! Closes TCP connections that stand still, so that nobody holds a server's memory and descriptors
//! for nothing.

use std::pin::Pin;
use std::sync::{Arc, Mutex, PoisonError};
use std::task::{Context, Poll, ready};
use std::time::{Duration, Instant};

use axum::body::{Body, Bytes};
use axum::response::Response;
use http_body::{Frame, SizeHint};

use crate::guests::Guest;

/// Times that a TCP connection may stand still.
#[derive(Debug, Clone, Copy)]
#[non_exhaustive]
pub struct Patience {
    /// Until its first request has arrived.
    pub first_request: Duration,
    /// Between two requests.
    pub idle: Duration,
    /// While its client takes nothing of the answers that it has asked for.
    pub stalled: Duration,
}

impl Default for Patience {
    /// 10, 60 and 30 seconds.
    fn default() -> Self {
        let seconds = Duration::from_secs;
        Self { first_request: seconds(10), idle: seconds(60), stalled: seconds(30) }
    }
}

/// The progress of a connection.
#[derive(Debug)]
pub(crate) struct Progress {
    patience: Patience,
    state: Mutex<State>,
}

#[derive(Debug)]
struct State {
    /// When something last happened.
    last: Instant,
    asked: bool,
    /// Number of answers that have not ended.
    answers: usize,
}

impl Progress {
    pub(crate) fn new(patience: Patience) -> Arc<Self> {
        let state = State { last: Instant::now(), asked: false, answers: 0 };
        Arc::new(Self { patience, state: Mutex::new(state) })
    }

    /// Notes a request.
    pub(crate) fn request(self: &Arc<Self>) -> Answering {
        self.happened(|state| {
            state.asked = true;
            state.answers += 1;
        });
        Answering(self.clone())
    }

    /// Returns when the connection has stood still for too long.
    pub(crate) async fn stalled(&self) {
        loop {
            let rest = self.rest();
            if rest.is_zero() {
                return;
            }
            // Meanwhile the state may change, and with it the patience; the least of the three
            // bounds the wait.
            let Patience { first_request, idle, stalled } = self.patience;
            tokio::time::sleep(rest.min(first_request).min(idle).min(stalled)).await;
        }
    }

    /// The time that the connection may still stand still.
    fn rest(&self) -> Duration {
        let state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        let patience = match *state {
            State { answers: 1.., .. } => self.patience.stalled,
            State { asked: true, .. } => self.patience.idle,
            State { asked: false, .. } => self.patience.first_request,
        };
        patience.saturating_sub(state.last.elapsed())
    }

    fn happened(&self, change: impl FnOnce(&mut State)) {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        state.last = Instant::now();
        change(&mut state);
    }
}

/// A request that is being answered.
#[derive(Debug)]
pub(crate) struct Answering(Arc<Progress>);

impl Drop for Answering {
    fn drop(&mut self) {
        self.0.happened(|state| state.answers -= 1);
    }
}

/// An answer that counts until its end, or until its client has gone.
pub(crate) fn under_way(answer: Response, answering: Answering, guest: Guest) -> Response {
    answer.map(|body| Body::new(UnderWay { body, rest: Bytes::new(), answering, _guest: guest }))
}

/// Greatest number of bytes that are handed on at once. Small pieces show whether the client takes
/// any.
const PIECE: usize = 32 << 10;

struct UnderWay {
    body: Body,
    /// Bytes that the body has given and that are not yet handed on.
    rest: Bytes,
    answering: Answering,
    _guest: Guest,
}

impl http_body::Body for UnderWay {
    type Data = Bytes;
    type Error = axum::Error;

    /// This is called when there is room for more, so the client has taken earlier pieces.
    fn poll_frame(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, axum::Error>>> {
        self.answering.0.happened(|_| ());
        if self.rest.is_empty() {
            match ready!(Pin::new(&mut self.body).poll_frame(cx)) {
                Some(Ok(frame)) => match frame.into_data() {
                    Ok(data) => self.rest = data,
                    Err(trailers) => return Poll::Ready(Some(Ok(trailers))),
                },
                end => return Poll::Ready(end),
            }
        }
        let piece = self.rest.len().min(PIECE);
        Poll::Ready(Some(Ok(Frame::data(self.rest.split_to(piece)))))
    }

    fn is_end_stream(&self) -> bool {
        self.rest.is_empty() && self.body.is_end_stream()
    }

    fn size_hint(&self) -> SizeHint {
        let (rest, hint) = (self.rest.len() as u64, self.body.size_hint());
        let mut with_rest = SizeHint::new();
        with_rest.set_lower(hint.lower() + rest);
        if let Some(upper) = hint.upper() {
            with_rest.set_upper(upper + rest);
        }
        with_rest
    }
}
