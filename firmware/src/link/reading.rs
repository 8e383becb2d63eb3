//! A host's message read where it lies. A request is large, as large as its largest
//! kind, and to move one costs as much as to read a short one: so it is read in two
//! steps, of which each leaves what it returns in its place.

use super::Request;
use postcard::de_flavors::Slice;
use postcard::{Deserializer, Result};
use serde::Deserialize;

/// Who says it, and under which number; as in `ToDevice`.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Deserialize)]
pub struct Sender {
    /// Its session.
    pub session: u16,
    /// The message's number.
    pub seq: u16,
}

/// The bytes of a message that are yet to be read.
///
/// ```
/// use firmware::link::{Reading, Request, ToDevice};
///
/// let sent = ToDevice { session: 7, seq: 1, request: Request::KeepAlive };
/// let mut buffer = [0; 16];
/// let message = postcard::to_slice(&sent, &mut buffer).unwrap();
///
/// let mut reading = Reading::of(message);
/// assert_eq!(reading.sender().unwrap().session, 7);
/// assert_eq!(reading.request(), Ok(Request::KeepAlive));
/// assert!(reading.is_over());
/// ```
pub struct Reading<'m>(Deserializer<'m, Slice<'m>>);

impl<'m> Reading<'m> {
    /// Of all of it.
    #[must_use]
    pub fn new(message: &'m [u8]) -> Self {
        Self(Deserializer::from_bytes(message))
    }

    /// What it begins with.
    ///
    /// # Errors
    /// The bytes end before, or say no number.
    #[inline]
    pub fn sender(&mut self) -> Result<Sender> {
        Sender::deserialize(&mut self.0)
    }

    /// What stands behind the sender.
    ///
    /// # Errors
    /// The bytes end before, or say no request.
    #[inline]
    pub fn request(&mut self) -> Result<Request> {
        Request::deserialize(&mut self.0)
    }

    /// Whether nothing is left.
    #[must_use]
    pub fn is_at_end(self) -> bool {
        self.0.finalize().is_ok_and(<[u8]>::is_empty)
    }
}
