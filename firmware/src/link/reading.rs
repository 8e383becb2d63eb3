//! Decoding of a host's message in place. A request is as large as its largest variant, and moving
//! one costs as much as decoding a short one. A message is therefore decoded in two steps, each of
//! which leaves its result in place.

use super::Request;
use postcard::de_flavors::Slice;
use postcard::{Deserializer, Result};
use serde::Deserialize;

/// Session and sequence number of a message, as in `ToDevice`.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Deserialize)]
pub struct Sender {
    /// Number of the session in which the host sends the request.
    pub session: u16,
    /// Sequence number of the message.
    pub seq: u16,
}

/// Reader of a message that keeps the undecoded bytes.
///
/// ```
/// use firmware::link::{Reading, Request, ToDevice};
///
/// let sent = ToDevice { session: 7, seq: 1, request: Request::KeepAlive };
/// let mut buffer = [0; 16];
/// let message = postcard::to_slice(&sent, &mut buffer).unwrap();
///
/// let mut reading = Reading::new(message);
/// assert_eq!(reading.sender().unwrap().session, 7);
/// assert_eq!(reading.request(), Ok(Request::KeepAlive));
/// assert!(reading.is_at_end());
/// ```
pub struct Reading<'m>(Deserializer<'m, Slice<'m>>);

impl<'m> Reading<'m> {
    /// Creates a reader at the start of `message`.
    #[must_use]
    pub fn new(message: &'m [u8]) -> Self {
        Self(Deserializer::from_bytes(message))
    }

    /// Decodes the session and the sequence number, with which a message begins.
    ///
    /// # Errors
    /// Fails if the bytes end too early or contain no valid number.
    #[inline]
    pub fn sender(&mut self) -> Result<Sender> {
        Sender::deserialize(&mut self.0)
    }

    /// Decodes the request after the sender.
    ///
    /// # Errors
    /// Fails if the bytes end too early or contain no valid request.
    #[inline]
    pub fn request(&mut self) -> Result<Request> {
        Request::deserialize(&mut self.0)
    }

    /// Returns whether no bytes are left.
    #[must_use]
    pub fn is_at_end(self) -> bool {
        self.0.finalize().is_ok_and(<[u8]>::is_empty)
    }
}
