//! Runs sessions whose setpoints the caller supplies and may decide on between steps.

use super::{RunError, StepEnd, Stepper};
use crate::link::Port;
use crate::record::Samples;
use firmware::link::Request;
use std::time::Duration;

/// Number of keep-alives within the longest host silence that the wearer's limits allow.
const SIGNS_OF_LIFE: u64 = 4;

impl<P: Port> Stepper<'_, P> {
    /// Makes this a live session, in which the caller sends the setpoints with [`Self::request`]
    /// and [`Self::post`]. Call this function before [`Self::configure`].
    ///
    /// In a live session, the stepper sends nothing of `[setpoints]` and requests no telemetry. It
    /// sends a keep-alive when a quarter of the wearer's `host_timeout_ms` has passed since the
    /// latest request; where time is real, a separate thread sends keep-alives. The session has no
    /// length, a step ends exactly at its time, and a refused request ends the session.
    #[must_use]
    pub fn with_live_setpoints(mut self) -> Self {
        self.keep_alive_us = Some(u64::MAX); // nothing is due before the start
        self.trial.duration_s = 0.0; // known at the end
        self
    }

    /// Forgets the samples, events and markers that are in memory, for a session without an end that
    /// nobody records.
    pub fn forget_rows(&mut self) {
        self.trial.samples = Samples::default();
        self.trial.events.clear();
        self.trial.markers.clear();
    }

    /// Sends a request, waits for its acknowledgement, and returns the device time of the
    /// acknowledgement, µs.
    ///
    /// # Errors
    /// The request is refused or not answered, or the device is lost.
    pub fn request(&mut self, request: Request) -> Result<u64, RunError> {
        let is_setpoint = shows_life(&request);
        let at_us = self.connection.request(request)?;
        self.note_received();
        if is_setpoint {
            self.delay_keep_alive();
        }
        Ok(at_us)
    }

    /// Sends a request without waiting for its answer, which a later step processes.
    ///
    /// # Errors
    /// The request is too large for the link, or the device is lost.
    pub fn post(&mut self, request: Request) -> Result<(), RunError> {
        let is_setpoint = shows_life(&request);
        self.connection.post(request)?;
        if is_setpoint {
            self.delay_keep_alive();
        }
        Ok(())
    }

    pub(super) const fn is_live(&self) -> bool {
        self.keep_alive_us.is_some()
    }

    /// Begins to send keep-alives if this is a live session. Call it when the trains start.
    pub(super) fn begin_keep_alives(&mut self) -> Result<(), RunError> {
        if self.is_live() {
            let period = Duration::from_micros(self.keep_alive_period_us());
            self.connection.start_keep_alive_thread(period)?;
            self.delay_keep_alive();
        }
        Ok(())
    }

    fn keep_alive_period_us(&self) -> u64 {
        u64::from(self.session.wearer.host_timeout_ms) * 1000 / SIGNS_OF_LIFE
    }

    /// Schedules the next keep-alive one period from now, because something was just sent to the
    /// device.
    fn delay_keep_alive(&mut self) {
        if self.is_live() && self.started_us.is_some() && self.connection.keeper().is_none() {
            let now_us = self.connection.port().now_us();
            self.keep_alive_us = Some(now_us + self.keep_alive_period_us());
        }
    }

    /// Runs a step of a live session until `to_us`, the port's time in µs; see [`Stepper::step`].
    pub(super) fn step_live(
        &mut self,
        to_us: u64,
        ends_at_event: bool,
    ) -> Result<StepEnd, RunError> {
        loop {
            if let (true, Some((t_s, event))) = (ends_at_event, self.event.take()) {
                return Ok(StepEnd::Event(t_s, event));
            }
            if self.is_finished || self.is_stopped {
                return Ok(StepEnd::Over);
            }
            let now_us = self.connection.port().now_us();
            if now_us >= to_us {
                return Ok(StepEnd::Reached);
            }
            if self.keep_alive_us.is_some_and(|due_us| now_us >= due_us) {
                self.post(Request::KeepAlive)?;
            }
            let time_us = self.time_us();
            self.post_programs(time_us)?;
            let due_us = self.keep_alive_us.unwrap_or(to_us);
            let due_us = due_us.min(self.next_program_us().unwrap_or(to_us));
            self.listen(to_us.min(due_us), to_us, ends_at_event)?;
            self.take_outputs();
        }
    }
}

/// Returns whether the device takes a request as a sign that its host is alive: a keep-alive or a
/// setpoint, and nothing else, such as a measurement.
const fn shows_life(request: &Request) -> bool {
    matches!(
        request,
        Request::KeepAlive
            | Request::Amplitudes { .. }
            | Request::Angle { .. }
            | Request::Force { .. }
            | Request::Wrench { .. }
            | Request::ObjectHeld { .. }
    )
}
