//! The owner of bytes: frames in, requests checked, answers out.
//!
//! What can be judged without knowing the state (ranges, limits, groups) is
//! judged here against a *draft* setup, which a host may edit at any time and
//! which arming takes as a whole. What depends on the state is judged by the
//! owner of the state, whose verdict becomes the answer.

mod requests;

use super::draft::Draft;
use super::mail::{Asked, ControlReport, ControlRequest, Report, SessionMail};
use crate::link::message::ResetCause;
use crate::link::{
    Code, Counters, Decoder, Event, Head, HelloInfo, Kind, Refusal, Request, Response, SCHEMA,
    Status, ToDevice, encode, too_long,
};
use crate::pulse::DEAD_TIME_US;
use crate::safety::{FaultRecord, Notice, State};
use crate::units::Micros;
use heapless::Deque;

/// Bytes kept for a host that is slow to read.
const OUTBOX: usize = 2048;

/// Room that telemetry leaves for answers.
const RESERVED: usize = 768;

/// Room that all else leaves for the answers to stops.
const STOP_RESERVED: usize = 128;

/// Stops whose answers wait for the pulser; of more in one window the others are
/// answered at once.
const STOPS: usize = 8;

/// What a device says of itself.
#[derive(Clone, Copy, Debug)]
pub struct Identity {
    /// What it is.
    pub kind: Kind,
    /// 96-bit unique number of the chip; zero in simulators.
    pub unique_id: [u32; 3],
    /// Why it last reset.
    pub reset: ResetCause,
    /// Fault that the reset found recorded.
    pub last_fault: Option<FaultRecord>,
    /// Number of the first session, [`first_session`] or any; 0 counts as 1.
    pub first_session: u16,
}

/// Where session numbers begin: a number that another host does not hit by
/// chance. It is told to whoever asks by `Hello`, and so is no secret.
#[must_use]
pub fn first_session(seed: &[u32]) -> u16 {
    // FNV-1a, folded.
    let hash = seed.iter().fold(0x811C_9DC5_u32, |hash, &word| {
        let bytes = word.to_le_bytes().into_iter();
        bytes.fold(hash, |hash, byte| {
            (hash ^ u32::from(byte)).wrapping_mul(0x0100_0193)
        })
    });
    ((hash >> 16 ^ hash) as u16).max(1) // its low half
}

/// Owns the link and the draft.
#[derive(Debug)]
pub struct Session {
    identity: Identity,
    decoder: Decoder,
    outbox: Deque<u8, OUTBOX>,
    owner: Option<u16>,
    last_session: u16,
    expected: Option<u16>,
    state: State,
    draft: Draft,
    counters: Counters,
    /// Number of each stop not yet answered, and the count at which it was raised.
    stops: Deque<(u16, u32), STOPS>,
}

type Answer = Result<Reply, Refusal<'static>>;

enum Reply {
    /// Carried out.
    Done,
    /// Another owner answers.
    Later,
}

impl Session {
    /// A session owner without a session.
    #[must_use]
    pub fn new(identity: Identity) -> Self {
        Self {
            identity,
            decoder: Decoder::default(),
            outbox: Deque::new(),
            owner: None,
            last_session: identity.first_session.saturating_sub(1),
            expected: None,
            state: if identity.last_fault.is_some() {
                State::Fault
            } else {
                State::Idle
            },
            draft: Draft::default(),
            counters: Counters::default(),
            stops: Deque::new(),
        }
    }

    /// Takes bytes that arrived at `now`.
    pub fn receive(&mut self, now: Micros, bytes: &[u8], mail: &mut SessionMail<'_>) {
        for &byte in bytes {
            let message = match self.decoder.push(byte) {
                None => continue,
                Some(Ok(message)) => read(message),
                Some(Err(e)) => Err((None, e.into())),
            };
            self.decoder.clear();
            match message {
                Ok(message) => self.serve(now, message, mail),
                Err((Some(head), refusal)) => {
                    self.counters.frames = self.counters.frames.saturating_add(1);
                    let admitted = self.admit(head.session, head.seq);
                    self.refuse(Some(head.seq), admitted.err().unwrap_or(refusal));
                }
                Err((None, refusal)) => {
                    self.counters.bad_frames = self.counters.bad_frames.saturating_add(1);
                    self.refuse(None, refusal);
                }
            }
        }
    }

    /// Carries the other owners' reports to the host.
    pub fn poll(&mut self, mail: &mut SessionMail<'_>) {
        self.counters.lost_posts = mail.lost.count();
        while let Some(report) = mail.reports.dequeue() {
            self.pass_on(report);
        }
        while let Some(report) = mail.control_reports.dequeue() {
            match report {
                ControlReport::Verdict {
                    seq,
                    at,
                    result,
                    setpoint,
                } => self.verdict(seq, at, result, setpoint),
                ControlReport::Telemetry(sample) => {
                    if self.outbox.len() + RESERVED < OUTBOX {
                        self.say(&Response::Telemetry(sample));
                    } else {
                        self.counters.dropped = self.counters.dropped.saturating_add(1);
                    }
                }
            }
        }
    }

    /// Moves up to `buffer.len()` bytes for the host into `buffer`.
    pub fn transmit(&mut self, buffer: &mut [u8]) -> usize {
        let mut count = 0;
        for slot in buffer {
            let Some(byte) = self.outbox.pop_front() else {
                break;
            };
            *slot = byte;
            count += 1;
        }
        count
    }

    /// Whether bytes for the host wait.
    #[must_use]
    pub fn has_output(&self) -> bool {
        !self.outbox.is_empty()
    }

    fn serve(&mut self, now: Micros, message: ToDevice, mail: &mut SessionMail<'_>) {
        self.counters.frames = self.counters.frames.saturating_add(1);
        let seq = message.seq;
        if let Request::Hello { schema } = message.request {
            match self.open(now, seq, message.session, schema, mail) {
                Ok(info) => self.say(&Response::Hello(info)),
                Err(refusal) => self.refuse(Some(seq), refusal),
            }
            return;
        }
        let admitted = self.admit(message.session, seq);
        if let Request::Stop = message.request {
            // Whoever it is: stopping is never refused.
            self.stop(now, seq, mail);
            return;
        }
        let answer = admitted.and_then(|()| self.answer(now, seq, message.request, mail));
        match answer {
            Ok(Reply::Done) => self.say(&Response::Ack { seq, at: now }),
            Ok(Reply::Later) => {}
            Err(refusal) => self.refuse(Some(seq), refusal),
        }
    }

    /// Raises the flag that the pulser sees before all orders, and that makes void
    /// what was posted before.
    fn stop(&mut self, now: Micros, seq: u16, mail: &SessionMail<'_>) {
        let raised = mail.stop.raise();
        if self.stops.push_back((seq, raised)).is_err() {
            self.say_stopped(seq, now); // it is as good as done
        }
    }

    /// Answers the stops that are carried out.
    fn stopped(&mut self, stops: u32, at: Micros) {
        // Counts wrap; no more than a few lie between two that are compared.
        let is_done = |(_, raised): &(u16, u32)| stops.wrapping_sub(*raised) < 1 << 31;
        while self.stops.front().is_some_and(is_done) {
            let Some((seq, _)) = self.stops.pop_front() else {
                break;
            };
            self.say_stopped(seq, at);
        }
    }

    /// Opens a session, which begins without a subscription.
    fn open(
        &mut self,
        now: Micros,
        seq: u16,
        session: u16,
        schema: u64,
        mail: &mut SessionMail<'_>,
    ) -> Result<HelloInfo, Refusal<'static>> {
        if !mail.has_room_for_request() {
            return Err(busy()); // or the old one would go on
        }
        // An arm order under way is as good as armed.
        let info = self.hello(now, seq, session, schema, is_arming(mail))?;
        ask(ControlRequest::Subscribe(0), mail)?;
        Ok(info)
    }

    fn hello(
        &mut self,
        now: Micros,
        seq: u16,
        session: u16,
        schema: u64,
        is_arming: bool,
    ) -> Result<HelloInfo, Refusal<'static>> {
        if schema != SCHEMA {
            return Err(Refusal::new(Code::SchemaMismatch, "schema"));
        }
        let busy = matches!(
            self.state,
            State::Armed | State::Stimulating | State::Stopping
        );
        if (busy || is_arming) && self.owner.is_some_and(|owner| owner != session) {
            return Err(Refusal::new(Code::SessionTaken, "session"));
        }
        self.last_session = self.last_session.checked_add(1).unwrap_or(1);
        self.owner = Some(self.last_session);
        self.expected = Some(seq.wrapping_add(1));
        self.draft.clear();
        Ok(HelloInfo {
            seq,
            session: self.last_session,
            schema: SCHEMA,
            version: [0, 1, 0],
            kind: self.identity.kind,
            unique_id: self.identity.unique_id,
            at: now,
            state: self.state,
            reset: self.identity.reset,
            last_fault: self.identity.last_fault,
            dead_time_us: DEAD_TIME_US,
        })
    }

    /// Only the session's owner is heard; gaps in its numbers are losses.
    fn admit(&mut self, session: u16, seq: u16) -> Result<(), Refusal<'static>> {
        if self.owner != Some(session) {
            self.counters.strangers = self.counters.strangers.saturating_add(1);
            let code = match self.owner {
                None => Code::NoSession,
                Some(_) => Code::SessionTaken,
            };
            return Err(Refusal::new(code, "session"));
        }
        let gap = seq.wrapping_sub(self.expected.unwrap_or(seq));
        // A number from before is late or doubled; no gap follows it.
        if gap < 1 << 15 {
            self.counters.lost = self.counters.lost.saturating_add(gap.into());
            self.expected = Some(seq.wrapping_add(1));
        }
        Ok(())
    }

    fn pass_on(&mut self, report: Report) {
        match report {
            Report::Verdict {
                seq,
                at,
                result,
                setpoint,
                state,
            } => {
                self.state = state;
                self.verdict(seq, at, result.map_err(Refusal::from), setpoint);
            }
            Report::Stopped { stops, at, state } => {
                self.state = state;
                self.stopped(stops, at);
            }
            Report::Status {
                seq,
                at,
                state,
                pulses,
                idle_triggers,
                fault,
            } => {
                self.state = state;
                let counters = Counters {
                    pulses,
                    idle_triggers,
                    ..self.counters
                };
                self.say(&Response::Status {
                    seq,
                    status: Status {
                        at,
                        state,
                        fault,
                        counters,
                    },
                });
            }
            Report::Changed { at, state, notice } => {
                self.state = state;
                let event = match notice {
                    Notice::Checked(_) => return, // answered as a verdict
                    Notice::Stopping(cause) => Event::Stopping(cause),
                    Notice::Idle(cause) => Event::Stopped(cause),
                    Notice::Faulted(record) => {
                        self.identity.last_fault = Some(record);
                        Event::Faulted(record)
                    }
                    Notice::Recovered => Event::Recovered,
                };
                self.say(&Response::Event { at, event });
            }
        }
    }

    fn verdict(
        &mut self,
        seq: u16,
        at: Micros,
        result: Result<(), Refusal<'static>>,
        setpoint: bool,
    ) {
        match result {
            Ok(()) => {
                self.counters.setpoints = self.counters.setpoints.saturating_add(setpoint.into());
                self.say(&Response::Ack { seq, at });
            }
            Err(refusal) => self.refuse(Some(seq), refusal),
        }
    }

    fn refuse(&mut self, seq: Option<u16>, refusal: Refusal<'static>) {
        self.counters.refused = self.counters.refused.saturating_add(1);
        self.say(&Response::Refused { seq, refusal });
    }

    fn say_stopped(&mut self, seq: u16, at: Micros) {
        self.say_within(OUTBOX, &Response::Ack { seq, at });
    }

    fn say(&mut self, response: &Response<'_>) {
        self.say_within(OUTBOX - STOP_RESERVED, response);
    }

    /// Queues a whole message or, if the host does not read, none of it.
    fn say_within(&mut self, room: usize, response: &Response<'_>) {
        match encode(response) {
            Some(frame) if self.outbox.len() + frame.len() <= room => {
                for byte in frame {
                    let _ = self.outbox.push_back(byte); // room was just checked
                }
            }
            _ => self.counters.dropped = self.counters.dropped.saturating_add(1),
        }
    }
}

/// The request in a message; or why there is none, and whose it would have been
/// if that can be told.
fn read(message: &[u8]) -> Result<ToDevice, (Option<Head>, Refusal<'static>)> {
    match postcard::take_from_bytes(message) {
        Ok((request, [])) => Ok(request),
        _ => Err(match too_long(message) {
            Some((head, refusal)) => (Some(head), refusal),
            None => (None, Refusal::new(Code::UnknownMessage, "request")),
        }),
    }
}

/// Whether an arm order is under way: the controller has not taken or dropped its
/// parts yet.
fn is_arming(mail: &SessionMail<'_>) -> bool {
    !mail.control_parts.is_empty()
}

fn send<T>(mailbox: &mut heapless::spsc::Producer<'_, T>, item: T) -> Result<(), Refusal<'static>> {
    mailbox.enqueue(item).map_err(|_| busy())
}

/// Asks the controller, if it can answer; after the stops raised so far.
fn ask(request: ControlRequest, mail: &mut SessionMail<'_>) -> Result<(), Refusal<'static>> {
    if !mail.has_room_for_request() {
        return Err(busy());
    }
    let stops = mail.stop.raised();
    send(&mut mail.control_requests, Asked { stops, request })
}

fn busy() -> Refusal<'static> {
    Refusal::new(Code::DeviceBusy, "device")
}
