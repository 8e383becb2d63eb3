//! Listening to the device until a setpoint is due or a step is over.

use super::{RunError, Stepper};
use crate::link::{Polled, Port};

/// Maximum number of messages processed at once when a setpoint is due; the others follow after the
/// setpoint. A device that sends without end therefore delays neither setpoints nor the session's
/// end.
pub(super) const MOST_AT_ONCE: usize = 1000;

/// Reason why listening ended.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum ListenEnd {
    /// The next setpoint is due.
    Due,
    /// The step is over.
    Paused,
}

impl<P: Port> Stepper<'_, P> {
    /// Processes messages that arrive by `until_us`; if that time has passed, those that have
    /// arrived by now. Pauses at the first look at the port from `pause_us` on, or at an event if
    /// `ends_at_event` is true. Times are the port's, µs.
    pub(super) fn listen(
        &mut self,
        until_us: u64,
        pause_us: u64,
        ends_at_event: bool,
    ) -> Result<ListenEnd, RunError> {
        let until_us = until_us.max(self.connection.port().now_us());
        let mut late = 0;
        while late < MOST_AT_ONCE {
            if !self.connection.has_message() {
                self.apply_controls()?;
                if self.is_stopped {
                    return Ok(ListenEnd::Due);
                }
                if self.connection.port().now_us() >= pause_us {
                    return Ok(ListenEnd::Paused);
                }
            }
            match self.connection.poll(until_us)? {
                Polled::Message(incoming) => {
                    self.note_received();
                    late += usize::from(self.heard_us > until_us);
                    self.record_message(incoming)?;
                    if let Some(ended) = self.ended.take() {
                        return Err(ended);
                    }
                    if self.is_finished {
                        return Ok(ListenEnd::Due);
                    }
                    self.poll_observer()?;
                    if ends_at_event && self.event.is_some() {
                        return Ok(ListenEnd::Paused);
                    }
                }
                Polled::Waiting => {}
                Polled::Over => break,
            }
        }
        self.check_silence()?;
        self.poll_observer()?;
        Ok(ListenEnd::Due)
    }
}
