//! Actions at the controls: pause and resume, intensity in steps, markers, and a stop. Each action
//! is recorded with device time and host time, so that a rerun can repeat it.

use super::{Observation, Observer, ObserverRequest, RunError, Stepper};
use crate::link::{Error, Interruption, Port};
use crate::record::{Marker, MarkerKind};
use crate::session::Setpoint;
use firmware::safety::Stimulus;
use firmware::units::Amplitude;
use std::collections::VecDeque;

/// Change of a channel's intensity by one key press, percent of the amplitudes in the session file.
pub const INTENSITY_STEP: u16 = 5;

/// Maximum number of marker rows that a trial keeps in memory; the file holds all.
const MOST_MARKERS: usize = 10_000;

/// Action of a person who operates the controls during a session.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Control {
    /// Stops all channels. The time of the session continues.
    Pause,
    /// Resumes a paused session: checks the electrodes again, arms and starts. Amplitudes rise as
    /// at the first start.
    Resume,
    /// Raises the intensity of a channel, counted from 1, by [`INTENSITY_STEP`].
    Raise(u8),
    /// Lowers the intensity of a channel, counted from 1, by [`INTENSITY_STEP`], but not below 0.
    Lower(u8),
    /// Records a note with this text.
    Mark(String),
    /// Ends the session.
    Stop,
}

impl Control {
    /// Returns the action that a row of `markers.csv` records, to repeat it; `None` for a row that
    /// records an edge.
    #[must_use]
    pub fn from_marker(marker: &Marker) -> Option<Self> {
        Some(match (marker.kind, marker.channel) {
            (MarkerKind::Pause, _) => Self::Pause,
            (MarkerKind::Resume, _) => Self::Resume,
            (MarkerKind::Raise, Some(channel)) => Self::Raise(channel),
            (MarkerKind::Lower, Some(channel)) => Self::Lower(channel),
            (MarkerKind::Mark, _) => Self::Mark(marker.text.clone()),
            (MarkerKind::Stop, _) => Self::Stop,
            _ => return None,
        })
    }

    const fn kind(&self) -> MarkerKind {
        match self {
            Self::Pause => MarkerKind::Pause,
            Self::Resume => MarkerKind::Resume,
            Self::Raise(_) => MarkerKind::Raise,
            Self::Lower(_) => MarkerKind::Lower,
            Self::Mark(_) => MarkerKind::Mark,
            Self::Stop => MarkerKind::Stop,
        }
    }

    const fn channel(&self) -> Option<u8> {
        match self {
            Self::Raise(channel) | Self::Lower(channel) => Some(*channel),
            _ => None,
        }
    }
}

/// Progress of a pause that a person has requested.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(super) enum Paused {
    /// The session is not paused.
    #[default]
    No,
    /// The device was asked to stop, and its amplitudes fall to 0.
    Falling,
    /// The outputs are disconnected.
    Isolated,
}

impl<P: Port> Stepper<'_, P> {
    /// Carries out an action of a person at the controls immediately, and records it.
    ///
    /// # Errors
    /// The device is lost, or the record cannot be written. An action that is not possible (a
    /// channel at its limit, an electrode that is off at a resume) is no error: the reason is
    /// recorded and shown.
    pub fn control(&mut self, control: &Control) -> Result<(), RunError> {
        let (host_us, device_us) = (self.time_us(), self.device_time_us());
        let refused = match control {
            Control::Pause => self.pause()?,
            Control::Resume => self.resume()?,
            Control::Raise(channel) => self.raise(*channel),
            Control::Lower(channel) => self.lower(*channel),
            Control::Mark(_) => None,
            Control::Stop => {
                self.is_stopped = true;
                None
            }
        };
        let text = match (control, refused) {
            (_, Some(refused)) => refused,
            (Control::Mark(text), None) => text.clone(),
            _ => String::new(),
        };
        let channel = control.channel();
        let intensity = channel.map(|channel| self.intensity_percent(channel));
        let marker = Marker {
            t_s: self.since_start_s(device_us),
            device_us,
            host_us,
            kind: control.kind(),
            channel,
            intensity_percent: intensity,
            text,
        };
        self.attached
            .observer
            .observe(Observation::Control(&marker));
        self.record_marker(marker)
    }

    /// Returns the present intensity of a channel, counted from 1, in percent of the amplitudes in
    /// the session file.
    pub fn intensity_percent(&self, channel: u8) -> u16 {
        let index = usize::from(channel.wrapping_sub(1));
        self.intensity.get(index).copied().unwrap_or(0)
    }

    /// Returns whether a person has paused the stimulation.
    pub fn is_paused(&self) -> bool {
        self.paused != Paused::No
    }

    /// Records an edge of the trigger input or the sync output at the device time `at_us`, µs.
    pub(super) fn record_line_edge(
        &mut self,
        kind: MarkerKind,
        at_us: u64,
    ) -> Result<(), RunError> {
        let marker = Marker {
            t_s: self.since_start_s(at_us),
            device_us: at_us,
            host_us: self.time_us(),
            kind,
            channel: None,
            intensity_percent: None,
            text: String::new(),
        };
        self.record_marker(marker)
    }

    fn record_marker(&mut self, marker: Marker) -> Result<(), RunError> {
        if let Some(recorder) = &mut self.attached.recorder {
            recorder.record_marker(&marker)?;
        }
        let is_kept = marker.kind != MarkerKind::Sync;
        if is_kept && self.trial.markers.len() < MOST_MARKERS {
            self.trial.markers.push(marker);
        }
        Ok(())
    }

    /// Asks the observer for actions at the controls and carries them out. The run calls this
    /// function when no received message is stored. It acts at most once per microsecond, so that a
    /// rerun repeats the actions at the same times.
    pub(super) fn apply_controls(&mut self) -> Result<(), RunError> {
        let now_us = self.time_us();
        if now_us <= self.controlled_us {
            return Ok(());
        }
        self.controlled_us = now_us;
        // An action that took time leaves the next action to a later moment.
        while self.time_us() == now_us
            && let Some(control) = self.attached.observer.next_control(now_us)
        {
            self.control(&control)?;
        }
        Ok(())
    }

    /// Pauses the session. Returns the reason if it could not be paused, and `None` if it was
    /// paused.
    fn pause(&mut self) -> Result<Option<String>, RunError> {
        if self.is_paused() {
            return Ok(Some("the session is already paused".to_owned()));
        }
        if self.session.has_pulse_count() {
            // A new start would play trains with a fixed number of pulses again from the first
            // pulse.
            self.is_stopped = true;
            return Ok(Some(
                "trains with `repeats` cannot be resumed, so the session ends".to_owned(),
            ));
        }
        self.paused = Paused::Falling;
        self.connection.stop()?;
        Ok(None)
    }

    fn resume(&mut self) -> Result<Option<String>, RunError> {
        match self.paused {
            Paused::No => return Ok(Some("the session is not paused".to_owned())),
            Paused::Falling => return Ok(Some("the outputs are not yet disconnected".to_owned())),
            Paused::Isolated => {}
        }
        let resumed = self.arm().and_then(|()| self.start_trains());
        match resumed {
            Ok(_) => {
                self.paused = Paused::No;
                self.note_received();
                // The device was armed again, so its muscles are at the model levels of the
                // session's start.
                let now_us = self.time_us();
                for request in self.session.level_changes(0, now_us) {
                    self.connection.request(request)?;
                }
                Ok(None)
            }
            Err(RunError::Link(Error::Refused(refused))) => Ok(Some(refused.to_string())),
            Err(error) => Err(error),
        }
    }

    fn raise(&mut self, channel: u8) -> Option<String> {
        let raised = self.intensity_percent(channel) + INTENSITY_STEP;
        let Some(most) = self.highest_intensity(channel) else {
            return Some(describe_no_intensity(channel));
        };
        if raised > most {
            return Some(format!(
                "at {raised} % an amplitude of channel {channel} would exceed its limit"
            ));
        }
        self.set_intensity(channel, raised);
        None
    }

    fn lower(&mut self, channel: u8) -> Option<String> {
        if self.highest_intensity(channel).is_none() {
            return Some(describe_no_intensity(channel));
        }
        if self.intensity_percent(channel) == 0 {
            return Some(format!("channel {channel} is already at 0 %"));
        }
        let lowered = self
            .intensity_percent(channel)
            .saturating_sub(INTENSITY_STEP);
        self.set_intensity(channel, lowered);
        None
    }

    fn set_intensity(&mut self, channel: u8, percent: u16) {
        let index = usize::from(channel.wrapping_sub(1));
        if let Some(slot) = self.intensity.get_mut(index) {
            *slot = percent;
        }
    }

    /// Returns the highest intensity of a channel, counted from 1, at which all its amplitudes are
    /// within its limit, percent. `None` for a channel whose amplitudes the host does not set.
    fn highest_intensity(&self, channel: u8) -> Option<u16> {
        let peak = self
            .session
            .setpoints
            .peak_amplitude(channel.checked_sub(1)?)?;
        let limit = self.session.channel_limit(channel)?.get();
        let most = u64::from(limit) * 100 / u64::from(peak.get().max(1));
        Some(u16::try_from(most).unwrap_or(u16::MAX))
    }

    /// Returns `setpoint` with its amplitudes scaled by the intensities of their channels.
    pub(super) fn scale_setpoint(&self, setpoint: Setpoint) -> Setpoint {
        let Setpoint::Amplitudes(values) = setpoint else {
            return setpoint;
        };
        let scaled = values.into_iter().map(|value| self.scale_stimulus(value));
        Setpoint::Amplitudes(scaled.collect())
    }

    /// Scales an amplitude by the intensity of its channel (0–9). The result is rounded down to
    /// thousandths of the unit, so that rounding never raises an amplitude.
    pub(super) fn scale_stimulus(&self, (channel, stimulus): (u8, Stimulus)) -> (u8, Stimulus) {
        let percent = self.intensity.get(usize::from(channel)).copied();
        let percent = u64::from(percent.unwrap_or(0));
        let amplitude = u64::from(stimulus.amplitude.get()) * percent / 100;
        let amplitude = Amplitude::new(u32::try_from(amplitude).unwrap_or(u32::MAX));
        let scaled = Stimulus {
            amplitude,
            ..stimulus
        };
        (channel, scaled)
    }
}

fn describe_no_intensity(channel: u8) -> String {
    format!("channel {channel} has no intensity: a controller drives it, or it is not used")
}

/// Actions at the controls in a recorded trial, which a rerun repeats.
#[derive(Clone, Debug, Default)]
pub struct Keys {
    /// Actions that are not repeated yet, each with its host time since the start of the trains,
    /// µs.
    left: VecDeque<(u64, Control)>,
}

impl Keys {
    /// Returns the actions that the markers of a trial record.
    #[must_use]
    pub fn from_markers(markers: &[Marker]) -> Self {
        let keys = markers.iter();
        let keys = keys.filter_map(|marker| Some((marker.host_us, Control::from_marker(marker)?)));
        Self {
            left: keys.collect(),
        }
    }

    /// Removes and returns the next action if its time has come by `now_us`, host time since the
    /// start of the trains, µs.
    fn take_due(&mut self, now_us: u64) -> Option<Control> {
        let (_, control) = self.left.pop_front_if(|(at_us, _)| *at_us <= now_us)?;
        Some(control)
    }
}

/// Returns an observer that behaves like `observer` and also repeats the actions in `keys` at their
/// recorded times.
pub fn replay_keys<O: Observer>(keys: Keys, observer: O) -> impl Observer {
    Repeating { keys, observer }
}

struct Repeating<O> {
    keys: Keys,
    observer: O,
}

impl<O: Observer> Observer for Repeating<O> {
    fn observe(&mut self, seen: Observation<'_>) {
        self.observer.observe(seen);
    }

    fn next_request(&mut self) -> ObserverRequest {
        self.observer.next_request()
    }

    fn next_control(&mut self, now_us: u64) -> Option<Control> {
        self.keys
            .take_due(now_us)
            .or_else(|| self.observer.next_control(now_us))
    }

    fn interruption(&self) -> Option<Interruption> {
        self.observer.interruption()
    }
}
