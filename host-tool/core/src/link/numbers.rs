//! Numbers of requests, which the client and whoever keeps its session alive share.

use firmware::link::{Request, ToDevice, encode};
use std::sync::Arc;
use std::sync::atomic::{AtomicU16, Ordering};

/// The number of the next request. Clones are one and the same.
#[derive(Clone, Default)]
pub(super) struct Numbers(Arc<AtomicU16>);

impl Numbers {
    /// The next number; after 65,535 comes 0.
    pub(super) fn next(&self) -> u16 {
        self.0.fetch_add(1, Ordering::Relaxed) // wraps
    }

    /// Numbers that go on from these, by themselves.
    pub(super) fn apart(&self) -> Self {
        Self(Arc::new(AtomicU16::new(self.0.load(Ordering::Relaxed))))
    }
}

/// A request as it is sent.
pub(super) fn framed(session: u16, seq: u16, request: Request) -> Option<Vec<u8>> {
    let message = ToDevice {
        session,
        seq,
        request,
    };
    encode(&message).map(|frame| frame.to_vec())
}
