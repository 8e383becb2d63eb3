//! Schedules transactions: selects the next one, computes its start, and performs it.
//!
//! Order in a frame: start of frame, a due interrupt IN, then control, bulk OUT and bulk IN in
//! turn, back to back while they make progress. A NAKed transaction is retried after any other
//! transaction, or at the next retry of the frame (`frame`). A try that can only be NAKed takes no
//! bus time here.

use super::line::{self, BETWEEN, HANDSHAKE, SAME_SOURCE, TIME_OUT, TURN_AROUND, pid};
use super::request::Stage;
use super::{Failure, Host};
use crate::chip::Cycle;
use crate::chip::soc::otg::{Handshake, Otg, Packet, Reply};

/// Tries without an answer after which the host gives up (USB 2.0 8.6).
const TRIES: u8 = 3;

/// State that the host keeps for one endpoint and direction.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Pipe {
    pub number: usize,
    pub max_packet: usize,
    /// Number of frames from one poll of an interrupt endpoint to the next.
    pub interval: u64,
    /// Whether the next data packet is DATA1.
    pub data1: bool,
    /// Cycle at which the pipe may try next, off the grid of retries; ignored once it is past.
    pub immediate: Cycle,
    /// Cycle from which on the pipe may try a transaction.
    pub eligible: Cycle,
    /// Number of tries in a row that the device did not answer.
    pub silent: u8,
}

/// Pipe to which a transaction belongs: interrupt IN, endpoint 0, bulk OUT or bulk IN.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    Notify,
    Control,
    Out,
    In,
}

/// A transaction in progress, and the cycle at which its present phase ends.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Flight {
    at: Cycle,
    kind: Kind,
    phase: Phase,
}

#[derive(Clone, Copy, PartialEq, Debug)]
enum Phase {
    /// Data from the host: SETUP or OUT.
    Data(Packet),
    /// IN token from the host.
    Token,
    /// The host's ACK of data.
    Ack(Packet),
}

impl Host {
    /// Returns the cycle at which the next phase of a transaction ends or the next transaction
    /// begins.
    pub(super) fn next_transfer(&self, otg: &Otg) -> Option<Cycle> {
        if let Some(flight) = &self.flight {
            return Some(flight.at);
        }
        let start = self.plan(otg).map(|plan| plan.0);
        let deadline = self.control.as_ref().map(|c| c.deadline);
        start.into_iter().chain(deadline).min()
    }

    /// Returns the cycle at which a transaction next reaches the device.
    pub(super) fn next_transfer_event(&self, otg: &Otg) -> Cycle {
        match (&self.flight, self.next_transfer(otg)) {
            (None, Some(start)) => start + self.cycles(line::token(pid::IN, 0, 0)),
            (_, at) => at.unwrap_or(Cycle::MAX),
        }
    }

    fn cycles(&self, half_bits: u64) -> Cycle {
        line::cycles(half_bits, self.hz)
    }

    /// Returns the cycle at which the next transaction begins, and its pipe.
    fn plan(&self, otg: &Otg) -> Option<(Cycle, Kind)> {
        if self.failure.is_some() {
            return None;
        }
        let data = match self.out_was_last {
            true => [Kind::In, Kind::Out],
            false => [Kind::Out, Kind::In],
        };
        let starts = [
            self.notify_start(otg).map(|at| (at, Kind::Notify)),
            self.control_start(otg).map(|at| (at, Kind::Control)),
            self.data_start(data[0], otg).map(|at| (at, data[0])),
            self.data_start(data[1], otg).map(|at| (at, data[1])),
        ];
        // Of transactions that begin at the same time, the first in this list wins.
        starts.into_iter().flatten().min_by_key(|start| start.0)
    }

    fn notify_start(&self, otg: &Otg) -> Option<Cycle> {
        let pipe = &self.notify;
        if !self.configured || !otg.in_ready(self.address, pipe.number) {
            return None;
        }
        let from = self.now.max(self.free);
        let index = self.frames.index(from.max(pipe.eligible));
        let due = index.next_multiple_of(pipe.interval.max(1));
        let slot = self.frames.first_slot(due);
        let late = slot < from;
        let due = if late { due + pipe.interval } else { due };
        Some(self.frames.first_slot(due))
    }

    fn control_start(&self, otg: &Otg) -> Option<Cycle> {
        let control = self.control.as_ref()?;
        let max_packet = usize::from(self.device.max_packet);
        let ready = match control.stage {
            Stage::Setup => true,
            Stage::DataIn | Stage::StatusIn => otg.in_ready(self.address, 0),
            Stage::DataOut => otg.out_ready(self.address, 0, control.chunk(max_packet).len()),
            Stage::StatusOut => otg.out_ready(self.address, 0, 0),
        };
        let budget = control.budget(max_packet, self.hz);
        ready.then(|| self.slot(&self.control_pipe, 0, budget))
    }

    fn data_start(&self, kind: Kind, otg: &Otg) -> Option<Cycle> {
        if !self.open {
            return None;
        }
        if kind == Kind::In {
            let pipe = &self.data_in;
            let budget = line::budget(pipe.max_packet, self.hz);
            let ready = otg.in_ready(self.address, pipe.number);
            return ready.then(|| self.slot(pipe, 0, budget));
        }
        let write = self.outgoing.front()?;
        let pipe = &self.data_out;
        let length = (write.bytes.len() - write.sent).min(pipe.max_packet);
        let ready = otg.out_ready(self.address, pipe.number, length);
        ready.then(|| self.slot(pipe, write.eligible, line::budget(length, self.hz)))
    }

    /// Returns the cycle at which a pipe that the device can serve next tries a transaction of at
    /// most `budget` cycles, from `eligible` on.
    fn slot(&self, pipe: &Pipe, eligible: Cycle, budget: Cycle) -> Cycle {
        let eligible = eligible.max(pipe.eligible);
        if pipe.immediate >= self.now && pipe.immediate >= eligible {
            return self.frames.fit(pipe.immediate.max(self.free), budget);
        }
        let from = self.now.max(self.free).max(eligible);
        self.frames.retry(from, budget)
    }

    /// Ends the phase of a transaction, or begins the transaction, whose cycle
    /// [`Self::next_transfer`] returned as `at`.
    pub(super) fn step(&mut self, at: Cycle, otg: &mut Otg) {
        if let Some(flight) = self.flight.take() {
            match flight.phase {
                Phase::Data(packet) => self.data_arrives(flight.kind, packet, at, otg),
                Phase::Token => self.token_arrives(flight.kind, at, otg),
                Phase::Ack(packet) => self.ack_arrives(flight.kind, packet, at, otg),
            }
            return;
        }
        if let Some(control) = self.control.as_ref().filter(|c| c.deadline <= at) {
            self.fail(Failure::Slow(control.request.name()));
            return;
        }
        if let Some((start, kind)) = self.plan(otg) {
            self.flight = self.launch(start, kind);
        }
    }

    fn launch(&self, start: Cycle, kind: Kind) -> Option<Flight> {
        let number = self.number(kind);
        let (token, packet) = match (kind, &self.control) {
            (Kind::Control, Some(control)) => match control.stage {
                Stage::Setup => (pid::SETUP, Some(Packet::new(&control.setup, false))),
                Stage::DataOut => {
                    let chunk = control.chunk(usize::from(self.device.max_packet));
                    (pid::OUT, Some(Packet::new(chunk, control.data1)))
                }
                Stage::StatusOut => (pid::OUT, Some(Packet::new(&[], true))),
                Stage::DataIn | Stage::StatusIn => (pid::IN, None),
            },
            (Kind::Out, _) => {
                let write = self.outgoing.front()?;
                let rest = write.bytes.get(write.sent..).unwrap_or_default();
                let chunk = rest.get(..self.data_out.max_packet).unwrap_or(rest);
                (pid::OUT, Some(Packet::new(chunk, self.data_out.data1)))
            }
            _ => (pid::IN, None),
        };
        let token = line::token(token, self.address, number);
        let (length, phase) = match packet {
            Some(packet) => {
                let data = line::data(packet.bytes(), packet.data1);
                (token + SAME_SOURCE + data, Phase::Data(packet))
            }
            None => (token, Phase::Token),
        };
        Some(Flight {
            at: start + self.cycles(length),
            kind,
            phase,
        })
    }

    fn number(&self, kind: Kind) -> usize {
        match kind {
            Kind::Control => 0,
            Kind::Notify => self.notify.number,
            Kind::Out => self.data_out.number,
            Kind::In => self.data_in.number,
        }
    }

    fn data_arrives(&mut self, kind: Kind, packet: Packet, at: Cycle, otg: &mut Otg) {
        let setup = match &self.control {
            Some(c) if kind == Kind::Control && c.stage == Stage::Setup => Some(c.setup),
            _ => None,
        };
        let answer = match setup {
            Some(setup) => otg.receive_setup(self.address, &setup),
            None => otg.receive_out(self.address, self.number(kind), &packet),
        };
        let end = match answer {
            Handshake::Silent => self.cycles(TIME_OUT),
            _ => self.cycles(TURN_AROUND + HANDSHAKE),
        };
        self.complete(kind, at + end, answer);
        if answer != Handshake::Ack {
            return;
        }
        if kind == Kind::Out {
            self.data_out.data1 = !self.data_out.data1;
            self.count_written(packet.bytes().len());
            self.delivered = Some(at + end);
            return;
        }
        let Some(control) = &mut self.control else {
            return;
        };
        if setup.is_some() {
            control.setup_done();
        } else if control.out_done(packet.bytes().len()) {
            self.finish_request(at + end);
        }
    }

    fn count_written(&mut self, bytes: usize) {
        if let Some(write) = self.outgoing.front_mut() {
            write.sent += bytes;
            if write.sent >= write.bytes.len() {
                self.outgoing.pop_front();
            }
        }
    }

    fn token_arrives(&mut self, kind: Kind, at: Cycle, otg: &mut Otg) {
        let answer = match otg.in_token(self.address, self.number(kind)) {
            Reply::Data(packet) => {
                let data = line::data(packet.bytes(), packet.data1);
                self.flight = Some(Flight {
                    at: at + self.cycles(TURN_AROUND + data + TURN_AROUND + HANDSHAKE),
                    kind,
                    phase: Phase::Ack(packet),
                });
                return;
            }
            Reply::Nak => Handshake::Nak,
            Reply::Stall => Handshake::Stall,
            Reply::Silent => Handshake::Silent,
        };
        let end = match answer {
            Handshake::Silent => TIME_OUT,
            _ => TURN_AROUND + HANDSHAKE,
        };
        self.complete(kind, at + self.cycles(end), answer);
    }

    fn ack_arrives(&mut self, kind: Kind, packet: Packet, at: Cycle, otg: &mut Otg) {
        otg.acknowledge(self.number(kind), packet.bytes().len());
        self.complete(kind, at, Handshake::Ack);
        if kind == Kind::Control {
            self.control_data(packet, at);
            return;
        }
        let pipe = match kind {
            Kind::Notify => &mut self.notify,
            _ => &mut self.data_in,
        };
        // A repeated packet is acknowledged and dropped.
        if packet.data1 != pipe.data1 {
            return;
        }
        pipe.data1 = !pipe.data1;
        if packet.bytes().len() > pipe.max_packet {
            self.fail(Failure::Babble(name(kind)));
        } else if kind == Kind::In && !packet.bytes().is_empty() {
            self.incoming.push_back((at, packet));
        }
    }

    fn control_data(&mut self, packet: Packet, at: Cycle) {
        let max_packet = usize::from(self.device.max_packet);
        let Some(control) = &mut self.control else {
            return;
        };
        if packet.data1 != control.data1 {
            return;
        }
        match control.in_done(packet.bytes(), max_packet) {
            Ok(true) => self.finish_request(at),
            Ok(false) => {}
            Err(failure) => self.fail(failure),
        }
    }

    /// Ends a transaction of `kind` with the device's `answer` at `end`; the bus is free a little
    /// later.
    fn complete(&mut self, kind: Kind, end: Cycle, answer: Handshake) {
        self.free = end + self.cycles(BETWEEN);
        let free = self.free;
        for other in [Kind::Control, Kind::Out, Kind::In] {
            let tried_in_vain = other == kind && answer != Handshake::Ack;
            self.pipe(other).immediate = if tried_in_vain { 0 } else { free };
        }
        if matches!(kind, Kind::Out | Kind::In) {
            self.out_was_last = kind == Kind::Out;
        }
        let pipe = self.pipe(kind);
        pipe.eligible = pipe.eligible.max(end);
        match answer {
            Handshake::Silent => {
                pipe.silent += 1;
                if pipe.silent >= TRIES {
                    let transfer_name = self.control_name(kind);
                    self.fail(Failure::NoAnswer(transfer_name));
                }
            }
            Handshake::Stall if kind == Kind::Control => self.handle_stall(end),
            Handshake::Stall => self.fail(Failure::Stalled(name(kind))),
            Handshake::Ack | Handshake::Nak => pipe.silent = 0,
        }
    }

    fn pipe(&mut self, kind: Kind) -> &mut Pipe {
        match kind {
            Kind::Notify => &mut self.notify,
            Kind::Control => &mut self.control_pipe,
            Kind::Out => &mut self.data_out,
            Kind::In => &mut self.data_in,
        }
    }

    fn control_name(&self, kind: Kind) -> &'static str {
        match (&self.control, kind) {
            (Some(control), Kind::Control) => control.request.name(),
            _ => name(kind),
        }
    }
}

fn name(kind: Kind) -> &'static str {
    match kind {
        Kind::Notify => "interrupt IN",
        Kind::Control => "endpoint 0",
        Kind::Out => "bulk OUT",
        Kind::In => "bulk IN",
    }
}
