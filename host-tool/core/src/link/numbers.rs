//! Numbers of requests, which the client and whoever keeps its session alive share.

use firmware::link::{Request, ToDevice, encode};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// The number of the next request. Whoever has it sends: one frame at a time, in the order
/// of numbers.
#[derive(Clone, Default)]
pub(super) struct Numbers(Arc<Mutex<u16>>);

impl Numbers {
    pub(super) fn next(&self) -> MutexGuard<'_, u16> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// A request as it is sent, with the next number.
pub(super) fn framed(session: u16, next: &mut u16, request: Request) -> Option<Vec<u8>> {
    let seq = *next;
    *next = seq.wrapping_add(1);
    let message = ToDevice {
        session,
        seq,
        request,
    };
    encode(&message).map(|frame| frame.to_vec())
}
