//! The owner of bytes: frames in, requests checked, answers out.
//!
//! What can be judged without knowing the state (ranges, limits, groups) is
//! judged here against a *draft* setup, which a host may edit at any time and
//! which arming takes as a whole. What depends on the state is judged by the
//! owner of the state, whose verdict becomes the answer.

mod requests;

use super::draft::Draft;
use super::mail::{ControlReport, ControlRequest, Report, SessionMail};
use crate::link::message::ResetCause;
use crate::link::{
    Code, Counters, Decoder, Event, HelloInfo, Kind, Refusal, Request, Response, SCHEMA, Status,
    ToDevice, encode,
};
use crate::pulse::DEAD_TIME_US;
use crate::safety::{FaultRecord, Notice, State};
use crate::units::Micros;
use heapless::Deque;

/// Bytes kept for a host that is slow to read.
const OUTBOX: usize = 2048;

/// Room that telemetry leaves for answers.
const RESERVED: usize = 768;

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
            last_session: 0,
            expected: None,
            state: if identity.last_fault.is_some() {
                State::Fault
            } else {
                State::Idle
            },
            draft: Draft::default(),
            counters: Counters::default(),
        }
    }

    /// Takes bytes that arrived at `now`.
    pub fn receive(&mut self, now: Micros, bytes: &[u8], mail: &mut SessionMail<'_>) {
        for &byte in bytes {
            let message = match self.decoder.push(byte) {
                None => continue,
                Some(Ok(message)) => postcard::take_from_bytes::<ToDevice>(message)
                    .ok()
                    .filter(|(_, rest)| rest.is_empty())
                    .map(|(message, _)| message)
                    .ok_or(Refusal::new(Code::UnknownMessage, "request")),
                Some(Err(e)) => Err(Refusal::from(e)),
            };
            self.decoder.clear();
            match message {
                Ok(message) => self.serve(now, message, mail),
                Err(refusal) => {
                    self.counters.bad_frames = self.counters.bad_frames.saturating_add(1);
                    self.refuse(None, refusal);
                }
            }
        }
    }

    /// Carries the other owners' reports to the host.
    pub fn poll(&mut self, mail: &mut SessionMail<'_>) {
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
            // An arm order under way is as good as armed.
            match self.hello(now, seq, message.session, schema, is_arming(mail)) {
                Ok(info) => {
                    // A session begins without a subscription.
                    let _ = send(&mut mail.control_requests, ControlRequest::Subscribe(0));
                    self.say(&Response::Hello(info));
                }
                Err(refusal) => self.refuse(Some(seq), refusal),
            }
            return;
        }
        let answer = self
            .admit(message.session, seq)
            .and_then(|()| self.answer(now, seq, message.request, mail));
        match answer {
            Ok(Reply::Done) => self.say(&Response::Ack { seq, at: now }),
            Ok(Reply::Later) => {}
            Err(refusal) => self.refuse(Some(seq), refusal),
        }
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
        match self.owner {
            None => return Err(Refusal::new(Code::NoSession, "session")),
            Some(owner) if owner != session => {
                return Err(Refusal::new(Code::SessionTaken, "session"));
            }
            Some(_) => {}
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

    /// Queues a whole message or, if the host does not read, none of it.
    fn say(&mut self, response: &Response<'_>) {
        match encode(response) {
            Some(frame) if self.outbox.len() + frame.len() <= OUTBOX => {
                for byte in frame {
                    let _ = self.outbox.push_back(byte); // room was just checked
                }
            }
            _ => self.counters.dropped = self.counters.dropped.saturating_add(1),
        }
    }
}

/// Whether an arm order is under way: the controller has not taken or dropped its
/// parts yet.
fn is_arming(mail: &SessionMail<'_>) -> bool {
    mail.control_parts.len() > 0
}

fn send<T>(mailbox: &mut heapless::spsc::Producer<'_, T>, item: T) -> Result<(), Refusal<'static>> {
    mailbox
        .enqueue(item)
        .map_err(|_| Refusal::new(Code::DeviceBusy, "device"))
}
