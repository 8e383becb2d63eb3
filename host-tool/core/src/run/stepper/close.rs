//! Ends a session: stops the device in every case, and records the rest.

use super::listen::MOST_AT_ONCE;
use super::{
    Attachments, Observation, Outcome, RunError, Stepper, Stopped, to_signal_error, trial,
};
use crate::link::{Error, Incoming, Port};
use firmware::link::Event;

/// Longest time to wait after a stop until the device reports that its outputs are disconnected,
/// µs.
const STOP_US: u64 = 300_000;

impl<'a, P: Port> Stepper<'a, P> {
    /// Requests a stop of the device and waits for the acknowledgement, even if a signal arrives.
    ///
    /// # Errors
    /// The device does not answer or is lost; then it stops by itself.
    pub fn stop(&mut self) -> Result<(), Error> {
        self.connection.ignore_signals();
        self.connection.stop().map(drop)
    }

    /// Stops the device and ends the run; returns the outcome and the port. `ran` is the result of
    /// the session's steps. If it is an error, errors of the stop are not reported.
    pub fn close(self, ran: Result<(), RunError>) -> (Outcome, P) {
        let (outcome, port, _) = self.close_keeping_attachments(ran);
        (outcome, port)
    }

    /// Ends the run as [`Self::close`] does, and also returns the recorder, the receiver of outputs
    /// and the observer, for a caller that owns none of them.
    pub fn close_keeping_attachments(
        mut self,
        ran: Result<(), RunError>,
    ) -> (Outcome, P, Attachments<'a>) {
        let is_started = self.started_us.is_some();
        let t_s = is_started.then(|| self.t_s());
        // Request a stop in every case; a lost device stops by itself.
        let stopped = self.stop();
        if !is_started {
            // An error here is dropped, because the first error is the one to report.
            let _ = self.read_electrodes();
        }
        let finished = match &stopped {
            Ok(()) if is_started => self.finish(),
            _ => Ok(()),
        };
        let result = match (ran, stopped) {
            (Ok(()), Ok(())) => finished,
            (Ok(()), Err(error)) => Err(error.into()),
            (Err(error), Ok(())) => Err(to_signal_error(error, t_s, Stopped::Acknowledged)),
            (Err(error), Err(why)) => Err(to_signal_error(error, t_s, Stopped::Unanswered(why))),
        };
        let has_length = !self.is_live();
        if (self.is_stopped || !has_length) && result.is_ok() {
            self.trial.duration_s = self.t_s();
        }
        self.record_clock();
        self.count_left_out();
        if let Err(error) = &result {
            self.record_early_end(error);
        }
        if is_started {
            self.take_the_last_outputs();
            self.count_pulses();
        }
        let outcome = Outcome {
            trial: self.trial,
            device: Some(self.info),
            epoch_us: self.started_us,
            refused: self.refused,
            error: result.err(),
        };
        (outcome, self.connection.into_port(), self.attached)
    }

    /// Waits until the device reports that its outputs are disconnected after the stop, then
    /// requests its counters.
    fn finish(&mut self) -> Result<(), RunError> {
        let wait_us = if self.is_finished { 0 } else { STOP_US };
        let until = self.connection.port().now_us() + wait_us;
        for _ in 0..MOST_AT_ONCE {
            let Some(incoming) = self.connection.next(until)? else {
                break;
            };
            let is_end = matches!(
                incoming,
                Incoming::Event(_, Event::Stopped(_) | Event::Faulted(_))
            );
            self.record_message(incoming)?;
            if is_end {
                break;
            }
        }
        let status = self.connection.status()?;
        self.attached.observer.observe(Observation::Status(&status));
        self.trial.counters = trial::counter_differences(&self.begun, &status.counters);
        if !self.is_live() {
            self.connection.subscribe(0)?;
        }
        let world = self.connection.port().world();
        match world.map_or(0, |world| world.body.uncomputed_intervals()) {
            0 => Ok(()),
            stretches => Err(RunError::Unsettled(stretches)),
        }
    }
}
