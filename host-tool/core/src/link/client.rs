//! A host's view of one device.

use super::clock::{Clock, Fit};
use super::{Error, Interruption, Keeper, Port, Refused};
use firmware::link::{
    Code, Decoder, Event, HelloInfo, Request, Response, SCHEMA, SetupSum, Status, Telemetry,
    ToDevice, encode,
};
use firmware::units::Micros;
use std::collections::VecDeque;
use std::io::Write;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// How long an ordinary answer may take, µs.
const ANSWER_US: u64 = 500_000;

/// Posted requests whose answers are still awaited, at most.
const MAX_AWAITED: usize = 256;

/// A look at the port that ends so much later than asked for, µs, shows that this computer
/// stalled.
const STALL_US: u64 = 20_000;

/// Longest wait between two looks for a signal, µs of port time; a multiple of
/// the steps in which virtual time goes on, so that it changes nothing there.
const POLL_US: u64 = 2_000;

/// What arrived without being waited for. Device times are in 64 bits, µs, and do
/// not wrap; [`stamp`](super::stamp) gives the device's own.
#[derive(Clone, Debug)]
pub enum Incoming {
    /// A telemetry sample with its device time.
    Telemetry(u64, Box<Telemetry>),
    /// An event with its device time.
    Event(u64, Event),
    /// A posted request was carried out, at this device time.
    Acknowledged(u16, u64),
    /// The answer to a posted [`Request::Status`].
    Status(Box<Status>),
    /// A posted request, or a frame (`None`), was refused.
    Refused(Option<u16>, Refused),
}

enum Answer {
    /// At this device time, µs.
    Ack(u64),
    Hello(Box<HelloInfo>),
    Status(Box<Status>),
    Refused(Refused),
}

/// The number of the request whose answer is waited for, and when it was sent, µs.
type Wanted = Option<(u16, u64)>;

/// A session with a device.
pub struct Client<P> {
    port: P,
    decoder: Decoder,
    session: u16,
    numbers: Numbers,
    keeper: Option<Keeper>,
    clock: Clock,
    awaited: VecDeque<(u16, u64)>,
    incoming: VecDeque<Incoming>,
    interruption: Option<Interruption>,
    /// Of what the device has accepted.
    setup: SetupSum,
}

impl<P: Port> Client<P> {
    /// Opens a session through `port`.
    ///
    /// # Errors
    /// The device refuses (another schema, another host) or does not answer.
    pub fn open(port: P) -> Result<(Self, HelloInfo), Error> {
        Self::open_interruptible(port, None)
    }

    /// The same, and every wait ends soon after a signal, with
    /// [`Error::Interrupted`]. What to stop is the caller's to decide.
    ///
    /// # Errors
    /// As [`Client::open`], and the signal.
    pub fn open_interruptible(
        port: P,
        interruption: Option<Interruption>,
    ) -> Result<(Self, HelloInfo), Error> {
        let mut client = Self {
            port,
            decoder: Decoder::default(),
            session: 0,
            numbers: Numbers::default(),
            keeper: None,
            clock: Clock::default(),
            awaited: VecDeque::new(),
            incoming: VecDeque::new(),
            interruption,
            setup: SetupSum::default(),
        };
        let info = client.hello()?;
        Ok((client, info))
    }

    /// Opens the session again, for instance after a reset.
    ///
    /// # Errors
    /// As [`Client::open`].
    pub fn hello(&mut self) -> Result<HelloInfo, Error> {
        self.keeper = None; // it speaks in the session before
        // Ends what an earlier host may have left half said.
        self.port.send(&[0])?;
        let sent_us = self.port.now_us();
        let seq = self.send("Hello", Request::Hello { schema: SCHEMA })?;
        match self.answer((seq, sent_us))? {
            Some(Answer::Hello(info)) => {
                // What came before it was meant for an earlier host.
                self.incoming.clear();
                self.awaited.clear();
                self.session = info.session;
                self.setup = SetupSum::default();
                Ok(*info)
            }
            Some(Answer::Refused(refused)) => Err(Error::Refused(refused)),
            _ => Err(no_answer("Hello")),
        }
    }

    /// From now on waits last as long as they must: for the answer to a stop.
    pub fn ignore_signals(&mut self) {
        self.interruption = None;
    }

    /// The port.
    pub fn port(&mut self) -> &mut P {
        &mut self.port
    }

    /// From now on a thread of its own tells the device every `period` that the host is
    /// alive, as long as [`Self::next`] is called. Whether it does: where time is virtual,
    /// the caller must.
    ///
    /// # Errors
    /// [`Error::Lost`]: the port, or the system gives no thread.
    pub fn keep_alive_apart(&mut self, period: Duration) -> Result<bool, Error> {
        let Some(mut outlet) = self.port.outlet()? else {
            return Ok(false);
        };
        let (session, numbers) = (self.session, self.numbers.clone());
        let send = move || {
            let mut seq = numbers.next();
            let request = Request::KeepAlive;
            // Always fits.
            let frame = framed(session, &mut seq, request).unwrap_or_default();
            outlet.write_all(&frame)
        };
        self.keeper = Some(Keeper::start(period, send)?);
        Ok(true)
    }

    /// What sends keep-alives by itself, if something does.
    pub const fn keeper(&self) -> Option<&Keeper> {
        self.keeper.as_ref()
    }

    /// Gives the port back; the device notices silence.
    pub fn into_port(self) -> P {
        self.port
    }

    /// Device time at host time `host_us`, µs, as far as answers tell.
    pub fn device_time(&self, host_us: u64) -> Option<u64> {
        self.clock.device_at(host_us)
    }

    /// The device's clock against the host's, over the whole session.
    pub fn clock_fit(&self) -> Option<Fit> {
        self.clock.fit()
    }

    /// Asks for state, faults and counters.
    ///
    /// # Errors
    /// [`Error`].
    pub fn status(&mut self) -> Result<Status, Error> {
        match self.call("Status", Request::Status)? {
            Answer::Status(status) => Ok(*status),
            _ => Err(no_answer("Status")),
        }
    }

    /// Sends a request without waiting; its answer comes as [`Incoming`]. Not for what
    /// configures: [`Self::arm`] does not know of it.
    ///
    /// # Errors
    /// [`Error::Lost`], [`Error::TooLarge`].
    pub fn post(&mut self, request: Request) -> Result<u16, Error> {
        let seq = self.send("request", request)?;
        self.awaited.push_back((seq, self.port.now_us()));
        if self.awaited.len() > MAX_AWAITED {
            self.awaited.pop_front();
        }
        Ok(seq)
    }

    /// The next message that nobody waits for, by `until_us` at the latest.
    ///
    /// # Errors
    /// [`Error::Lost`].
    pub fn next(&mut self, until_us: u64) -> Result<Option<Incoming>, Error> {
        loop {
            if let Some(keeper) = &self.keeper {
                keeper.attend();
            }
            if let Some(incoming) = self.incoming.pop_front() {
                return Ok(Some(incoming));
            }
            self.receive(until_us, None)?;
            if self.incoming.is_empty() && self.port.now_us() >= until_us {
                return Ok(None);
            }
        }
    }

    /// Sends `request`, called `name` in errors, and waits for its acknowledgement:
    /// the device time of it, µs.
    pub(super) fn ack(&mut self, name: &'static str, request: Request) -> Result<u64, Error> {
        let said = request.clone();
        match self.call(name, request)? {
            Answer::Ack(at) => {
                self.setup.note(&said);
                Ok(at)
            }
            _ => Err(no_answer(name)),
        }
    }

    /// Checks the draft and the electrodes, and arms: the setup that the requests
    /// acknowledged so far come to, and no other.
    ///
    /// # Errors
    /// Refused, not answered, or the device is lost.
    pub fn arm(&mut self) -> Result<u64, Error> {
        let setup = self.setup.total();
        self.ack("Arm", Request::Arm { setup })
    }

    fn call(&mut self, name: &'static str, request: Request) -> Result<Answer, Error> {
        let sent_us = self.port.now_us();
        let seq = self.send(name, request)?;
        match self.answer((seq, sent_us))? {
            Some(Answer::Refused(refused)) => Err(Error::Refused(refused)),
            Some(answer) => Ok(answer),
            None => Err(no_answer(name)),
        }
    }

    /// The answer to the request of this number, sent at this time; none within
    /// [`ANSWER_US`]. Time in which this computer did not look does not count.
    fn answer(&mut self, wanted: (u16, u64)) -> Result<Option<Answer>, Error> {
        let (mut look_us, mut until_us) = (wanted.1, wanted.1 + ANSWER_US);
        loop {
            let now_us = self.port.now_us();
            let late_us = now_us.saturating_sub(look_us);
            if late_us > STALL_US {
                until_us += late_us;
            }
            if now_us >= until_us {
                return Ok(None);
            }
            look_us = until_us.min(now_us + POLL_US);
            if let Some(answer) = self.receive(look_us, Some(wanted))? {
                return Ok(Some(answer));
            }
        }
    }

    fn send(&mut self, name: &'static str, request: Request) -> Result<u16, Error> {
        let mut next = self.numbers.next();
        let seq = *next;
        let frame = framed(self.session, &mut next, request).ok_or(Error::TooLarge(name))?;
        self.port.send(&frame)?;
        Ok(seq)
    }

    /// How long to wait at most before the next look for a signal.
    fn poll_signal(&mut self, until_us: u64) -> Result<u64, Error> {
        let Some(interruption) = &self.interruption else {
            return Ok(until_us);
        };
        if let Some(signal) = interruption.asked() {
            return Err(Error::Interrupted(signal));
        }
        Ok(until_us.min(self.port.now_us() + POLL_US))
    }

    /// Takes what arrives by `until_us`, or none before that; returns the answer
    /// to `wanted`.
    fn receive(&mut self, until_us: u64, wanted: Wanted) -> Result<Option<Answer>, Error> {
        let until_us = self.poll_signal(until_us)?;
        let bytes = self.port.receive(until_us)?;
        let now_us = self.port.now_us();
        let mut answer = None;
        let mut rest = bytes.as_slice();
        while !rest.is_empty() {
            let Some(Ok(message)) = self.decoder.take(&mut rest) else {
                continue;
            };
            let response = postcard::from_bytes::<Response<'_>>(message);
            let sorted = response.map(|it| sort(it, |at| self.clock.unwrap(now_us, at)));
            self.decoder.clear();
            if let Ok(sorted) = sorted {
                answer = self.dispatch(sorted, wanted, now_us).or(answer);
            }
        }
        Ok(answer)
    }

    /// The answer waited for; any other message goes to the incoming ones.
    fn dispatch(&mut self, sorted: Sorted, wanted: Wanted, now_us: u64) -> Option<Answer> {
        let (seq, answer) = match sorted {
            Sorted::Answer(seq, answer) => (seq, answer),
            Sorted::Other(other) => {
                self.incoming.push_back(other);
                return None;
            }
        };
        let posted = self.awaited.iter().position(|(s, _)| Some(*s) == seq);
        let sent_us = match (posted, wanted) {
            (Some(index), _) => self.awaited.remove(index).map(|(_, sent)| sent),
            (None, Some((s, sent))) if Some(s) == seq => Some(sent),
            _ => None,
        };
        if let (Answer::Ack(at), Some(sent_us)) = (&answer, sent_us) {
            self.clock.observe(sent_us, now_us, *at);
        }
        // Who serves another host turns this one away before it hears a number.
        let turned_away = seq.is_none() && is_session_taken(&answer);
        if posted.is_none() && wanted.is_some_and(|(s, _)| Some(s) == seq || turned_away) {
            return Some(answer);
        }
        self.incoming.extend(match answer {
            Answer::Ack(at) => seq.map(|seq| Incoming::Acknowledged(seq, at)),
            Answer::Refused(refused) => Some(Incoming::Refused(seq, refused)),
            Answer::Status(status) => Some(Incoming::Status(status)),
            Answer::Hello(_) => None,
        });
        None
    }
}

/// The number of the next request. Whoever has it sends: one frame at a time, in the order
/// of numbers.
#[derive(Clone, Default)]
struct Numbers(Arc<Mutex<u16>>);

impl Numbers {
    fn next(&self) -> MutexGuard<'_, u16> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// A request as it is sent, with the next number.
fn framed(session: u16, next: &mut u16, request: Request) -> Option<Vec<u8>> {
    let seq = *next;
    *next = seq.wrapping_add(1);
    let message = ToDevice {
        session,
        seq,
        request,
    };
    encode(&message).map(|frame| frame.to_vec())
}

enum Sorted {
    Answer(Option<u16>, Answer),
    Other(Incoming),
}

/// What kind of message it is; `unwrap` gives device times in 64 bits.
fn sort(response: Response<'_>, mut unwrap: impl FnMut(Micros) -> u64) -> Sorted {
    match response {
        Response::Ack { seq, at } => Sorted::Answer(Some(seq), Answer::Ack(unwrap(at))),
        Response::Hello(info) => Sorted::Answer(Some(info.seq), Answer::Hello(Box::new(info))),
        Response::Status { seq, status } => {
            Sorted::Answer(Some(seq), Answer::Status(Box::new(status)))
        }
        Response::Refused { seq, refusal } => Sorted::Answer(seq, Answer::Refused(refusal.into())),
        Response::Event { at, event } => Sorted::Other(Incoming::Event(unwrap(at), event)),
        Response::Telemetry(sample) => {
            Sorted::Other(Incoming::Telemetry(unwrap(sample.at), Box::new(sample)))
        }
    }
}

fn is_session_taken(answer: &Answer) -> bool {
    matches!(answer, Answer::Refused(refused) if refused.code() == Some(Code::SessionTaken))
}

fn no_answer(request: &'static str) -> Error {
    let waited_ms = ANSWER_US / 1000;
    Error::NoAnswer { request, waited_ms }
}
