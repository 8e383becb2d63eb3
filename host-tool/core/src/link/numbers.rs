//! Request numbers, shared by the client and the thread that sends keep-alives.

use firmware::link::{Request, ToDevice, encode};
use std::sync::Arc;
use std::sync::atomic::{AtomicU16, Ordering};

/// Counter for the numbers of requests. Clones share the same counter.
#[derive(Clone, Default)]
pub(super) struct Numbers(Arc<AtomicU16>);

impl Numbers {
    /// Returns the next number; 0 follows 65,535.
    pub(super) fn next(&self) -> u16 {
        self.0.fetch_add(1, Ordering::Relaxed) // wraps
    }

    /// Returns a separate counter that starts with the next number of this one.
    pub(super) fn fork(&self) -> Self {
        Self(Arc::new(AtomicU16::new(self.0.load(Ordering::Relaxed))))
    }
}

/// Returns the frame of a request: its encoded bytes as they are sent. `None` if the request is too
/// long for a frame.
pub(super) fn frame_request(session: u16, seq: u16, request: Request) -> Option<Vec<u8>> {
    let message = ToDevice {
        session,
        seq,
        request,
    };
    encode(&message).map(|frame| frame.to_vec())
}
