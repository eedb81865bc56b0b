//! Streams that write in the order of their priorities.
//!
//! A WebSocket session of `qmux` sends queued frames by priority, but its queue is short.
//! Unimportant frames fill it, and writers wait for room in the order of arrival. On a slow link,
//! light of far regions would thus delay near light and the scene's state. So here writers wait in
//! a line, the most important one first. The next one writes when the socket has taken something.

use std::cmp::Reverse;
use std::collections::BTreeMap;
use std::future::Future;
use std::io;
use std::pin::{Pin, pin};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::task::{Context, Poll, ready};
use std::time::Duration;

use bytes::Bytes;
use moq_net::web_transport_trait;
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::sync::{oneshot, watch};

/// Longest time that a writer may keep others waiting. It takes that long only where its reader
/// gives its stream no credit, which should not delay the rest.
const PATIENCE: Duration = Duration::from_millis(500);

/// Priority of requests and answers, the highest: there are no streams of light without them.
const CONTROL: u8 = u8::MAX;

/// A session in which one stream writes at a time.
#[derive(Clone)]
pub(crate) struct Session<S> {
    inner: S,
    line: Line,
}

impl<S> Session<S> {
    /// A session over a socket whose messages `taken` counts.
    pub(crate) fn new(inner: S, taken: Taken) -> Self {
        Self { inner, line: Line { waiting: Arc::default(), taken } }
    }

    fn stream<W: web_transport_trait::SendStream>(&self, mut inner: W, priority: u8) -> Stream<W> {
        inner.set_priority(priority);
        Stream { inner, priority, line: self.line.clone() }
    }
}

impl<S: web_transport_trait::Session> web_transport_trait::Session for Session<S> {
    type SendStream = Stream<S::SendStream>;
    type RecvStream = S::RecvStream;
    type Error = S::Error;

    async fn accept_uni(&self) -> Result<Self::RecvStream, Self::Error> {
        self.inner.accept_uni().await
    }

    async fn accept_bi(&self) -> Result<(Self::SendStream, Self::RecvStream), Self::Error> {
        let (send, recv) = self.inner.accept_bi().await?;
        Ok((self.stream(send, CONTROL), recv))
    }

    async fn open_bi(&self) -> Result<(Self::SendStream, Self::RecvStream), Self::Error> {
        let (send, recv) = self.inner.open_bi().await?;
        Ok((self.stream(send, CONTROL), recv))
    }

    async fn open_uni(&self) -> Result<Self::SendStream, Self::Error> {
        Ok(self.stream(self.inner.open_uni().await?, 0))
    }

    fn send_datagram(&self, payload: Bytes) -> Result<(), Self::Error> {
        self.inner.send_datagram(payload)
    }

    async fn recv_datagram(&self) -> Result<Bytes, Self::Error> {
        self.inner.recv_datagram().await
    }

    fn max_datagram_size(&self) -> usize {
        self.inner.max_datagram_size()
    }

    fn protocol(&self) -> Option<&str> {
        self.inner.protocol()
    }

    fn close(&self, code: u32, reason: &str) {
        self.inner.close(code, reason);
    }

    async fn closed(&self) -> Self::Error {
        self.inner.closed().await
    }

    fn stats(&self) -> impl web_transport_trait::Stats {
        self.inner.stats()
    }
}

/// The sending half of a stream.
pub(crate) struct Stream<S> {
    inner: S,
    priority: u8,
    line: Line,
}

impl<S: web_transport_trait::SendStream> web_transport_trait::SendStream for Stream<S> {
    type Error = S::Error;

    async fn write(&mut self, bytes: &[u8]) -> Result<usize, Self::Error> {
        self.line.pass(self.priority, self.inner.write(bytes)).await
    }

    async fn write_chunk(&mut self, chunk: Bytes) -> Result<(), Self::Error> {
        self.line.pass(self.priority, self.inner.write_chunk(chunk)).await
    }

    fn set_priority(&mut self, order: u8) {
        self.priority = order;
        self.inner.set_priority(order);
    }

    fn finish(&mut self) -> Result<(), Self::Error> {
        self.inner.finish()
    }

    fn reset(&mut self, code: u32) {
        self.inner.reset(code);
    }

    async fn closed(&mut self) -> Result<(), Self::Error> {
        self.inner.closed().await
    }
}

/// Number of messages that a socket has taken.
pub(crate) type Taken = watch::Receiver<u64>;

/// A socket that counts the messages it takes.
pub(crate) struct Socket<I> {
    inner: I,
    /// Whether something was written since the last flush.
    written: bool,
    taken: watch::Sender<u64>,
}

impl<I> Socket<I> {
    pub(crate) fn new(inner: I) -> (Self, Taken) {
        let (taken, seen) = watch::channel(0);
        (Self { inner, written: false, taken }, seen)
    }
}

impl<I: AsyncRead + Unpin> AsyncRead for Socket<I> {
    fn poll_read(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        into: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        Pin::new(&mut self.inner).poll_read(cx, into)
    }
}

impl<I: AsyncWrite + Unpin> AsyncWrite for Socket<I> {
    fn poll_write(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        bytes: &[u8],
    ) -> Poll<io::Result<usize>> {
        self.written = true;
        Pin::new(&mut self.inner).poll_write(cx, bytes)
    }

    fn poll_flush(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        ready!(Pin::new(&mut self.inner).poll_flush(cx))?;
        // Every message ends with a flush, but not every flush ends a message.
        if std::mem::take(&mut self.written) {
            self.taken.send_modify(|count| *count += 1);
        }
        Poll::Ready(Ok(()))
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.inner).poll_shutdown(cx)
    }
}

/// A line of waiting writers: the highest priority first, equal ones in the order of arrival.
#[derive(Clone)]
struct Line {
    waiting: Arc<Mutex<Waiting>>,
    taken: Taken,
}

#[derive(Default)]
struct Waiting {
    busy: bool,
    arrivals: u64,
    writers: BTreeMap<(Reverse<u8>, u64), oneshot::Sender<Permit>>,
}

/// The right to write; dropping it passes it to the next writer.
struct Permit {
    line: Line,
    /// Whether dropping it passes it on.
    held: bool,
}

impl Line {
    /// Executes a write when its turn comes.
    async fn pass<T>(&self, priority: u8, write: impl Future<Output = T>) -> T {
        let permit = self.enter(priority).await;
        let mut taken = self.taken.clone();
        taken.mark_unchanged();
        let mut write = pin!(write);
        if let Ok(done) = tokio::time::timeout(PATIENCE, &mut write).await {
            // The next writer may start when the socket has taken this write.
            tokio::spawn(async move {
                let _ = tokio::time::timeout(PATIENCE, taken.changed()).await;
                drop(permit);
            });
            return done;
        }
        drop(permit);
        write.await
    }

    async fn enter(&self, priority: u8) -> Option<Permit> {
        let turn = {
            let mut waiting = self.lock();
            if !std::mem::replace(&mut waiting.busy, true) {
                return Some(Permit { line: self.clone(), held: true });
            }
            let (sender, turn) = oneshot::channel();
            waiting.arrivals += 1;
            let place = (Reverse(priority), waiting.arrivals);
            waiting.writers.insert(place, sender);
            turn
        };
        // The sender stays in the line until it is used, so there is always an answer.
        turn.await.ok()
    }

    fn lock(&self) -> MutexGuard<'_, Waiting> {
        self.waiting.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for Permit {
    fn drop(&mut self) {
        if !self.held {
            return;
        }
        loop {
            let next = {
                let mut waiting = self.line.lock();
                let next = waiting.writers.pop_first();
                waiting.busy = next.is_some();
                next
            };
            let Some((_, writer)) = next else { return };
            match writer.send(Permit { line: self.line.clone(), held: true }) {
                Ok(()) => return,
                // That writer has given up, so the loop passes the permit to the next one.
                Err(mut refused) => refused.held = false,
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A line for a socket that takes everything at once.
    fn line() -> Line {
        let (sender, taken) = watch::channel(0);
        tokio::spawn(async move {
            while !sender.is_closed() {
                sender.send_modify(|count| *count += 1);
                tokio::task::yield_now().await;
            }
        });
        Line { waiting: Arc::default(), taken }
    }

    #[tokio::test]
    async fn the_most_important_writer_goes_first() {
        let line = line();
        let written = Arc::new(Mutex::new(Vec::new()));
        let first = line.enter(0).await;
        let write = |priority: u8| {
            let (line, written) = (line.clone(), written.clone());
            tokio::spawn(async move {
                line.pass(priority, async { written.lock().expect("a list").push(priority) }).await;
            })
        };
        let writers = [3, 9, 200, 9, 1].map(write);
        tokio::task::yield_now().await;
        // A writer that gives up is skipped.
        writers[1].abort();
        tokio::task::yield_now().await;
        drop(first);
        for writer in writers {
            let _ = writer.await;
        }
        assert_eq!(*written.lock().expect("a list"), [200, 9, 3, 1]);
        tokio::time::sleep(PATIENCE / 10).await;
        assert!(!line.lock().busy);
    }

    #[tokio::test]
    async fn a_writer_that_gets_no_further_does_not_hold_up_the_rest() {
        let line = line();
        let stuck = line.clone();
        let stuck = tokio::spawn(async move { stuck.pass(9, std::future::pending::<()>()).await });
        tokio::task::yield_now().await;
        line.pass(1, async {}).await;
        stuck.abort();
    }
}
