//! Sends setpoints, lists, changes of model level and measurements while a session runs.

use super::{RunError, Stepper};
use crate::link::{Port, stamp};
use crate::session::{Course, Setpoint};
use firmware::link::Request;
use firmware::safety::Stimulus;
use std::iter;

/// Time by which forces at the hand are sent before they take effect, so that none is late for its
/// recruitment, µs.
const AHEAD_US: u64 = 10_000;

/// Maximum number of requested forces at the hand whose answers may be outstanding.
const WISHES: usize = 64;

/// Time between two measurements of an arm's nine angles, µs.
const POSTURE_US: u64 = 20_000;

/// Time by which the amplitudes of programs are sent before they are due, so that a stall of host
/// or cable does not delay them, µs. Fast trains are sent fewer ticks ahead, because the device
/// lets only 16 wait.
const PROGRAM_AHEAD_US: u64 = 100_000;

/// Maximum number of program ticks that are sent ahead.
const MOST_TICKS: u64 = 8;

/// State of the programs' amplitudes sent so far.
#[derive(Clone, Debug, Default)]
pub(super) struct Programmed {
    /// Time of the next tick at which the amplitudes may change, µs after the start.
    next_us: u64,
    /// Latest amplitudes sent.
    latest: Vec<(u8, Stimulus)>,
}

impl<P: Port> Stepper<'_, P> {
    /// Sends the amplitudes that programs order up to `due` µs after the start and a little ahead
    /// of it. Each carries the device time from which it holds; only changes are sent.
    pub(super) fn post_programs(&mut self, due: u64) -> Result<(), RunError> {
        let Some(tick_us) = self.session.setpoints.programs.tick_us() else {
            return Ok(());
        };
        let ahead_us = PROGRAM_AHEAD_US.min(MOST_TICKS * tick_us);
        // Nothing begins after the session's end, although the trains play until the stop.
        let end_us = (due + ahead_us + 1).min(self.session.duration_us);
        while self.programmed.next_us < end_us {
            let at_us = self.programmed.next_us;
            self.programmed.next_us += tick_us;
            let orders = self.programmed_amplitudes(at_us);
            if orders != self.programmed.latest {
                self.programmed.latest.clone_from(&orders);
                let at = stamp(self.epoch + at_us);
                let request = Setpoint::Amplitudes(orders).to_request(Some(at));
                self.connection.post(request)?;
            }
        }
        Ok(())
    }

    /// Returns the programs' amplitudes for `at_us` µs after the start, at the channels'
    /// intensities.
    fn programmed_amplitudes(&self, at_us: u64) -> Vec<(u8, Stimulus)> {
        let orders = self.session.setpoints.programs.at(at_us);
        let orders = orders.into_iter().map(|order| self.scale_stimulus(order));
        orders.collect()
    }

    /// Returns the requests that are sent before `Start`.
    pub(super) fn requests_before_start(&mut self) -> Vec<Request> {
        if self.is_live() {
            return Vec::new();
        }
        let now_us = self.time_us();
        let first = self.session.setpoints.at(now_us);
        let all = iter::once(first).chain(self.session.amplitudes_before_start());
        let all = all.map(|setpoint| self.scale_setpoint(setpoint).to_request(None));
        let mut all: Vec<Request> = all.collect();
        if let Some(tick_us) = self.session.setpoints.programs.tick_us() {
            let orders = self.programmed_amplitudes(now_us / tick_us * tick_us);
            all.push(Setpoint::Amplitudes(orders.clone()).to_request(None));
            self.programmed = Programmed {
                next_us: (now_us / tick_us + 1) * tick_us,
                latest: orders,
            };
        }
        all
    }

    /// Sends the setpoint that is due `due` µs after the start, with measurements and lists, and
    /// the changes of model level since `before`, µs after the start.
    pub(super) fn post_due(&mut self, before: u64, due: u64) -> Result<(), RunError> {
        if self.is_paused() {
            return Ok(());
        }
        if self.measures_angle()
            && let Some(deg) = self.connection.port().glove_deg()
        {
            let at = stamp(self.device_now_us());
            let (joint, centideg) = (0, (deg * 100.0).round() as i16); // saturates
            let measured = Request::Measurement {
                joint,
                centideg,
                at,
            };
            self.connection.post(measured)?;
        }
        if self.measures_posture() && before / POSTURE_US != due / POSTURE_US {
            for request in self.posture_requests() {
                self.connection.post(request)?;
            }
        }
        for request in self.joint_angle_requests(due) {
            self.connection.post(request)?;
        }
        for request in self.session.level_changes(before, due) {
            self.connection.post(request)?;
        }
        for request in self.session.setpoints.due_lists(before, due) {
            self.connection.post(request)?;
        }
        self.post_programs(due)?;
        let now = self.epoch + due;
        let setpoints = &self.session.setpoints;
        let ahead_us = match &setpoints.course {
            Course::Wrench(_) => AHEAD_US,
            _ => 0,
        };
        let driven = setpoints.at(due + ahead_us);
        for setpoint in iter::once(driven).chain(setpoints.accompanying_at(due)) {
            let at = match setpoint {
                Setpoint::Wrench(_) => Some(stamp(now + ahead_us)),
                Setpoint::Angle { .. } | Setpoint::Force { .. } => Some(stamp(now)),
                Setpoint::Amplitudes(_) | Setpoint::Held(_) | Setpoint::KeepAlive => None,
            };
            let request = self.scale_setpoint(setpoint.clone()).to_request(at);
            let seq = self.connection.post(request)?;
            if let Setpoint::Wrench(force_mn) = setpoint {
                self.wishes.truncate(WISHES - 1);
                self.wishes.push_front((seq, force_mn));
            }
        }
        Ok(())
    }
}
