//! Codec frames over Media over QUIC.
