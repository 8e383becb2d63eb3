//! Byte streams between a simulated board and its host.
//!
//! Contains streams that a host program can open (TCP, pseudo-terminal), a line in virtual time
//! that loses, corrupts and delays frames, and a recorded stream with chosen faults. A wire carries
//! bytes; frames and messages are defined elsewhere.

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
