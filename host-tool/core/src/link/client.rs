//! A host's view of one device.

use super::clock::{Clock, Fit};
use super::numbers::{Numbers, framed};
use super::stall::Stalls;
use super::{Error, Interruption, Keeper, Port, Refused};
use firmware::link::{
    Code, Decoder, Event, HelloInfo, Request, Response, SCHEMA, SetupSum, Status, Telemetry,
};
use firmware::units::Micros;
use std::collections::VecDeque;
use std::io::Write;
use std::time::Duration;

/// How long an ordinary answer may take, µs.
const ANSWER_US: u64 = 500_000;

/// Posted requests whose answers are still awaited, at most.
const MAX_AWAITED: usize = 256;

/// Longest wait between two looks for a signal or a stall, µs of port time; a multiple
/// of the steps in which virtual time goes on, so that it changes nothing there.
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
    /// When the port was last asked for bytes, µs.
    asked_us: Option<u64>,
    stalls: Stalls,
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
            asked_us: None,
            stalls: Stalls::default(),
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
        let request = Request::Hello { schema: SCHEMA };
        let is_hello = |answer: &Answer| matches!(answer, Answer::Hello(_));
        let Answer::Hello(info) = self.answer("Hello", request, is_hello)? else {
            return Err(no_answer("Hello"));
        };
        // What came before it was meant for an earlier host.
        self.incoming.clear();
        self.awaited.clear();
        self.session = info.session;
        self.setup = SetupSum::default();
        Ok(*info)
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

    /// The next message that nobody waits for, by `until_us` at the latest: asked again
    /// and again, it says `None` soon after that, however many messages come.
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
            // What had come by then was taken: more would have no end if the device has none.
            if self.asked_us.is_some_and(|asked_us| asked_us >= until_us) {
                return Ok(None);
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
        self.answer(name, request, |_| true)
    }

    /// Sends `request` and waits for its answer. The time in which this computer does not
    /// run the program is not the device's: it has as much longer.
    fn answer(
        &mut self,
        name: &'static str,
        request: Request,
        is_answer: impl Fn(&Answer) -> bool,
    ) -> Result<Answer, Error> {
        let sent_us = self.port.now_us();
        self.stalls.look(sent_us, 0);
        let before_us = self.stalls.sum_us();
        let seq = self.send(name, request)?;
        loop {
            let stalled_us = self.stalls.sum_us() - before_us;
            let until_us = sent_us + ANSWER_US + stalled_us;
            if self.port.now_us() >= until_us {
                return Err(match stalled_us >= ANSWER_US {
                    true => host_stalled(stalled_us, &format!("no answer to {name} came then")),
                    false => no_answer(name),
                });
            }
            match self.receive(until_us, Some((seq, sent_us)))? {
                Some(Answer::Refused(refused)) => return Err(Error::Refused(refused)),
                Some(answer) if is_answer(&answer) => return Ok(answer),
                _ => {}
            }
        }
    }

    /// The longest time of the last two seconds in which this computer did not run the
    /// program, as far as the port shows, µs; 0 for none above 10 ms.
    pub fn stalled_us(&mut self) -> u64 {
        let now_us = self.port.now_us();
        self.stalls.recent_us(now_us)
    }

    /// The sum of all such times since the client was opened, µs.
    pub(crate) fn stalled_in_sum_us(&self) -> u64 {
        self.stalls.sum_us()
    }

    fn send(&mut self, name: &'static str, request: Request) -> Result<u16, Error> {
        let mut next = self.numbers.next();
        let seq = *next;
        let frame = framed(self.session, &mut next, request).ok_or(Error::TooLarge(name))?;
        self.port.send(&frame)?;
        Ok(seq)
    }

    /// Whether to go on waiting.
    fn heed_signal(&self) -> Result<(), Error> {
        let asked = self.interruption.as_ref().and_then(Interruption::asked);
        asked.map_or(Ok(()), |signal| Err(Error::Interrupted(signal)))
    }

    /// Bytes by `until_us`, or none before that: after [`POLL_US`] signals and stalls are
    /// looked for.
    fn look(&mut self, until_us: u64) -> Result<Vec<u8>, Error> {
        self.heed_signal()?;
        let now_us = self.port.now_us();
        self.stalls.look(now_us, 0);
        self.asked_us = Some(now_us);
        let until_us = until_us.min(now_us + POLL_US);
        let received = self.port.receive(until_us);
        let now_us = self.port.now_us();
        self.stalls.look(now_us, until_us);
        received.map_err(|error| match self.stalls.recent_us(now_us) {
            stalled_us @ ANSWER_US.. => {
                host_stalled(stalled_us, &format!("the connection broke ({error})"))
            }
            _ => error.into(),
        })
    }

    /// Takes what arrives by `until_us`, or none before that; returns the answer
    /// to `wanted`.
    fn receive(&mut self, until_us: u64, wanted: Wanted) -> Result<Option<Answer>, Error> {
        let bytes = self.look(until_us)?;
        let now_us = self.port.now_us();
        let mut answer = None;
        let mut rest = bytes.as_slice();
        while !rest.is_empty() {
            let Some(Ok(message)) = self.decoder.take(&mut rest) else {
                continue;
            };
            let device = other_schema(message, wanted);
            let response = postcard::from_bytes::<Response<'_>>(message);
            let sorted = response.map(|it| sort(it, |at| self.clock.unwrap(now_us, at)));
            self.decoder.clear();
            if let Some(device) = device {
                return Err(Error::OtherSchema { device });
            }
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

/// The schema hash in the answer to a `Hello`, if it is not this program's. Before it come
/// the variant, the request's number and the session's in every version; what comes behind
/// it may be read otherwise than it was meant.
fn other_schema(message: &[u8], wanted: Wanted) -> Option<u64> {
    let (number, _) = wanted?;
    let begin = postcard::take_from_bytes::<(u32, u16, u16, u64)>(message);
    let ((variant, seq, _, schema), _) = begin.ok()?;
    let is_hello = variant == 0 && seq == number;
    (is_hello && schema != SCHEMA).then_some(schema)
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

fn host_stalled(stalled_us: u64, then: &impl ToString) -> Error {
    let (stalled_ms, then) = (stalled_us / 1000, then.to_string());
    Error::HostStalled { stalled_ms, then }
}

fn no_answer(request: &'static str) -> Error {
    let waited_ms = ANSWER_US / 1000;
    Error::NoAnswer { request, waited_ms }
}
