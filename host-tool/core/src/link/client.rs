//! The host's end of a session, without input and output: it takes bytes and times, and returns
//! bytes and messages. A blocking program drives it with [`Connection`](super::Connection); a
//! thread, a server or a page in a browser can drive it themselves.

use super::clock::{Clock, Fit};
use super::numbers::{Numbers, frame_request};
use super::{Error, RefusalInWords};
use firmware::link::{
    Code, Decoder, Event, HelloInfo, Request, Response, SCHEMA, SetupSum, Status, Telemetry,
};
use firmware::units::Micros;
use std::collections::VecDeque;

/// Maximum number of requests that were sent and not yet answered.
const MAX_AWAITED: usize = 256;

/// Message of the device. Device times are in µs, have 64 bits and do not wrap;
/// [`stamp`](super::stamp) converts them into the device's own 32 bits.
#[derive(Clone, Debug)]
pub enum Incoming {
    /// Telemetry sample with its device time.
    Telemetry(u64, Box<Telemetry>),
    /// Event with its device time.
    Event(u64, Event),
    /// Acknowledgement of the request with this number, and the device time at which the request
    /// was carried out.
    Acknowledged(u16, u64),
    /// Answer to a [`Request::Hello`].
    Hello(Box<HelloInfo>),
    /// Answer to the [`Request::Status`] with this number.
    Status(u16, Box<Status>),
    /// Refusal of the request with this number, or of a frame that could not be read (`None`).
    Refused(Option<u16>, RefusalInWords),
}

impl Incoming {
    /// Returns the number of the request that this message answers; `None` if it answers none.
    const fn answered_seq(&self) -> Option<u16> {
        match self {
            Self::Acknowledged(seq, _) | Self::Status(seq, _) => Some(*seq),
            Self::Hello(info) => Some(info.seq),
            Self::Refused(seq, _) => *seq,
            Self::Telemetry(..) | Self::Event(..) => None,
        }
    }

    /// Returns whether the message says that the device serves another host. Such a device refuses
    /// a request without reading its number, so the refusal carries no number.
    fn is_session_refusal(&self) -> bool {
        matches!(self, Self::Refused(None, refused) if refused.code() == Some(Code::SessionTaken))
    }
}

/// Request that was sent and not yet answered.
#[derive(Clone, Debug)]
struct PendingRequest {
    seq: u16,
    /// Host time at which the request was sent, µs.
    sent_us: u64,
    /// The request itself if an acknowledgement of it changes the setup; `None` for other requests.
    configures: Option<Request>,
}

/// Host's end of one session: numbers requests, frames them, and sorts the device's answers. It
/// never reads a clock; every time is an argument.
///
/// ```
/// use host_core::link::{Client, Incoming};
/// use firmware::link::Request;
///
/// let mut client = Client::default();
/// let (number, frame) = client.hello(1_000); // send Client::BREAK and these bytes
/// assert_eq!(frame.last(), Some(&0)); // ends the frame
/// client.receive(b"", 2_000)?; // and hand over what it sends, with the host's time
/// assert!(client.take_message().is_none());
/// let (keep_alive, _) = client.request(Request::KeepAlive, 3_000)?;
/// assert_eq!(keep_alive, number + 1);
/// # Ok::<(), host_core::link::Error>(())
/// ```
#[derive(Default)]
pub struct Client {
    decoder: Decoder,
    session: u16,
    numbers: Numbers,
    clock: Clock,
    /// Number of the latest `Hello` while its answer is awaited; `None` otherwise.
    opening: Option<u16>,
    awaited: VecDeque<PendingRequest>,
    incoming: VecDeque<Incoming>,
    /// Checksum of the requests by which the host has set up the device, as far as the device has
    /// acknowledged them.
    setup: SetupSum,
}

impl Client {
    /// Delimiter to send before a `Hello`. It ends a frame that an earlier host may have left
    /// incomplete.
    pub const BREAK: [u8; 1] = [0];

    /// Opens a session, or opens it again after a reset. Returns the number of the request and the
    /// bytes to send after [`Self::BREAK`] at `now_us`, host time in µs. The answer is an
    /// [`Incoming::Hello`] or a refusal. Messages that arrive before the answer were meant for an
    /// earlier host and are dropped.
    pub fn hello(&mut self, now_us: u64) -> (u16, Vec<u8>) {
        self.awaited.clear();
        let (seq, request) = (self.numbers.next(), Request::Hello { schema: SCHEMA });
        let frame = frame_request(self.session, seq, request).unwrap_or_default(); // always fits
        self.opening = Some(seq);
        self.await_answer(seq, now_us, None);
        (seq, frame)
    }

    /// Numbers and frames `request`. Returns its number and the bytes to send at `now_us`, host
    /// time in µs.
    ///
    /// # Errors
    /// [`Error::TooLarge`]: the request does not fit a frame.
    pub fn request(&mut self, request: Request, now_us: u64) -> Result<(u16, Vec<u8>), Error> {
        let configures = SetupSum::is_setup_request(&request).then(|| request.clone());
        let seq = self.numbers.next();
        let frame = frame_request(self.session, seq, request).ok_or(Error::TooLarge("request"))?;
        self.await_answer(seq, now_us, configures);
        Ok((seq, frame))
    }

    /// Returns the request that arms the device. It carries a checksum of the setup that the
    /// requests acknowledged so far have made, and the device refuses to arm any other setup.
    #[must_use]
    pub fn arm_request(&self) -> Request {
        let setup = self.setup.total();
        Request::Arm { setup }
    }

    fn await_answer(&mut self, seq: u16, sent_us: u64, configures: Option<Request>) {
        self.awaited.push_back(PendingRequest {
            seq,
            sent_us,
            configures,
        });
        if self.awaited.len() > MAX_AWAITED {
            self.awaited.pop_front();
        }
    }

    /// Takes bytes that arrived by `now_us`, host time in µs, and decodes the messages in them.
    /// [`Self::take_message`] then returns these messages.
    ///
    /// # Errors
    /// [`Error::OtherSchema`]: the device that answers a `Hello` speaks another version.
    pub fn receive(&mut self, bytes: &[u8], now_us: u64) -> Result<(), Error> {
        let mut rest = bytes;
        while !rest.is_empty() {
            let Some(Ok(message)) = self.decoder.push_until_delimiter(&mut rest) else {
                continue;
            };
            let device = other_schema(message, self.opening);
            let response = postcard::from_bytes::<Response<'_>>(message);
            let incoming = response
                .map(|response| to_incoming(response, |at| self.clock.unwrap_stamp(now_us, at)));
            self.decoder.clear();
            if let Some(device) = device {
                return Err(Error::OtherSchema { device });
            }
            if let Ok(incoming) = incoming {
                self.store_message(incoming, now_us);
            }
        }
        Ok(())
    }

    /// Removes and returns the oldest message that was received; `None` if there is none.
    pub fn take_message(&mut self) -> Option<Incoming> {
        self.incoming.pop_front()
    }

    /// Returns whether [`Self::take_message`] would return a message.
    #[must_use]
    pub fn has_message(&self) -> bool {
        !self.incoming.is_empty()
    }

    /// Removes and returns the answer to the request with this number, ahead of other messages;
    /// `None` if it has not arrived.
    pub fn take_answer(&mut self, seq: u16) -> Option<Incoming> {
        let is_answer = |incoming: &Incoming| {
            incoming.answered_seq() == Some(seq) || incoming.is_session_refusal()
        };
        let index = self.incoming.iter().position(is_answer)?;
        self.incoming.remove(index)
    }

    /// Estimates the device time at host time `host_us`, both in µs, from the times of the answers
    /// so far; `None` before the first answer.
    #[must_use]
    pub fn device_time(&self, host_us: u64) -> Option<u64> {
        self.clock.device_at(host_us)
    }

    /// Returns the fit of the device's clock against the host's over the whole session; `None`
    /// before the first exchange.
    #[must_use]
    pub fn clock_fit(&self) -> Option<Fit> {
        self.clock.fit()
    }

    /// Returns a copy of this end of the session in its present state. The copy and the original
    /// then continue independently of each other.
    #[must_use]
    pub fn snapshot(&self) -> Self {
        Self {
            decoder: self.decoder.clone(),
            session: self.session,
            numbers: self.numbers.fork(),
            clock: self.clock,
            opening: self.opening,
            awaited: self.awaited.clone(),
            incoming: self.incoming.clone(),
            setup: self.setup.clone(),
        }
    }

    /// Returns a function that makes keep-alive frames for this session, for a thread that sends
    /// them. Send each frame before the next is made, by the thread or by this client, so that
    /// frames leave in the order of their numbers.
    pub fn keep_alives(&self) -> impl FnMut() -> Vec<u8> + Send + 'static {
        let (session, numbers) = (self.session, self.numbers.clone());
        // A keep-alive always fits a frame.
        move || frame_request(session, numbers.next(), Request::KeepAlive).unwrap_or_default()
    }

    /// Updates the clock and the setup's checksum from an answer, and stores the message until it
    /// is taken.
    fn store_message(&mut self, incoming: Incoming, now_us: u64) {
        let seq = incoming.answered_seq();
        let asked = self
            .awaited
            .iter()
            .position(|expectation| Some(expectation.seq) == seq);
        let asked = asked.and_then(|index| self.awaited.remove(index));
        if let (Incoming::Acknowledged(_, at), Some(asked)) = (&incoming, asked) {
            self.clock.add_exchange(asked.sent_us, now_us, *at);
            if let Some(request) = &asked.configures {
                self.setup.note(request);
            }
        }
        if let Incoming::Hello(info) = &incoming {
            if seq != self.opening {
                return;
            }
            // Messages that came before the answer were meant for an earlier host.
            self.incoming.clear();
            self.awaited.clear();
            self.opening = None;
            self.session = info.session;
            self.setup = SetupSum::default();
        }
        self.incoming.push_back(incoming);
    }
}

/// Returns the schema hash in the answer to the `Hello` with number `hello`, if it differs from the
/// hash of this program. In every version of the protocol, an answer begins with its variant, the
/// number of the request, the number of the session and the schema hash. The bytes after them may
/// differ between versions.
fn other_schema(message: &[u8], hello: Option<u16>) -> Option<u64> {
    let number = hello?;
    let begin = postcard::take_from_bytes::<(u32, u16, u16, u64)>(message);
    let ((variant, seq, _, schema), _) = begin.ok()?;
    let is_hello = variant == 0 && seq == number;
    (is_hello && schema != SCHEMA).then_some(schema)
}

/// Converts a response into a message; `unwrap` extends its device time to 64 bits.
fn to_incoming(response: Response<'_>, mut unwrap: impl FnMut(Micros) -> u64) -> Incoming {
    match response {
        Response::Ack { seq, at } => Incoming::Acknowledged(seq, unwrap(at)),
        Response::Hello(info) => Incoming::Hello(Box::new(info)),
        Response::Status { seq, status } => Incoming::Status(seq, Box::new(status)),
        Response::Refused { seq, refusal } => Incoming::Refused(seq, refusal.into()),
        Response::Event { at, event } => Incoming::Event(unwrap(at), event),
        Response::Telemetry(sample) => Incoming::Telemetry(unwrap(sample.at), Box::new(sample)),
    }
}
