//! Detection of stale messages from the other parts of the device program.
//!
//! A mailbox counts the messages put in and taken out. After a bit flip in a count, the session
//! receives slots that it took long ago, or that were never written and that read as a deadline
//! missed at time 0. A sequence number in each message would be miscounted by the same bit flip,
//! and would silence its mailbox from then on; the time that each message has anyway is not
//! affected.

use super::super::mail::{ControlReport, ControlVerdict, ReleaseAnswer, Report};
use crate::units::Micros;

/// Largest plausible difference between a message's time and now, µs. The watchdog resets a device
/// whose session does not read its mail for 12 ms.
const PRESENT_US: u32 = 100_000;

/// Returns whether a message with time `at` can have been written around `now`.
pub(super) const fn is_recent(at: Micros, now: Micros) -> bool {
    now.elapsed_since(at) <= PRESENT_US && at.elapsed_since(now) <= PRESENT_US
}

impl Report {
    /// Returns the time at which the report was written.
    pub(super) const fn at(&self) -> Micros {
        match *self {
            Self::Verdict { at, .. }
            | Self::Stopped { at, .. }
            | Self::Status { at, .. }
            | Self::Changed { at, .. } => at,
            Self::Released(ReleaseAnswer { at, .. }) => at,
        }
    }
}

impl ControlReport {
    /// Returns the time at which the report was written.
    pub(super) const fn at(&self) -> Micros {
        match *self {
            Self::Verdict(ControlVerdict { at, .. }) | Self::Event { at, .. } => at,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Identity, RESERVED, ROOM, Session};
    use super::*;
    use crate::device::Mailboxes;
    use crate::device::mail::Edge;
    use crate::link::message::ResetCause;
    use crate::link::{Event, Kind, Response, encode_into};
    use crate::safety::{Fault, FaultRecord, Notice, Stages, State};
    use crate::units::us;

    fn session() -> Session {
        Session::new(Identity {
            kind: Kind::Native,
            unique_id: [0; 3],
            reset: ResetCause::PowerOn,
            last_fault: None,
            first_session: 1,
            stages: Stages::AsConfigured,
            option_bytes: None,
            board: "",
            crystal_hz: 0,
            has_boot_loader: false,
        })
    }

    fn faulted(at: Micros) -> Report {
        let record = FaultRecord::new(Fault::MissedDeadline, at);
        Report::Changed {
            at,
            state: State::Fault,
            notice: Notice::Faulted(record),
        }
    }

    /// Polls a session at `now` after `report`, and returns whether its state changed, whether it
    /// sent anything, and the number of dropped messages.
    fn told(report: Report, now: Micros) -> (bool, bool, u32) {
        let mut mail = Mailboxes::new();
        mail.split().0.report(report).unwrap();
        let mut session = session();
        session.poll(now, &mut mail.split().2);
        let is_changed = session.state == State::Fault;
        (is_changed, session.has_output(), session.counters.dropped)
    }

    #[test]
    fn what_is_not_of_the_present_is_neither_told_nor_believed() {
        let hour = Micros::new(3_600_000_000);
        for (at, is_told) in [
            (hour, true),
            (Micros::new(3_599_900_000), true),
            (Micros::new(3_600_100_000), true),
            (Micros::new(3_599_899_999), false),
            (Micros::new(3_600_100_001), false),
            (Micros::new(0), false),
        ] {
            let fate = told(faulted(at), hour);
            assert_eq!(fate, (is_told, is_told, u32::from(!is_told)), "{at:?}");
        }
    }

    #[test]
    fn the_clock_may_wrap_between() {
        let (before, after) = (Micros::new(u32::MAX - 40_000), Micros::new(40_000));
        assert_eq!(told(faulted(before), after), (true, true, 0));
        assert_eq!(told(faulted(after), before), (true, true, 0));
    }

    #[test]
    fn a_stop_is_told_whatever_its_time() {
        let stopped = Report::Stopped {
            stops: 1,
            at: Micros::new(0),
            state: State::Fault,
        };
        // No `Stop` waits for its answer, but the state is taken over.
        let fate = told(stopped, Micros::new(3_600_000_000));
        assert_eq!(fate, (true, false, 0));
    }

    /// Edges leave the same room free that telemetry leaves, and edges that do not fit are
    /// counted.
    #[test]
    fn edges_leave_room_for_answers() {
        let now = Micros::new(3_600_000_000);
        let (mut mail, mut session) = (Mailboxes::new(), session());
        let mut edges = 0;
        for is_sync in [true, false].into_iter().cycle().take(400) {
            let edge = Edge { at: now, is_sync };
            mail.split().0.report_edge(edge).unwrap();
            session.poll(now, &mut mail.split().2);
            edges += 1;
            let longest = 32; // a frame of an event without content is shorter
            assert!(session.outbox.len() < ROOM - RESERVED + longest);
        }
        assert!(session.counters.dropped > 200 && session.counters.dropped < edges);
        let len = session.outbox.len();
        session.respond(&Response::Ack { seq: 1, at: now });
        assert!(session.outbox.len() > len);
        assert_eq!(session.counters.lost_posts, 0);
    }

    #[test]
    fn an_edge_is_told_with_its_time_if_that_is_of_the_present() {
        let now = Micros::new(3_600_000_000);
        for (at, is_told) in [(now + us(500), true), (now - us(100_001), false)] {
            for is_sync in [true, false] {
                let (mut mail, mut session) = (Mailboxes::new(), session());
                mail.split().0.report_edge(Edge { at, is_sync }).unwrap();
                assert!(mail.has_message_for_session());
                session.poll(now, &mut mail.split().2);
                let mut expected = super::super::Outbox::new();
                if is_told {
                    let event = if is_sync {
                        Event::SyncEdge
                    } else {
                        Event::TriggerEdge
                    };
                    let mut frame = heapless::Vec::new();
                    encode_into(&Response::Event { at, event }, &mut frame).unwrap();
                    expected.push(&frame);
                }
                let (mut output, mut wanted) = ([0; 64], [0; 64]);
                session.transmit(&mut output);
                expected.pop(&mut wanted);
                assert_eq!(output, wanted);
                assert_eq!(session.counters.dropped, u32::from(!is_told));
            }
        }
    }

    #[test]
    fn the_controller_is_held_to_it_too() {
        let now = Micros::new(3_600_000_000);
        for (at, outputs) in [(now, true), (Micros::new(0), false)] {
            let mut mail = Mailboxes::new();
            let mut controller = mail.split().1;
            controller.report_event(at, Event::Recovered).unwrap();
            let mut session = session();
            session.poll(now, &mut mail.split().2);
            assert_eq!(session.has_output(), outputs);
            assert_eq!(session.counters.dropped, u32::from(!outputs));
        }
    }
}
