//! The known state of the device.

use super::Hands;
use firmware::link::{Counters, Event, HelloInfo, Status};
use firmware::safety::{FaultRecord, RemainingAllowance, State};
use host_core::record::{DeviceKind, DeviceState, Marker, MarkerKind, Sample};
use host_core::run::{Observation, SessionFile, describe_event, device_kind};
use host_core::session::escape_control_chars;
use std::collections::VecDeque;

/// Duration of the telemetry kept for the chart, s.
const KEEP_S: f64 = 30.0;

/// Largest number of samples kept for the chart, whatever their times.
const KEEP_SAMPLES: usize = 30_000;

/// Largest number of notes that are kept.
const KEEP_NOTES: usize = 100;

/// Time for which the dashboard shows that an amplitude was clamped, s. A single clamped sample is
/// then visible.
const LIMITING_S: f64 = 0.5;

/// A channel as the dashboard shows it.
#[derive(Clone, PartialEq, Debug)]
pub struct Channel {
    /// Number on the board, 1–10.
    pub number: u8,
    /// Name for people, such as "flexor A".
    pub name: String,
    /// Unit of its amplitude: "V" or "mA".
    pub unit: &'static str,
    /// The wearer's limit, in that unit.
    pub limit: f64,
    /// Index in [`Sample::forces_n`], if the channel's force is predicted.
    pub force: Option<usize>,
}

/// A message about an event.
#[derive(Clone, PartialEq, Debug)]
pub struct Note {
    /// Time on the dashboard's clock, s.
    pub t_s: f64,
    pub text: String,
    /// Whether the note reports a fault, a refusal or a failure.
    pub is_bad: bool,
}

/// The known state of a device, and of its session if one runs.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Model {
    /// Title of the session.
    pub title: String,
    /// Device, as the user named it.
    pub device: String,
    /// Kind and firmware version that the device reports.
    pub kind: Option<(DeviceKind, [u8; 3])>,
    /// Length of the session, s.
    pub duration_s: Option<f64>,
    /// Channels of the session, by rising number.
    pub channels: Vec<Channel>,
    /// Whether the device measures or controls a joint, so that the samples have angles.
    pub has_joint: bool,
    /// The dashboard's clock, s, from the start of the session or of watching.
    pub t_s: f64,
    /// Latest state that the device reported.
    pub state: State,
    /// Latched fault, or the last one if none is latched; `None` if no fault was reported.
    pub fault: Option<FaultRecord>,
    /// The device's counters since it booted.
    pub counters: Counters,
    /// Latest report of the time and charge that the wearer may still receive.
    pub left: Option<RemainingAllowance>,
    /// Recent telemetry, oldest first.
    pub samples: VecDeque<Sample>,
    /// Recent notes, oldest first.
    pub notes: VecDeque<Note>,
    /// Number of notes so far, including those no longer kept.
    pub noted: usize,
    /// Time since the last message of the device, s of the wall clock.
    pub silent_s: f64,
    /// Whether a stop was requested and is not finished.
    pub is_ending: bool,
    /// The keyboard, if it controls the session.
    pub hands: Option<Hands>,
}

impl Model {
    /// Creates the model before the first message from `device`, on which `session` will run.
    pub fn new(device: &str, session: Option<&SessionFile>) -> Self {
        let mut model = Self {
            title: "watching, no session".to_owned(),
            device: device.to_owned(),
            ..Self::default()
        };
        if let Some(SessionFile { session, .. }) = session {
            let mut forces = 0..;
            model.title.clone_from(&session.title);
            model.duration_s = Some(session.duration_us as f64 / 1e6);
            model.has_joint = session.sensor().is_some();
            let channels = session.channels.iter().map(|channel| Channel {
                number: channel.number,
                name: channel.name.clone(),
                unit: channel.unit().symbol(),
                limit: f64::from(channel.spec.limit.get()) / 1e3,
                force: channel.muscle.as_ref().and_then(|_| forces.next()),
            });
            model.channels = channels.collect();
            for note in &session.notes {
                model.note(0.0, note.clone(), false);
            }
        }
        model
    }

    /// Updates the model with an observation of a run.
    pub fn observe(&mut self, seen: Observation<'_>) {
        self.silent_s = 0.0;
        match seen {
            Observation::Hello(info) => self.greet(info),
            Observation::Sample(sample) => self.sample(sample.clone()),
            Observation::Event(t_s, event) => self.event(t_s, event),
            Observation::Refused(t_s, refused) => self.note(t_s, refused.to_string(), true),
            Observation::Status(status) => self.status(status),
            Observation::Control(marker) => self.control(marker),
            Observation::Progress(_) => {}
        }
    }

    /// Lets the keyboard control the session from now on.
    #[must_use]
    pub fn with_hands(mut self) -> Self {
        let channels = self.channels.iter().map(|channel| channel.number);
        self.hands = Some(Hands::new(channels.collect()));
        self
    }

    pub fn note(&mut self, t_s: f64, text: String, is_bad: bool) {
        self.notes.push_back(Note { t_s, text, is_bad });
        self.noted += 1;
        if self.notes.len() > KEEP_NOTES {
            self.notes.pop_front();
        }
    }

    /// Returns whether a computed amplitude was clamped in the last half second.
    pub fn is_limiting(&self) -> bool {
        let from = self.t_s - LIMITING_S;
        let recent = self.samples.iter().rev().take_while(|s| s.t_s >= from);
        self.is_on() && recent.into_iter().any(|s| s.limiting)
    }

    /// Returns whether pulses may play.
    pub fn is_on(&self) -> bool {
        matches!(self.state, State::Stimulating | State::Stopping)
    }

    /// Returns the amplitude of the `index`-th channel in its unit; 0 when nothing plays.
    pub fn amplitude(&self, index: usize) -> f64 {
        let sample = self.samples.back().filter(|_| self.is_on());
        let amplitude = sample.and_then(|s| s.amplitudes.get(index));
        amplitude.copied().flatten().unwrap_or(0.0)
    }

    /// Returns the predicted force of a channel, N; `None` when nothing plays.
    pub fn force_n(&self, channel: &Channel) -> Option<f64> {
        let sample = self.samples.back().filter(|_| self.is_on())?;
        sample.forces_n.get(channel.force?).copied().flatten()
    }

    fn control(&mut self, marker: &Marker) {
        if let Some(hands) = &mut self.hands {
            let has_effect = marker.text.is_empty();
            match marker.kind {
                MarkerKind::Pause => hands.is_paused = true,
                MarkerKind::Resume => hands.is_paused = !has_effect,
                _ => {}
            }
            let place = hands.channels.iter();
            let place = place
                .into_iter()
                .position(|place| Some(*place) == marker.channel);
            if let Some(slot) = place.and_then(|place| hands.intensities.get_mut(place))
                && let Some(percent) = marker.intensity_percent
            {
                *slot = percent;
            }
        }
        let mut text = marker.kind.word().to_owned();
        if let (Some(channel), Some(percent)) = (marker.channel, marker.intensity_percent) {
            text += &format!(" channel {channel}: {percent} %");
        }
        if !marker.text.is_empty() {
            text += &format!(": {}", escape_control_chars(&marker.text));
        }
        self.note(marker.t_s, text, false);
    }

    fn greet(&mut self, info: &HelloInfo) {
        self.kind = Some((device_kind(info), info.version));
        self.state = info.state;
        self.fault = info.last_fault;
    }

    fn sample(&mut self, sample: Sample) {
        let from = sample.t_s - KEEP_S;
        self.has_joint |= sample.target_deg.is_some() || sample.measured_deg.is_some();
        self.t_s = sample.t_s;
        self.state = match sample.state {
            DeviceState::Boot => State::Boot,
            DeviceState::Idle => State::Idle,
            DeviceState::Armed => State::Armed,
            DeviceState::Stimulating => State::Stimulating,
            DeviceState::Stopping => State::Stopping,
            DeviceState::Fault => State::Fault,
        };
        self.samples.push_back(sample);
        while self.samples.len() > KEEP_SAMPLES
            || self.samples.front().is_some_and(|s| s.t_s < from)
        {
            self.samples.pop_front();
        }
    }

    fn event(&mut self, t_s: f64, seen: &Event) {
        match seen {
            Event::Stopping(_) => self.state = State::Stopping,
            Event::Stopped(_) | Event::Recovered => self.state = State::Idle,
            Event::Electrode { .. } | Event::LimitCycle { .. } | Event::HoldExpired => {}
            Event::TriggerEdge | Event::SyncEdge => return, // too many for notes
            Event::Faulted(record) => {
                self.state = State::Fault;
                self.fault = Some(*record);
            }
        }
        self.note(t_s, describe_event(seen), matches!(seen, Event::Faulted(_)));
    }

    fn status(&mut self, status: &Status) {
        self.state = status.state;
        self.fault = status.fault;
        self.counters = status.counters;
        self.left = status.remaining;
    }
}
