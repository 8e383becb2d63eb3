//! A session whose setpoints the caller gives, and may decide on between steps.

use super::{RunError, Stepped, Stepper};
use crate::link::Port;
use firmware::link::Request;
use std::time::Duration;

/// Keep-alives in the host silence that the wearer allows.
const SIGNS_OF_LIFE: u64 = 4;

impl<P: Port> Stepper<'_, P> {
    /// Leaves the setpoints to the caller, who sends them with [`Self::request`] and
    /// [`Self::post`]; call it before [`Self::configure`].
    ///
    /// The stepper sends nothing of `[setpoints]` and asks for no telemetry. It sends a
    /// keep-alive when a quarter of the wearer's `host_timeout_ms` has passed since the latest
    /// request; where time is real, a thread of its own sends them. The session has no length,
    /// a step ends exactly at its time, and a refusal ends the session.
    #[must_use]
    pub fn live(mut self) -> Self {
        self.keep_alive_us = Some(u64::MAX); // nothing is due before the start
        self
    }

    /// Sends a request and waits for its acknowledgement: the device time of it, µs.
    ///
    /// # Errors
    /// Refused, not answered, lost.
    pub fn request(&mut self, request: Request) -> Result<u64, RunError> {
        let at_us = self.connection.request(request)?;
        self.hear();
        self.delay_keep_alive();
        Ok(at_us)
    }

    /// Sends a request without waiting: the next steps take its answer.
    ///
    /// # Errors
    /// Too large for the link, lost.
    pub fn post(&mut self, request: Request) -> Result<(), RunError> {
        self.connection.post(request)?;
        self.delay_keep_alive();
        Ok(())
    }

    pub(super) const fn is_live(&self) -> bool {
        self.keep_alive_us.is_some()
    }

    /// Trains of a live session start: from now on the device hears of its host.
    pub(super) fn begin_keep_alives(&mut self) -> Result<(), RunError> {
        if self.is_live() {
            let period = Duration::from_micros(self.keep_alive_period_us());
            self.connection.keep_alive_apart(period)?;
            self.delay_keep_alive();
        }
        Ok(())
    }

    fn keep_alive_period_us(&self) -> u64 {
        u64::from(self.session.wearer.host_timeout_ms) * 1000 / SIGNS_OF_LIFE
    }

    /// The device has just been sent something.
    fn delay_keep_alive(&mut self) {
        if self.is_live() && self.started_us.is_some() && self.connection.keeper().is_none() {
            let now_us = self.connection.port().now_us();
            self.keep_alive_us = Some(now_us + self.keep_alive_period_us());
        }
    }

    /// [`Stepper::step`] of a live session, to `to_us` of the port's time.
    pub(super) fn step_live(
        &mut self,
        to_us: u64,
        ends_at_event: bool,
    ) -> Result<Stepped, RunError> {
        loop {
            if let (true, Some((t_s, event))) = (ends_at_event, self.event.take()) {
                return Ok(Stepped::Event(t_s, event));
            }
            if self.is_finished || self.is_stopped {
                return Ok(Stepped::Over);
            }
            let now_us = self.connection.port().now_us();
            if now_us >= to_us {
                return Ok(Stepped::Reached);
            }
            if self.keep_alive_us.is_some_and(|due_us| now_us >= due_us) {
                self.post(Request::KeepAlive)?;
            }
            let due_us = self.keep_alive_us.unwrap_or(to_us);
            self.listen(to_us.min(due_us), to_us, ends_at_event)?;
            self.take_outputs();
        }
    }
}
