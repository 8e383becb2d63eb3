//! Stalls of this computer: reports them, and continues after them.
//!
//! Keep-alives come from a separate thread. If the device ends stimulation because it heard of no
//! host, and that thread had a pause that is long enough, the computer was to blame and not the
//! device. The electrode is then armed again, silent, at the step where it was, and the level that
//! was cut short counts for nothing.

use super::{Conduct, Procedure, describe_position, host_timeout_ms};
use crate::calibration::{CalibrationError, Entry};
use crate::link::{Error, Incoming, Port};
use firmware::link::Event;
use firmware::safety::StopCause;
use std::time::Duration;

/// Largest number of stalls within [`WITHIN_US`] after which the calibration continues.
const MOST: usize = 5;

/// Time within which stalls are counted, µs: one minute of the device's time.
const WITHIN_US: u64 = 60_000_000;

impl<P: Port, M: Procedure> Conduct<'_, '_, P, M> {
    /// Continues at the present electrode and step after a stall of this computer. `pause` is the
    /// longest time between two keep-alives.
    ///
    /// # Errors
    /// There were too many stalls, or the device failed again.
    pub(super) fn recover(&mut self, pause: Duration) -> Result<(), CalibrationError> {
        let t_us = self.t_us();
        self.stalls.push_back(t_us);
        while (self.stalls.front()).is_some_and(|first| t_us - first > WITHIN_US) {
            self.stalls.pop_front();
        }
        let view = self.machine.view(t_us);
        let pause_ms = u32::try_from(pause.as_millis()).unwrap_or(u32::MAX);
        let channel = view.channel;
        self.record(&Entry::Stalled { channel, pause_ms })?;
        if self.stalls.len() > MOST {
            let count = self.stalls.len();
            return Err(CalibrationError::Stalls(
                count,
                pause_ms,
                describe_position(&view),
            ));
        }
        if self.is_given {
            self.machine.discard_level(t_us);
        }
        if self.machine.is_finished() {
            return Ok(());
        }
        self.stop()?;
        self.arm(view.electrode.saturating_sub(1))
    }

    /// Returns the pause between keep-alives of this computer that made the device end stimulation
    /// and so led to `error`. Returns `None` if `error` has another cause.
    ///
    /// # Errors
    /// The device is lost.
    pub(super) fn host_pause(
        &mut self,
        error: &CalibrationError,
    ) -> Result<Option<Duration>, CalibrationError> {
        if !self.is_kept {
            return Ok(None);
        }
        if let CalibrationError::Link(Error::Refused(_)) = error {
            // A refusal that follows from the end of stimulation arrives after the event of that
            // end.
            let now_us = self.client.port().now_us();
            while let Some(incoming) = self.client.next(now_us)? {
                if let Incoming::Event(_, event) = incoming {
                    self.note_end(&event);
                }
            }
        } else if !matches!(error, CalibrationError::Ended(..)) {
            return Ok(None);
        }
        let timeout = Duration::from_millis(host_timeout_ms(&self.sessions).into());
        let keeper = self.client.keeper();
        let keeper = keeper.filter(|_| self.ended == Some(StopCause::HostSilent));
        Ok(keeper.and_then(|keeper| keeper.explaining_pause(timeout)))
    }

    /// Remembers why the device ended stimulation, if `event` reports this. Only the first reason
    /// counts.
    pub(super) fn note_end(&mut self, event: &Event) {
        if let Event::Stopping(cause) | Event::Stopped(cause) = event {
            self.ended.get_or_insert(*cause);
        }
    }
}
