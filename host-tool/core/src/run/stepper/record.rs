//! Records messages of the device while a session runs.

use super::{Paused, RunError, Stepper, TAKE_US};
use crate::link::{Error, Incoming, Port, RefusalInWords};
use crate::record::MarkerKind;
use crate::run::{Observation, identity, pulses, trial};
use crate::session::{newtons, possible_part};
use firmware::link::{Code, Event};
use firmware::safety::StopCause;

/// Maximum number of events that a record contains, and of refusals. Only a broken device sends
/// more.
const MOST_EVENTS: usize = 10_000;

/// Maximum number of readings of the electrode check that a record contains; this is several for
/// each of ten channels.
const MOST_READINGS: usize = 100;

impl<P: Port> Stepper<'_, P> {
    /// Records the identity of the device.
    pub(super) fn record_identity(&mut self) -> Result<(), RunError> {
        let in_process = self.connection.port().world().is_some();
        let identity = identity(&self.info, in_process);
        if let Some(recorder) = &mut self.attached.recorder {
            recorder.record_identity(&identity)?;
        }
        self.trial.identity = Some(identity);
        Ok(())
    }

    /// Receives and records the readings of the electrode check, which [`Self::arm`] makes the
    /// device take. Call it before the trains start; a later step would record them too.
    ///
    /// # Errors
    /// The record cannot be written.
    pub fn read_electrodes(&mut self) -> Result<(), RunError> {
        let now_us = self.connection.port().now_us();
        while let Ok(Some(incoming)) = self.connection.next(now_us) {
            if let Incoming::Event(_, event) = incoming {
                self.record_electrode(&event)?;
            }
        }
        Ok(())
    }

    /// Records an event that is a reading of the electrode check. Returns whether it is one.
    fn record_electrode(&mut self, event: &Event) -> Result<bool, RunError> {
        let &Event::Electrode {
            channel,
            applied,
            current_ua,
        } = event
        else {
            return Ok(false);
        };
        if self.trial.electrode_check.len() >= MOST_READINGS {
            self.left_out += 1;
            return Ok(true);
        }
        let reading = trial::electrode_reading(&self.trial.channels, channel, applied, current_ua);
        if let Some(recorder) = &mut self.attached.recorder {
            recorder.record_electrode(reading)?;
        }
        self.trial.electrode_check.push(reading);
        Ok(true)
    }

    /// Records the fit of the device's clock.
    pub(super) fn record_clock(&mut self) {
        let clock = self.connection.clock_fit().map(identity::to_clock_fit);
        if let Some(recorder) = &mut self.attached.recorder {
            recorder.record_clock(clock);
        }
        self.trial.clock = clock;
    }

    /// Records the number of pulses that were output and, if there were none, the likely reason.
    /// The number remains unknown if the device was lost before it reported its count.
    pub(super) fn count_pulses(&mut self) {
        let counted = |name: &str| {
            let found = self.trial.counters.iter().find(|(n, _)| n == name);
            found.map(|&(_, count)| count)
        };
        let idle = counted("triggers without a train").unwrap_or(0);
        let device_count = counted("pulses started").map(|n| (n as u32).wrapping_sub(self.checked));
        let played = match self.connection.port().world() {
            Some(world) => {
                let trace = &world.recorder.trace;
                let left = pulses::count_pulses(&self.session, trace, self.started_us.unwrap_or(0));
                Some(self.taken.0 + left)
            }
            None => device_count.map(u64::from),
        };
        self.trial.pulses = played;
        if played == Some(0) {
            let length_us = (self.trial.duration_s * 1e6).round() as u64;
            let why = pulses::silence_reason(&self.session, length_us, idle);
            self.trial.silent = Some(why.to_owned());
        }
        if let Some(recorder) = &mut self.attached.recorder {
            recorder.record_pulses(played, self.trial.silent.as_deref());
        }
    }

    /// Passes the output of a simulated device to its receiver, once every [`TAKE_US`].
    pub(super) fn take_outputs(&mut self) {
        let now_us = self.connection.port().now_us();
        if now_us >= self.taken.1 + TAKE_US {
            self.taken.1 = now_us;
            // The output of the latest steps may still change.
            self.take_outputs_until(now_us - TAKE_US / 2);
        }
    }

    /// Passes the rest of the output to its receiver at the end of the run.
    pub(super) fn take_the_last_outputs(&mut self) {
        self.take_outputs_until(u64::MAX);
        let now_us = self.connection.port().now_us();
        if let Some(outputs) = &mut self.attached.outputs {
            outputs.end(now_us);
        }
    }

    fn take_outputs_until(&mut self, until_us: u64) {
        if let Some(outputs) = &mut self.attached.outputs
            && let Some(world) = self.connection.port().world()
        {
            let piece = world.recorder.trace.take(until_us);
            self.taken.0 +=
                pulses::count_pulses(&self.session, &piece, self.started_us.unwrap_or(0));
            outputs.receive(&piece, self.started_us.unwrap_or(0));
        }
    }

    /// Returns the time of the latest recorded sample, s since the start of the trains.
    pub(super) fn t_s(&self) -> f64 {
        self.trial.samples.last().map_or(0.0, |sample| sample.t_s)
    }

    /// Records the time at which the session ended early, and the reason.
    pub(super) fn record_early_end(&mut self, error: &RunError) {
        let t_s = self.t_s();
        self.trial.duration_s = t_s;
        let text = error.to_string();
        if let Some(recorder) = &mut self.attached.recorder {
            let _ = recorder.record_event(t_s, &text); // the first error is the one to tell
        }
        self.trial.events.push((t_s, text));
    }

    pub(super) fn record_message(&mut self, incoming: Incoming) -> Result<(), RunError> {
        match incoming {
            Incoming::Telemetry(at_us, telemetry) => {
                if at_us >= self.epoch {
                    let true_deg = self.connection.port().true_deg();
                    let t_s = self.since_start_s(at_us);
                    let mut sample = trial::to_sample(&telemetry, t_s, true_deg);
                    if self.session.limb.is_some() {
                        let force = self.connection.port().hand_force_n().into_iter().flatten();
                        sample.hand_true_n = force.map(Some).collect();
                    }
                    if let Some(recorder) = &mut self.attached.recorder {
                        recorder.record_sample(&sample)?;
                    }
                    self.attached.observer.observe(Observation::Sample(&sample));
                    self.trial.samples.push(sample);
                }
            }
            Incoming::Event(at_us, Event::TriggerEdge) => {
                self.record_line_edge(MarkerKind::Trigger, at_us)?;
            }
            Incoming::Event(at_us, Event::SyncEdge) => {
                self.record_line_edge(MarkerKind::Sync, at_us)?
            }
            Incoming::Event(at_us, event) => {
                if self.record_electrode(&event)? {
                    return Ok(());
                }
                let text = trial::describe_event(&event);
                let t_s = self.since_start_s(at_us);
                self.attached
                    .observer
                    .observe(Observation::Event(t_s, &event));
                self.event = Some((t_s, event));
                self.record_event(t_s, text.clone())?;
                let is_finished = event == Event::Stopped(StopCause::Finished);
                self.is_finished |= is_finished;
                let is_end = matches!(
                    event,
                    Event::Faulted(_) | Event::Stopping(_) | Event::Stopped(_)
                );
                if self.is_paused() && event == Event::Stopped(StopCause::Request) {
                    self.paused = Paused::Isolated;
                }
                let is_by_hand = self.is_paused()
                    && matches!(
                        event,
                        Event::Stopping(StopCause::Request) | Event::Stopped(StopCause::Request)
                    );
                if is_end && !is_finished && !is_by_hand && self.ended.is_none() {
                    self.ended = Some(self.ended_error(&event, t_s, text));
                }
            }
            // These are the last setpoints, which a stop has overtaken; the event of the stop is
            // recorded.
            Incoming::Refused(_, refused) if refused.number == Code::Stopped as u16 => {}
            Incoming::Refused(seq, refused) => {
                self.refused += 1;
                let at_us = self.device_time_us();
                let t_s = self.since_start_s(at_us);
                self.attached
                    .observer
                    .observe(Observation::Refused(t_s, &refused));
                let nearest = self
                    .describe_nearest_force(seq, &refused)
                    .unwrap_or_default();
                self.record_event(t_s, format!("{refused}{nearest}"))?;
                if self.is_live() && self.ended.is_none() {
                    self.ended = Some(Error::Refused(refused.clone()).into());
                }
                self.last_refused = Some((t_s, refused));
            }
            Incoming::Status(_, status) => {
                self.attached.observer.observe(Observation::Status(&status))
            }
            Incoming::Acknowledged(..) | Incoming::Hello(_) => {}
        }
        Ok(())
    }

    /// Describes the wanted force at the hand and the nearest possible one, in words, if the device
    /// refused a request because the arm cannot produce the wanted force; `None` for other
    /// refusals.
    fn describe_nearest_force(&self, seq: Option<u16>, refused: &RefusalInWords) -> Option<String> {
        let (_, permille) = refused.allowed?;
        if refused.code() != Some(Code::WrenchOutOfReach) {
            return None;
        }
        let mut wishes = self.wishes.iter();
        let (_, wanted) = wishes.find(|(known, _)| Some(*known) == seq)?;
        let made = possible_part(*wanted, u16::try_from(permille).ok()?);
        Some(format!(
            "; requested: {}; nearest possible force: {}",
            newtons(*wanted),
            newtons(made)
        ))
    }

    /// Records how many events were not recorded because there were too many.
    pub(super) fn count_left_out(&mut self) {
        if self.left_out == 0 {
            return;
        }
        let text = format!("{} more events were not recorded", self.left_out);
        let t_s = self.t_s();
        if let Some(recorder) = &mut self.attached.recorder {
            let _ = recorder.record_event(t_s, &text); // written again at the end
        }
        self.trial.events.push((t_s, text));
    }

    fn record_event(&mut self, t_s: f64, text: String) -> Result<(), RunError> {
        if self.trial.events.len() >= MOST_EVENTS {
            self.left_out += 1;
            return Ok(());
        }
        if let Some(recorder) = &mut self.attached.recorder {
            recorder.record_event(t_s, &text)?;
        }
        self.trial.events.push((t_s, text));
        Ok(())
    }
}
