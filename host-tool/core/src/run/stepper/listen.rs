//! Listening to the device until a setpoint is due or a step is over.

use super::{RunError, Stepper};
use crate::link::{Polled, Port};

/// Maximum number of messages that are processed when a setpoint is already due. The other messages
/// are processed after the setpoint, so that a device that sends without end delays neither
/// setpoints nor the end of the session.
pub(super) const MOST_AT_ONCE: usize = 1000;

/// Reason why listening ended.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum ListenEnd {
    /// The time for the next setpoint has come.
    Due,
    /// The step is over: its time has come, or an event has ended it.
    Paused,
}

impl<P: Port> Stepper<'_, P> {
    /// Processes messages until `until_us`, when the next setpoint is due. If that time has already
    /// passed, processes the messages that have arrived by now. Returns earlier when the time
    /// `pause_us` is reached, or after an event if `ends_at_event` is true. Times are the port's,
    /// µs.
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
