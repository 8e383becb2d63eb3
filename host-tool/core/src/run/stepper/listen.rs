//! Listening to the device until a setpoint is due or a step is over.

use super::{RunError, Stepper};
use crate::link::{Polled, Port};

/// So many messages are filed at once when a setpoint is due, and the rest after it: a
/// device that sends without end delays neither setpoints nor the session's end.
pub(super) const MOST_AT_ONCE: usize = 1000;

/// Why listening is over.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Listened {
    /// Time to post what is due.
    Due,
    /// The step is over.
    Paused,
}

impl<P: Port> Stepper<'_, P> {
    /// Files what arrives by `until_us`, or has arrived by now if that is over; pauses at the
    /// first look at the port from `pause_us` on, or with an event.
    pub(super) fn listen(
        &mut self,
        until_us: u64,
        pause_us: u64,
        ends_at_event: bool,
    ) -> Result<Listened, RunError> {
        let until_us = until_us.max(self.connection.port().now_us());
        let mut late = 0;
        while late < MOST_AT_ONCE {
            if !self.connection.has_message() {
                self.take_controls()?;
                if self.is_stopped {
                    return Ok(Listened::Due);
                }
                if self.connection.port().now_us() >= pause_us {
                    return Ok(Listened::Paused);
                }
            }
            match self.connection.poll(until_us)? {
                Polled::Message(incoming) => {
                    self.hear();
                    late += usize::from(self.heard_us > until_us);
                    self.file(incoming)?;
                    if let Some(ended) = self.ended.take() {
                        return Err(ended);
                    }
                    if self.is_finished {
                        return Ok(Listened::Due);
                    }
                    self.poll_observer()?;
                    if ends_at_event && self.event.is_some() {
                        return Ok(Listened::Paused);
                    }
                }
                Polled::Waiting => {}
                Polled::Over => break,
            }
        }
        self.check_silence()?;
        self.poll_observer()?;
        Ok(Listened::Due)
    }
}
