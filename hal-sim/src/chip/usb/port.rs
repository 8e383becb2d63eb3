//! Models the host's port: power, attachment, debounce, bus reset (USB 2.0 section 7.1.7), and the
//! frames announced to the device.

use super::request::Request;
use super::{Frames, Host};
use crate::chip::Cycle;
use crate::chip::soc::otg::Otg;

/// TATTDB: debounce of 100 ms before a reset (7.1.7.3).
const DEBOUNCE_MS: u64 = 100;
/// TDRSTR: a root port drives reset for at least 50 ms (7.1.7.5).
const RESET_MS: u64 = 50;
/// TRSTRCY: 10 ms without transactions after reset (7.1.7.5).
const RECOVERY_MS: u64 = 10;
/// A bus that is idle for 3 ms is suspended (7.1.7.6).
const SUSPEND_MS: u64 = 3;

/// State of the host's port. Each cycle in a variant is the end of that state, unless the variant
/// says otherwise.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Port {
    /// No cable is plugged in.
    Empty,
    /// VBUS has been on since this cycle, and nothing pulls D+ up.
    Powered(Cycle),
    /// A device pulls D+ up, and the bus has not been idle for 3 ms. The cycles are the end of
    /// these 3 ms and the end of the debounce time, after which the host resets the bus.
    Attached(Cycle, Cycle),
    /// A device pulls D+ up, and has noticed that the bus is suspended. The cycle is the end of the
    /// debounce time.
    Suspended(Cycle),
    /// The host drives SE0, which resets the device.
    Resetting(Cycle),
    /// The host sends start-of-frame packets, but no transactions yet.
    Recovering(Cycle),
    /// The host sends start-of-frame packets, and transactions.
    Running,
}

/// Cached prediction of the next events, valid while nothing accesses the device or the host.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct NextEvents {
    /// [`Otg::changes`] at the time of the prediction.
    changes: u64,
    /// Cycle before which [`Host::advance`] only informs the device of starts of frames and ends of
    /// periodic parts.
    step: Cycle,
    /// Result of [`Host::next_event`].
    event: Cycle,
}

impl Port {
    /// Returns the cycle at which the state changes because its time has passed; MAX if it ends
    /// otherwise.
    fn end_cycle(self) -> Cycle {
        match self {
            Self::Attached(at, _)
            | Self::Suspended(at)
            | Self::Resetting(at)
            | Self::Recovering(at) => at,
            Self::Empty | Self::Powered(_) | Self::Running => Cycle::MAX,
        }
    }

    /// Converts the remaining cycles of the state at `at` from a clock of `old` hertz to a clock of
    /// `new` hertz.
    pub fn set_hz(&mut self, old: u64, new: u64, at: Cycle) {
        let stretch = |then: &mut Cycle| {
            *then = at + then.saturating_sub(at) * new / old.max(1);
        };
        match self {
            Self::Attached(suspended, reset) => {
                stretch(suspended);
                stretch(reset);
            }
            Self::Suspended(then) | Self::Resetting(then) | Self::Recovering(then) => stretch(then),
            Self::Empty | Self::Powered(_) | Self::Running => {}
        }
    }
}

impl Host {
    /// Advances the host and the bus to cycle `to`.
    pub fn advance(&mut self, to: Cycle, otg: &mut Otg) {
        if self
            .cached_events(otg)
            .is_some_and(|outlook| to < outlook.step)
        {
            self.announce(to, otg);
            self.now = self.now.max(to);
            return;
        }
        self.notice_attachment(otg);
        while let Some(at) = self.next_step(otg).filter(|at| *at <= to) {
            self.announce(at, otg);
            self.now = self.now.max(at);
            if self.port.end_cycle() <= at {
                self.leave(at, otg);
            } else {
                self.step(at, otg);
            }
        }
        self.announce(to, otg);
        self.now = self.now.max(to);
        let step = self.next_step(otg).unwrap_or(Cycle::MAX);
        self.outlook = Some(NextEvents {
            changes: otg.changes,
            step: step.min(self.next_announcement(otg)),
            event: self.find_event(otg),
        });
    }

    /// Returns the cached prediction, unless the device has changed since.
    fn cached_events(&self, otg: &Otg) -> Option<NextEvents> {
        self.outlook.filter(|found| found.changes == otg.changes)
    }

    /// Returns the earliest cycle at which [`Self::advance`] is due, because the device's registers
    /// or the bytes received may change. Call again after each access to the device's registers.
    pub fn next_event(&self, otg: &Otg) -> Cycle {
        match self.cached_events(otg) {
            Some(outlook) => outlook.event,
            None => self.find_event(otg),
        }
    }

    fn find_event(&self, otg: &Otg) -> Cycle {
        let attached = match (self.port, otg.attached_since()) {
            (Port::Powered(on), Some(since)) => self.debounce(since.max(on)).0,
            _ => Cycle::MAX,
        };
        attached
            .min(self.port.end_cycle())
            .min(self.next_transfer_event(otg))
            .min(self.next_announcement(otg))
    }

    fn ms(&self, ms: u64) -> Cycle {
        ms * self.hz / 1_000
    }

    fn debounce(&self, since: Cycle) -> (Cycle, Cycle) {
        (since + self.ms(SUSPEND_MS), since + self.ms(DEBOUNCE_MS))
    }

    fn notice_attachment(&mut self, otg: &Otg) {
        match (self.port, otg.attached_since()) {
            (Port::Powered(on), Some(since)) => {
                let (suspended, reset) = self.debounce(since.max(on));
                self.port = Port::Attached(suspended, reset);
            }
            (Port::Empty | Port::Powered(_), _) | (_, Some(_)) => {}
            // A host notices a disconnect after 2.5 µs of SE0 (7.1.7.3); here at once.
            (_, None) => {
                self.disconnect();
                self.port = Port::Powered(self.now);
            }
        }
    }

    /// Forgets the device and everything that was in progress with it.
    pub(super) fn disconnect(&mut self) {
        self.flight = None;
        self.control = None;
        self.line_state = None;
        self.foreign.clear();
        self.interrupted = None;
        self.outgoing.clear();
        self.configured = false;
        self.open = false;
        self.announced = (None, None);
    }

    fn next_step(&self, otg: &Otg) -> Option<Cycle> {
        let transfer = self.next_transfer(otg).unwrap_or(Cycle::MAX);
        let at = transfer.min(self.port.end_cycle());
        (at < Cycle::MAX).then_some(at)
    }

    fn leave(&mut self, at: Cycle, otg: &mut Otg) {
        self.port = match self.port {
            Port::Attached(_, reset) => {
                otg.suspend();
                Port::Suspended(reset)
            }
            Port::Suspended(_) => {
                otg.begin_bus_reset();
                Port::Resetting(at + self.ms(RESET_MS))
            }
            Port::Resetting(_) => {
                otg.end_bus_reset();
                self.frames = Frames::new(at, self.hz);
                self.announced = (None, None);
                self.quiet_until = 0;
                Port::Recovering(at + self.ms(RECOVERY_MS))
            }
            Port::Recovering(_) => {
                self.address = 0;
                self.free = at;
                self.device.max_packet = 8;
                match self.foreign.pop_front() {
                    Some((setup, data)) => {
                        self.interrupted = Some(Request::MaxPacket);
                        self.begin_other_request(setup, data, at);
                    }
                    None => self.request(Request::MaxPacket, at),
                }
                Port::Running
            }
            port => port,
        };
    }

    /// Informs the device of the latest start of frame, and the latest end of a periodic part, up
    /// to `at`.
    fn announce(&mut self, at: Cycle, otg: &mut Otg) {
        if at < self.quiet_until || !self.are_frames_running() {
            return;
        }
        let index = self.frames.index(at);
        let (start, part) = (self.frames.received(index), self.frames.periodic_end(index));
        // If this frame has not reached the point yet, the previous frame counts.
        let reached = |then: Cycle| index.checked_sub(u64::from(at < then));
        let (started, ended) = (reached(start), reached(part));
        if started > self.announced.0 {
            self.announced.0 = started;
            otg.receive_sof((started.unwrap_or(0) & 0x7FF) as u16);
        }
        if ended > self.announced.1 {
            self.announced.1 = ended;
            otg.end_periodic_frame();
        }
        // The points ascend, so this finds the next one.
        let next = [start, part, self.frames.received(index + 1)];
        self.quiet_until = next.into_iter().find(|then| at < *then).unwrap_or(at);
    }

    /// Returns the cycle at which the next start of frame or end of a periodic part raises the
    /// device's interrupt line; MAX if neither can.
    fn next_announcement(&self, otg: &Otg) -> Cycle {
        if !self.are_frames_running() {
            return Cycle::MAX;
        }
        let next =
            |announced: Option<u64>| announced.map_or(self.frames.index(self.now), |n| n + 1);
        let start = match otg.awaits_sof() {
            true => self.frames.received(next(self.announced.0)),
            false => Cycle::MAX,
        };
        let end = match otg.awaits_periodic_end() {
            true => self.frames.periodic_end(next(self.announced.1)),
            false => Cycle::MAX,
        };
        start.min(end)
    }

    /// Returns whether the port sends starts of frames.
    pub(super) fn are_frames_running(&self) -> bool {
        matches!(self.port, Port::Recovering(_) | Port::Running)
    }
}
