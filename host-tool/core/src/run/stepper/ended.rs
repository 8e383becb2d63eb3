//! Handles runs that end unexpectedly: the device stopped, or sends nothing any more.

use super::{ObserverRequest, RunError, SILENCE_US, Stepper};
use crate::link::{Error, Port};
use crate::run::trial;
use firmware::link::{Event, Request};
use firmware::safety::StopCause;

impl<P: Port> Stepper<'_, P> {
    /// Notes the present time as that of the device's latest message.
    pub(super) fn note_received(&mut self) {
        self.heard_us = self.connection.port().now_us();
        self.heard_stalled_us = self.connection.total_stall_us();
    }

    /// Checks how long the device has sent nothing. Time in which this computer did not run the
    /// program does not count.
    ///
    /// # Errors
    /// The device has been silent for too long while this computer listened.
    pub(super) fn check_silence(&mut self) -> Result<(), RunError> {
        let silence_us = self
            .connection
            .port()
            .now_us()
            .saturating_sub(self.heard_us);
        let stalled_us = self.connection.total_stall_us() - self.heard_stalled_us;
        if silence_us.saturating_sub(stalled_us) <= SILENCE_US {
            return Ok(());
        }
        let error = if stalled_us > SILENCE_US {
            Error::HostStalled {
                stalled_ms: stalled_us / 1000,
                then: "afterwards the device sent nothing; what was recorded is kept".to_owned(),
            }
        } else {
            Error::NoAnswer {
                request: "setpoints",
                waited_ms: silence_us / 1000,
            }
        };
        Err(error.into())
    }

    /// Returns the error for a session that the device ended with `event`, `t_s` seconds after the
    /// start of the trains. `why` describes the event in words. The advice depends on whether the
    /// host or the connection caused the end.
    pub(super) fn ended_error(&mut self, event: &Event, t_s: f64, why: String) -> RunError {
        let (Event::Stopping(StopCause::HostSilent) | Event::Stopped(StopCause::HostSilent)) =
            event
        else {
            let advice = trial::advice(event).to_owned();
            return RunError::Ended { t_s, why, advice };
        };
        let timeout_ms = u64::from(self.session.wearer.host_timeout_ms);
        if let Some((refused_s, refused)) = &self.last_refused
            && (t_s - refused_s) * 1e3 <= timeout_ms as f64
        {
            // The host sent requests until the end, and the device refused them.
            let advice = format!(
                "the device refused this program's setpoints ({refused}), and a refused setpoint \
                 does not restart wearer.host_timeout_ms ({timeout_ms} ms); correct the \
                 setpoints and run again"
            );
            return RunError::Ended { t_s, why, advice };
        }
        let stalled_ms = self.connection.recent_stall_us() / 1000;
        // The time since the last setpoint counts towards the silence, too.
        if stalled_ms >= timeout_ms / 2 {
            let then = format!(
                "the device received no setpoint for {timeout_ms} ms and therefore ended the session \
                 at {t_s:.2} s ({why}); what was recorded is kept"
            );
            return Error::HostStalled { stalled_ms, then }.into();
        }
        let advice = format!(
            "the device received no setpoint for longer than wearer.host_timeout_ms \
             ({timeout_ms} ms), although this program was at most {} ms late: check the cable, \
             the hub or the network, and run again",
            stalled_ms.max(10)
        );
        RunError::Ended { t_s, why, advice }
    }

    /// Asks the observer what the run should do next, and does it.
    pub(super) fn poll_observer(&mut self) -> Result<(), RunError> {
        match self.attached.observer.next_request() {
            ObserverRequest::Nothing => {}
            ObserverRequest::Status => {
                self.connection.post(Request::Status)?;
            }
            ObserverRequest::Stop => {
                return Err(RunError::Interrupted { t_s: self.t_s() });
            }
        }
        Ok(())
    }
}
