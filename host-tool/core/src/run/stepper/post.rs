//! Sends setpoints, lists, changes of model level and measurements while a session runs.

use super::{RunError, Stepper};
use crate::link::{Port, stamp};
use crate::session::{Course, Programs, Setpoint};
use firmware::link::Request;
use firmware::safety::Stimulus;
use std::iter;

/// Time before it takes effect at which a wanted force at the hand is sent, µs, so that the device
/// has it when it computes the recruitment.
const AHEAD_US: u64 = 10_000;

/// Maximum number of wanted forces at the hand that are kept until the device has answered their
/// requests.
const WISHES: usize = 64;

/// Time between two measurements of the nine angles of an arm, µs.
const POSTURE_US: u64 = 20_000;

/// Time before they are due at which the amplitudes of programs are sent, µs, so that a delay in
/// the host or the cable does not delay them. At short ticks, less is sent ahead, because the
/// device stores at most 16 amplitude requests.
const PROGRAM_AHEAD_US: u64 = 100_000;

/// Maximum number of program ticks whose amplitudes are sent ahead.
const MOST_TICKS: u64 = 8;

/// How far the amplitudes of the session's programs were sent.
#[derive(Clone, Debug, Default)]
pub(super) struct Programmed {
    /// Time of the next tick whose amplitudes are to be sent, µs after the start of the trains.
    next_us: u64,
    /// Amplitudes of the latest tick, by channel on the link (0–9).
    latest: Vec<(u8, Stimulus)>,
}

impl<P: Port> Stepper<'_, P> {
    /// Sends the amplitudes that the session's programs give until `due`, µs after the start of the
    /// trains, and some that are due soon afterwards. Each request carries the device time at which
    /// it takes effect. Only changes are sent.
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

    /// Replaces the programs of a live session. They count from the start of the trains, and what
    /// the earlier programs have asked for up to 100 ms ahead stays. A refused amplitude of a
    /// program ends the session.
    ///
    /// # Errors
    /// The device is lost.
    pub fn set_programs(&mut self, programs: Programs) -> Result<(), RunError> {
        self.session.to_mut().setpoints.programs = programs;
        self.programmed.latest.clear();
        let now_us = self.time_us();
        if let Some(tick_us) = self.session.setpoints.programs.tick_us() {
            // The next tick that lies ahead: an order for a past time would be refused.
            let next_us = (now_us / tick_us + 1) * tick_us;
            self.programmed.next_us = self.programmed.next_us.max(next_us);
        }
        match self.started_us {
            Some(_) => self.post_programs(now_us),
            None => Ok(()),
        }
    }

    /// Returns when the next amplitudes of programs are to be sent in a live session, in the port's
    /// time, µs; `None` without programs or before the start.
    pub(super) fn next_program_us(&self) -> Option<u64> {
        let tick_us = self.session.setpoints.programs.tick_us()?;
        let ahead_us = PROGRAM_AHEAD_US.min(MOST_TICKS * tick_us);
        Some(self.started_us? + self.programmed.next_us.saturating_sub(ahead_us))
    }

    /// Returns the amplitudes that the session's programs give for `at_us`, µs after the start of
    /// the trains, scaled by the intensities of their channels.
    fn programmed_amplitudes(&self, at_us: u64) -> Vec<(u8, Stimulus)> {
        let orders = self.session.setpoints.programs.at(at_us);
        let orders = orders.into_iter().map(|order| self.scale_stimulus(order));
        orders.collect()
    }

    /// Returns the requests with the first setpoints, which are sent before `Start`.
    pub(super) fn requests_before_start(&mut self) -> Vec<Request> {
        if self.is_live() {
            return Vec::new();
        }
        let now_us = self.time_us();
        let first = self.session.setpoints.at(now_us);
        let setpoints = iter::once(first).chain(self.session.amplitudes_before_start());
        let messages = setpoints.map(|setpoint| self.scale_setpoint(setpoint).to_request(None));
        let mut requests: Vec<Request> = messages.collect();
        if let Some(tick_us) = self.session.setpoints.programs.tick_us() {
            let orders = self.programmed_amplitudes(now_us / tick_us * tick_us);
            requests.push(Setpoint::Amplitudes(orders.clone()).to_request(None));
            self.programmed = Programmed {
                next_us: (now_us / tick_us + 1) * tick_us,
                latest: orders,
            };
        }
        requests
    }

    /// Sends what is due at `due`, µs after the start of the trains: the setpoint, measurements,
    /// pulse lists, and changes of the model level after the time `before`.
    pub(super) fn post_due(&mut self, before: u64, due: u64) -> Result<(), RunError> {
        if self.is_paused() {
            return Ok(());
        }
        if self.measures_angle()
            && let Some(deg) = self.connection.port().glove_deg()
        {
            let at = stamp(self.device_time_us());
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
