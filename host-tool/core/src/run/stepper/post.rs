//! What the host sends while a session runs: setpoints, lists, changes of model level,
//! measurements.

use super::{RunError, Stepper};
use crate::link::{Port, stamp};
use crate::session::{Course, Setpoint};
use firmware::link::Request;
use firmware::safety::Stimulus;
use std::iter;

/// Forces at the hand are sent so long before they are valid, that none is late for its
/// recruitment, µs.
const AHEAD_US: u64 = 10_000;

/// Wanted forces at the hand whose answers may be on their way.
const WISHES: usize = 64;

/// From measurement to measurement of an arm's nine angles, µs.
const POSTURE_US: u64 = 20_000;

/// Orders of programs are sent so long before they are due, so that none is late for a host
/// or a cable that stalls, µs; by fewer ticks for fast trains, for the device lets 16 wait.
const PROGRAM_AHEAD_US: u64 = 100_000;

/// Most ticks of programs that are sent ahead.
const MOST_TICKS: u64 = 8;

/// What was sent of a session's programs.
#[derive(Clone, Debug, Default)]
pub(super) struct Programmed {
    /// When the next order may change, µs after the start.
    next_us: u64,
    /// The latest orders.
    latest: Vec<(u8, Stimulus)>,
}

impl<P: Port> Stepper<'_, P> {
    /// Sends what programs order up to `due` µs after the start, and ahead of it, each with
    /// the device time from which it holds; only what changes.
    pub(super) fn post_programs(&mut self, due: u64) -> Result<(), RunError> {
        let Some(tick_us) = self.session.setpoints.programs.tick_us() else {
            return Ok(());
        };
        let ahead_us = PROGRAM_AHEAD_US.min(MOST_TICKS * tick_us);
        // Nothing begins when the session is over, though the trains play until the stop.
        let end_us = (due + ahead_us + 1).min(self.session.duration_us);
        while self.programmed.next_us < end_us {
            let at_us = self.programmed.next_us;
            self.programmed.next_us += tick_us;
            let orders = self.programmed_at(at_us);
            if orders != self.programmed.latest {
                self.programmed.latest.clone_from(&orders);
                let at = stamp(self.epoch + at_us);
                let request = Setpoint::Amplitudes(orders).request(Some(at));
                self.connection.post(request)?;
            }
        }
        Ok(())
    }

    /// The orders of programs for `at_us` µs after the start, at the channels' intensities.
    fn programmed_at(&self, at_us: u64) -> Vec<(u8, Stimulus)> {
        let orders = self.session.setpoints.programs.at(at_us);
        let orders = orders.into_iter().map(|order| self.scaled(order));
        orders.collect()
    }

    /// What is sent before `Start`.
    pub(super) fn first_orders(&mut self) -> Vec<Request> {
        if self.is_live() {
            return Vec::new();
        }
        let now_us = self.time_us();
        let first = self.session.setpoints.at(now_us);
        let all = iter::once(first).chain(self.session.counted_from_start());
        let all = all.map(|setpoint| self.at_intensity(setpoint).request(None));
        let mut all: Vec<Request> = all.collect();
        if let Some(tick_us) = self.session.setpoints.programs.tick_us() {
            let orders = self.programmed_at(now_us / tick_us * tick_us);
            all.push(Setpoint::Amplitudes(orders.clone()).request(None));
            self.programmed = Programmed {
                next_us: (now_us / tick_us + 1) * tick_us,
                latest: orders,
            };
        }
        all
    }

    /// Sends what is due `due` µs after the start, and changes of model level since
    /// `before`.
    pub(super) fn post_due(&mut self, before: u64, due: u64) -> Result<(), RunError> {
        if self.is_paused() {
            return Ok(());
        }
        if self.measures()
            && let Some(deg) = self.connection.port().glove_deg()
        {
            let at = stamp(self.now());
            let (joint, centideg) = (0, (deg * 100.0).round() as i16); // saturates
            let measured = Request::Measurement {
                joint,
                centideg,
                at,
            };
            self.connection.post(measured)?;
        }
        if self.measures_posture() && before / POSTURE_US != due / POSTURE_US {
            for request in self.posture() {
                self.connection.post(request)?;
            }
        }
        for request in self.joint_angles(due) {
            self.connection.post(request)?;
        }
        for request in self.session.rungs(before, due) {
            self.connection.post(request)?;
        }
        for request in self.session.setpoints.lists(before, due) {
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
        for setpoint in iter::once(driven).chain(setpoints.with(due)) {
            let at = match setpoint {
                Setpoint::Wrench(_) => Some(stamp(now + ahead_us)),
                Setpoint::Angle { .. } | Setpoint::Force { .. } => Some(stamp(now)),
                Setpoint::Amplitudes(_) | Setpoint::Held(_) | Setpoint::KeepAlive => None,
            };
            let request = self.at_intensity(setpoint.clone()).request(at);
            let seq = self.connection.post(request)?;
            if let Setpoint::Wrench(force_mn) = setpoint {
                self.wishes.truncate(WISHES - 1);
                self.wishes.push_front((seq, force_mn));
            }
        }
        Ok(())
    }
}
