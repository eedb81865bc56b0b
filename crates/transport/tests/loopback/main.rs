//! A real server and real clients, over QUIC and WebSocket, on loopback.

mod common;
mod hostile;
mod relay;
mod restart;
mod security;
mod stream;
