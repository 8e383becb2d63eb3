//! Wires between a simulated board and its host.
//!
//! Lives here: byte streams a host program can open (TCP, pseudo-terminal),
//! a line in virtual time that loses, corrupts and delays on purpose, and a recorded
//! stream that is broken once. Not here:
//! frames and messages; a wire knows bytes only.
//! In and out: bytes.

#[cfg(feature = "wire")]
mod byte_stream;
pub mod faults;
#[cfg(feature = "wire")]
pub mod keepalive;
#[cfg(all(unix, feature = "wire"))]
pub mod pty;
pub mod stream;
#[cfg(feature = "wire")]
pub mod tcp;

#[cfg(feature = "wire")]
pub use byte_stream::{ByteStream, WRITE_PATIENCE};
