//! TCP connections that leave little unsent data in the kernel.
//!
//! No priority can overtake data that the kernel has taken, and by default it takes megabytes. Its
//! limit on unsent data is checked only where a new buffer begins, and one buffer holds 64 KB of
//! writes. So each write is marked as the end of its buffer.

use std::io;
use std::pin::Pin;
use std::task::{Context, Poll, ready};

use socket2::SockRef;
use tokio::io::{AsyncRead, AsyncWrite, Interest, ReadBuf};
use tokio::net::TcpStream;

/// Greatest number of unsent bytes that the kernel takes: at 1 Mbit/s they are 30 ms of old light.
const UNSENT: u32 = 4 * 1024;

/// `MSG_EOR` of Linux: later writes do not join this write's buffer.
const END_OF_RECORD: i32 = 0x80;

/// A connection whose unsent data is limited to [`UNSENT`].
pub(crate) struct Limited(TcpStream);

impl Limited {
    pub(crate) fn new(stream: TcpStream) -> io::Result<Self> {
        SockRef::from(&stream).set_tcp_notsent_lowat(UNSENT)?;
        Ok(Self(stream))
    }
}

impl AsyncRead for Limited {
    fn poll_read(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        into: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        Pin::new(&mut self.0).poll_read(cx, into)
    }
}

impl AsyncWrite for Limited {
    fn poll_write(
        self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        bytes: &[u8],
    ) -> Poll<io::Result<usize>> {
        loop {
            ready!(self.0.poll_write_ready(cx))?;
            let write = || SockRef::from(&self.0).send_with_flags(bytes, END_OF_RECORD);
            match self.0.try_io(Interest::WRITABLE, write) {
                Err(err) if err.kind() == io::ErrorKind::WouldBlock => {}
                written => return Poll::Ready(written),
            }
        }
    }

    fn poll_flush(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.0).poll_flush(cx)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.0).poll_shutdown(cx)
    }
}
