//! The part of the device program that handles bytes: it receives frames, checks requests and
//! sends answers.
//!
//! Requests that can be judged without the state (ranges, limits, groups) are judged here with a
//! *draft* setup, which a host may edit at any time and which arming takes as a whole. Requests
//! that depend on the state are judged by the part that owns the state, and its verdict becomes
//! the answer.

mod observation;
mod opening;
mod outbox;
mod present;
mod release;
mod requests;

pub use opening::{Identity, first_session_number};
pub use release::Restart;
pub(super) use release::may_release;

use super::draft::Draft;
use super::mail::{
    AnsweredOrder, ControlMessage, ControlReport, ControlRequest, ControlVerdict, Report,
    SessionMail,
};
use crate::link::{
    Code, Counters, Decoder, Event, Part, Reading, Refusal, Request, Response, Sender, SetupSum,
    Status, encode_into, refusal_for_long_list,
};
use crate::safety::{Notice, State};
use crate::units::Micros;
use heapless::Deque;
use outbox::{Outbox, ROOM};
use present::is_recent;
use release::Release;

/// Bytes of the outbox that telemetry and edges leave free for answers.
const RESERVED: usize = 768;

/// Bytes of the outbox that all other messages leave free for the answers to stops.
const STOP_RESERVED: usize = 128;

/// Largest number of stops whose answers wait for the pulser. If more come in one window, the
/// others are answered at once, with the time of their arrival.
const STOPS: usize = 8;

/// The session of a host: it owns the link and the draft.
#[derive(Clone, Debug)]
pub struct Session {
    identity: Identity,
    decoder: Decoder,
    outbox: Outbox,
    owner: Option<u16>,
    last_session: u16,
    expected: Option<u16>,
    state: State,
    /// Number of `Start` requests that are not answered yet, and the arrival time of the latest.
    starting: Option<(u8, Micros)>,
    draft: Draft,
    /// Checksum over the requests that made the draft, as they arrived.
    setup: SetupSum,
    /// A takeover by another host, or a restart, that the pulser has not judged yet.
    release: Option<Release>,
    /// The restart that the device accepted from a host.
    restart: Option<Restart>,
    /// Whether the board's inputs allow the boot loader.
    may_enter_boot_loader: bool,
    counters: Counters,
    /// The latest refusal that nobody has taken.
    refusal: Option<Refusal<'static>>,
    /// Number of each stop that is not answered yet, and the count at which it was raised.
    stops: Deque<(u16, u32), STOPS>,
}

type Answer = Result<Reply, Refusal<'static>>;

enum Reply {
    /// The request was carried out and can be acknowledged.
    Done,
    /// Another part of the device program will answer.
    Later,
}

impl Session {
    /// Returns the handler of a link on which no host has opened a session.
    #[must_use]
    pub fn new(identity: Identity) -> Self {
        Self {
            identity,
            decoder: Decoder::default(),
            outbox: Outbox::new(),
            owner: None,
            last_session: identity.first_session.saturating_sub(1),
            expected: None,
            state: if identity.last_fault.is_some() {
                State::Fault
            } else {
                State::Idle
            },
            starting: None,
            draft: Draft::for_stages(identity.stages),
            setup: SetupSum::default(),
            release: None,
            restart: None,
            may_enter_boot_loader: false,
            counters: Counters::default(),
            refusal: None,
            stops: Deque::new(),
        }
    }

    /// Takes bytes that arrived at `now`. Every image keeps this as a separate function, so that a
    /// debugger can stop here.
    #[inline(never)]
    pub fn receive(&mut self, now: Micros, mut bytes: &[u8], mail: &mut SessionMail<'_>) {
        while !bytes.is_empty() {
            let message = match self.decoder.push_until_delimiter(&mut bytes) {
                None => continue,
                Some(Ok(message)) => message,
                Some(Err(e)) => {
                    self.decoder.clear();
                    self.refuse_undecodable(e.into());
                    continue;
                }
            };
            let mut reading = Reading::new(message);
            let sender = reading.sender();
            let request = reading.request(); // stays there
            let (decoded, long) = match (sender, &request) {
                (Ok(sender), Ok(request)) if reading.is_at_end() => (
                    Some((sender, request, Part::from_request(request, message))),
                    None,
                ),
                _ => (None, refusal_for_long_list(message)),
            };
            self.decoder.clear();
            match (decoded, long) {
                (Some((sender, request, part)), _) => self.serve(now, sender, request, part, mail),
                (None, Some((sender, refusal))) => {
                    self.counters.frames = self.counters.frames.saturating_add(1);
                    let admitted = self.check_owner(sender);
                    self.refuse(Some(sender.seq), admitted.err().unwrap_or(refusal));
                }
                (None, None) => {
                    self.refuse_undecodable(Refusal::new(Code::UnknownMessage, "request"))
                }
            }
        }
    }

    /// Refuses a frame that cannot be decoded, and counts it.
    fn refuse_undecodable(&mut self, refusal: Refusal<'static>) {
        self.counters.bad_frames = self.counters.bad_frames.saturating_add(1);
        self.refuse(None, refusal);
    }

    /// Sends the reports of the other parts to the host: those whose time is close to `now`
    /// ([`present`]), and all reports of stops.
    pub fn poll(&mut self, now: Micros, mail: &mut SessionMail<'_>) {
        self.counters.lost_posts = mail.lost.count();
        while let Some(report) = mail.reports.dequeue() {
            if matches!(report, Report::Stopped { .. }) || is_recent(report.at(), now) {
                self.forward(report, mail);
            } else {
                self.drop_message();
            }
        }
        while let Some(report) = mail.control_reports.dequeue() {
            if !is_recent(report.at(), now) {
                self.drop_message();
                continue;
            }
            match report {
                ControlReport::Verdict(ControlVerdict {
                    seq,
                    at,
                    result,
                    setpoint,
                }) => self.send_verdict(seq, at, result, setpoint),
                ControlReport::Event { at, event } => self.respond(&Response::Event { at, event }),
            }
        }
        while let Some(edge) = mail.edges.dequeue() {
            let at = edge.at;
            if is_recent(at, now) && self.has_room_for_answers() {
                let event = edge.event();
                self.respond(&Response::Event { at, event });
            } else {
                self.drop_message();
            }
        }
        while let Some(sample) = mail.samples.peek() {
            let is_of_present =
                matches!(sample, Response::Telemetry(sample) if is_recent(sample.at, now));
            if is_of_present && self.has_room_for_answers() {
                self.respond(sample);
            } else {
                self.drop_message();
            }
            let _ = mail.samples.dequeue();
        }
    }

    /// Returns whether unrequested messages leave room for answers.
    const fn has_room_for_answers(&self) -> bool {
        self.outbox.len() + RESERVED < ROOM
    }

    /// Moves up to `buffer.len()` bytes for the host into `buffer`, and returns their number.
    pub fn transmit(&mut self, buffer: &mut [u8]) -> usize {
        self.outbox.pop(buffer)
    }

    /// Returns whether bytes for the host wait.
    #[must_use]
    pub fn has_output(&self) -> bool {
        self.outbox.len() > 0
    }

    /// Returns the restart that the device accepted from a host, if any. The code that runs this
    /// session sends the answer, prepares the restart and restarts the device.
    #[must_use]
    pub const fn restart(&self) -> Option<&Restart> {
        self.restart.as_ref()
    }

    /// Sets whether the board's inputs allow the boot loader: arm key and hand-held stop are open.
    pub const fn set_boot_loader_inputs(&mut self, are_open: bool) {
        self.may_enter_boot_loader = are_open;
    }

    fn serve(
        &mut self,
        now: Micros,
        sender: Sender,
        request: &Request,
        part: Option<Part>,
        mail: &mut SessionMail<'_>,
    ) {
        self.counters.frames = self.counters.frames.saturating_add(1);
        let seq = sender.seq;
        if let Request::Hello { schema } = *request {
            match self.open(now, seq, sender.session, schema, mail) {
                Ok(Some(info)) => self.respond(&Response::Hello(info)),
                Ok(None) => {} // the pulser's verdict is the answer
                Err(refusal) => self.refuse(Some(seq), refusal),
            }
            return;
        }
        let admitted = self.check_owner(sender);
        if let Request::Stop = request {
            // From any sender: stopping is never refused.
            self.stop(now, seq, mail);
            return;
        }
        let answer = admitted.and_then(|()| self.answer(now, seq, request, part, mail));
        match answer {
            Ok(Reply::Done) => self.respond(&Response::Ack { seq, at: now }),
            Ok(Reply::Later) => {}
            Err(refusal) => self.refuse(Some(seq), refusal),
        }
    }

    /// Refuses a request that takes longer to carry out than a `Stop` behind it may wait, unless
    /// no pulses play. The session's copy of the state is sufficient: nothing plays before a
    /// `Start` was answered.
    fn check_at_rest(&mut self, now: Micros) -> Result<(), Refusal<'static>> {
        let plays = matches!(self.state, State::Stimulating | State::Stopping);
        // An answer that is so late is lost.
        self.starting.take_if(|(_, at)| !is_recent(*at, now));
        if plays || self.starting.is_some() {
            return Err(Refusal::new(Code::WrongState, "state"));
        }
        Ok(())
    }

    /// Raises the stop flag, which the pulser reads before all orders. Orders that were posted
    /// before become void.
    fn stop(&mut self, now: Micros, seq: u16, mail: &SessionMail<'_>) {
        let raised = mail.stop.raise();
        if self.stops.push_back((seq, raised)).is_err() {
            self.acknowledge_stop(seq, now); // it is as good as done
        }
    }

    /// Answers the stops that are carried out, up to the count `stops`.
    fn answer_stops(&mut self, stops: u32, at: Micros) {
        // Counts wrap; two compared counts differ by only a few.
        let is_done = |(_, raised): &(u16, u32)| stops.wrapping_sub(*raised) < 1 << 31;
        while self.stops.front().is_some_and(is_done) {
            let Some((seq, _)) = self.stops.pop_front() else {
                break;
            };
            self.acknowledge_stop(seq, at);
        }
    }

    fn forward(&mut self, report: Report, mail: &mut SessionMail<'_>) {
        match report {
            Report::Verdict {
                seq,
                at,
                result,
                answered,
                state,
            } => {
                self.state = state;
                if answered == AnsweredOrder::Start {
                    let left = |(count, at): (u8, Micros)| Some((count.checked_sub(1)?, at));
                    let left = self.starting.and_then(left);
                    self.starting = left.filter(|(count, _)| *count > 0);
                }
                let setpoint = answered == AnsweredOrder::Setpoint;
                self.send_verdict(seq, at, result.map_err(Refusal::from), setpoint);
            }
            Report::Released(verdict) => self.apply_release_verdict(verdict, mail),
            Report::Stopped { stops, at, state } => {
                self.state = state;
                self.answer_stops(stops, at);
            }
            Report::Status {
                seq,
                at,
                state,
                pulses,
                idle_triggers,
                late_setpoints,
                fault,
                left,
            } => {
                self.state = state;
                let counters = Counters {
                    pulses,
                    idle_triggers,
                    late_setpoints,
                    ..self.counters
                };
                self.respond(&Response::Status {
                    seq,
                    status: Status {
                        at,
                        state,
                        fault,
                        counters,
                        remaining: left,
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
                    Notice::Electrode {
                        channel,
                        applied,
                        current_ua,
                    } => Event::Electrode {
                        channel,
                        applied,
                        current_ua,
                    },
                };
                self.respond(&Response::Event { at, event });
            }
        }
    }

    fn send_verdict(
        &mut self,
        seq: u16,
        at: Micros,
        result: Result<(), Refusal<'static>>,
        setpoint: bool,
    ) {
        match result {
            Ok(()) => {
                self.counters.setpoints = self.counters.setpoints.saturating_add(setpoint.into());
                self.respond(&Response::Ack { seq, at });
            }
            Err(refusal) => self.refuse(Some(seq), refusal),
        }
    }

    fn refuse(&mut self, seq: Option<u16>, refusal: Refusal<'static>) {
        self.counters.refused = self.counters.refused.saturating_add(1);
        self.refusal = Some(refusal);
        self.respond(&Response::Refused { seq, refusal });
    }

    fn acknowledge_stop(&mut self, seq: u16, at: Micros) {
        self.enqueue(ROOM, &Response::Ack { seq, at });
    }

    fn respond(&mut self, response: &Response<'_>) {
        self.enqueue(ROOM - STOP_RESERVED, response);
    }

    /// Queues a whole message, or none of it if the host does not read.
    fn enqueue(&mut self, room: usize, response: &Response<'_>) {
        let mut frame = heapless::Vec::new();
        match encode_into(response, &mut frame) {
            Some(()) if self.outbox.len() + frame.len() <= room => self.outbox.push(&frame),
            _ => self.drop_message(),
        }
    }

    /// Counts a message that is not sent to the host.
    const fn drop_message(&mut self) {
        self.counters.dropped = self.counters.dropped.saturating_add(1);
    }
}

/// Returns whether an arm order is in progress: the controller has neither taken nor dropped its
/// parts yet.
fn is_arming(mail: &SessionMail<'_>) -> bool {
    !mail.control_parts.is_empty()
}

fn send<T>(mailbox: &mut heapless::spsc::Producer<'_, T>, item: T) -> Result<(), Refusal<'static>> {
    mailbox.enqueue(item).map_err(|_| busy_refusal())
}

/// Posts a request to the controller, with the stops raised so far, or refuses it if the
/// controller could not answer.
fn submit(request: ControlRequest, mail: &mut SessionMail<'_>) -> Result<(), Refusal<'static>> {
    if !mail.has_room_for_request() {
        return Err(busy_refusal());
    }
    let stops = mail.stop.count_raised();
    send(
        &mut mail.control_requests,
        ControlMessage { stops, request },
    )
}

fn busy_refusal() -> Refusal<'static> {
    Refusal::new(Code::DeviceBusy, "device")
}
