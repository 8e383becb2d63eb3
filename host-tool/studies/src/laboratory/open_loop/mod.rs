//! Simulates draws without feedback. If nothing that the body does returns to the device, the
//! device's output is the same for every wearer. The whole device therefore runs once with a body
//! that records the output; then each random body receives the recorded pulses at their times,
//! without device, link and host.

use super::draw::Unit;
use super::error::LaboratoryError;
use super::experiment::{Experiment, TrialMeasures};
use super::protocol::Step;
use hal_sim::body::{Body, CHANNELS, Lead, Load, Pulse};
use host_core::link::Port;
use host_core::record::{Sample, Trial};
use host_core::run::{OpenError, RunError, SessionFile, create_body};
use host_core::session::Session;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Interval of the check against the whole device: in each shard, the first unit and then every
/// unit of this many is simulated in both ways.
const CHECKED_OF: u64 = 100;

/// Output of a device that was recorded once and is the same for every wearer.
pub(super) struct Score {
    /// Steps of the protocol that were recorded.
    steps: Vec<Step>,
    /// Session of each condition, without its body. A unit whose sessions differ cannot use the
    /// recording.
    sessions: Vec<Session>,
    /// Recorded output of each device that was opened, in order.
    parts: Vec<Part>,
    checked: Mutex<DeviceCheck>,
}

/// Recorded output of one device, from its opening to its closing.
struct Part {
    loads: [Load; CHANNELS],
    /// What the device did to the body, each with the body's time, µs.
    touches: Vec<(u64, BodyEvent)>,
    /// Trials on this device, each with the index of its condition. Where a sample normally
    /// contains the true angle, it contains the time at which the host read that angle, µs.
    trials: Vec<(usize, Trial)>,
}

/// Result of simulating units in both ways, with and without the device; all results agreed.
#[derive(Clone, Copy, Debug, Default)]
pub struct DeviceCheck {
    /// Number of units that were simulated in both ways.
    pub units: u64,
    /// Computing time of these units with the whole device.
    pub whole: Duration,
    /// Computing time of these units without the device.
    pub alone: Duration,
}

/// An event by which the device affects a body.
#[derive(Clone, Copy, Debug)]
enum BodyEvent {
    Pulse(Pulse),
    /// The output of a channel changed its state: time, µs, index of the channel, and new state.
    Lead(u64, usize, Lead),
    Begin,
}

type BodyEvents = Arc<Mutex<Vec<(u64, BodyEvent)>>>;

/// A body that records what the device does to it. In place of an angle it reports its time, µs.
struct Listener {
    loads: [Load; CHANNELS],
    now_us: u64,
    heard: BodyEvents,
}

impl Listener {
    fn note(&self, touch: BodyEvent) {
        let mut heard = self.heard.lock().unwrap_or_else(PoisonError::into_inner);
        heard.push((self.now_us, touch));
    }
}

impl Body for Listener {
    fn pulse(&mut self, pulse: &Pulse) {
        self.note(BodyEvent::Pulse(*pulse));
    }

    fn set_lead(&mut self, t_us: u64, channel: usize, lead: Lead) {
        self.note(BodyEvent::Lead(t_us, channel, lead));
    }

    fn advance(&mut self, to_us: u64) -> bool {
        self.now_us = self.now_us.max(to_us);
        true
    }

    fn begin_trial(&mut self) {
        self.note(BodyEvent::Begin);
    }

    fn angle_deg(&self) -> f64 {
        self.now_us as f64 // exact below 2^53
    }

    fn sensed_deg(&self) -> f64 {
        0.0
    }

    fn loads(&self) -> &[Load; CHANNELS] {
        &self.loads
    }

    fn loads_mut(&mut self) -> &mut [Load; CHANNELS] {
        &mut self.loads
    }
}

/// Returns whether the device's output is independent of the body's movement: the session has no
/// joint, no wall and no force control.
fn is_open(session: &Session) -> bool {
    let is_controlled = session
        .channels
        .iter()
        .any(|channel| channel.force.is_some());
    session.joint.is_none() && session.wall.is_none() && !is_controlled
}

fn without_bodies(files: &[SessionFile]) -> Vec<Session> {
    let bare = |file: &SessionFile| Session {
        body: None,
        ..file.session.clone()
    };
    files.iter().map(bare).collect()
}

impl Score {
    /// Records the device's output for the first wearer of `seed`. Returns `None` if any condition
    /// has feedback, because the output then depends on the wearer.
    ///
    /// # Errors
    /// Fails if a session is invalid or a trial ends early.
    pub(super) fn record(
        experiment: &Experiment,
        (seed, draws): (u64, u64),
    ) -> Result<Option<Self>, LaboratoryError> {
        let unit = experiment.unit(seed, draws, 0);
        let files = experiment.sessions(&unit.fields)?;
        if !files.iter().all(|file| is_open(&file.session)) {
            return Ok(None);
        }
        let mut opened = Vec::new();
        let trials = experiment.play(&unit, &files, &mut |port: &mut dyn Port| {
            let Some(world) = port.world() else { return };
            let (loads, heard) = (*world.body.loads(), BodyEvents::default());
            opened.push((loads, heard.clone()));
            world.body = Box::new(Listener {
                loads,
                now_us: 0,
                heard,
            });
        })?;
        let part = |(loads, heard): ([Load; CHANNELS], BodyEvents)| Part {
            loads,
            touches: std::mem::take(&mut *heard.lock().unwrap_or_else(PoisonError::into_inner)),
            trials: Vec::new(),
        };
        let mut parts: Vec<Part> = opened.into_iter().map(part).collect();
        // There is either one device for all trials or one for each.
        let last = parts.len().saturating_sub(1);
        for (index, trial) in trials.into_iter().enumerate() {
            if let Some(part) = parts.get_mut(index.min(last)) {
                part.trials.push(trial);
            }
        }
        Ok(Some(Self {
            steps: experiment.steps_of(unit.seed),
            sessions: without_bodies(&files),
            parts,
            checked: Mutex::default(),
        }))
    }

    /// Simulates `unit` in all conditions: without the device if the recording fits, otherwise with
    /// the whole device. With `is_checked`, does both and compares the results.
    ///
    /// # Errors
    /// Fails as [`Experiment::measure_unit`] does, or if both results differ.
    pub(super) fn measure_unit(
        &self,
        experiment: &Experiment,
        unit: &Unit,
        is_checked: bool,
    ) -> Result<Vec<TrialMeasures>, LaboratoryError> {
        let files = experiment.sessions(&unit.fields)?;
        let begin = Instant::now();
        let Some(alone) = self.play(experiment, unit, &files)? else {
            return experiment.measure_unit(unit);
        };
        let (measured, took) = (experiment.means(&files, &alone), begin.elapsed());
        if is_checked {
            let begin = Instant::now();
            let device_trials = experiment.play(unit, &files, &mut |_| ())?;
            let expected = experiment.means(&files, &device_trials);
            let mut checked = self.checked.lock().unwrap_or_else(PoisonError::into_inner);
            checked.units += 1;
            checked.whole += begin.elapsed();
            checked.alone += took;
            let name = |c: usize| {
                experiment
                    .conditions
                    .get(c)
                    .map(|condition| condition.name())
            };
            let unlike = |(c, description)| LaboratoryError::Unequal {
                unit: unit.index,
                condition: name(c).unwrap_or_default(),
                what: description,
            };
            difference(&device_trials, &alone)
                .map_or(Ok(()), |difference| Err(unlike(difference)))?;
            if measured != expected {
                return Err(unlike((0, "a measure".to_owned())));
            }
        }
        Ok(measured)
    }

    /// Returns how many units were simulated in both ways, and how long that took.
    pub(super) fn check_result(&self) -> DeviceCheck {
        *self.checked.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Simulates the trials of a unit without the device. Returns `None` if the unit's steps,
    /// sessions or electrode loads differ from the recorded ones.
    fn play(
        &self,
        experiment: &Experiment,
        unit: &Unit,
        files: &[SessionFile],
    ) -> Result<Option<Vec<(usize, Trial)>>, LaboratoryError> {
        if without_bodies(files) != self.sessions || experiment.steps_of(unit.seed) != self.steps {
            return Ok(None);
        }
        let mut trials = Vec::new();
        for part in &self.parts {
            let worn = part.trials.first().and_then(|(c, _)| files.get(*c));
            let Some(file) = worn else { continue };
            let mut body = create_body(&file.session, unit.seed).map_err(OpenError::from)?;
            if *body.loads() != part.loads {
                return Ok(None);
            }
            trials.extend(part.play(&mut *body)?);
        }
        Ok(Some(trials))
    }
}

impl Part {
    /// Replays the recorded output to `body`; returns the trials with the angles of this body.
    ///
    /// # Errors
    /// Fails if the body could not be simulated throughout.
    fn play(&self, body: &mut dyn Body) -> Result<Vec<(usize, Trial)>, RunError> {
        let mut touches = self.touches.iter();
        let mut trials = self.trials.clone();
        let mut look = |sample: &mut Sample| {
            let Some(looked_us) = sample.true_deg else {
                return;
            };
            let looked_us = looked_us as u64;
            // Events at the same microsecond were recorded after the body had advanced to that
            // time.
            while let Some((at_us, touch)) = touches.as_slice().first()
                && *at_us < looked_us
            {
                touches.next();
                body.advance(*at_us);
                match touch {
                    BodyEvent::Pulse(pulse) => body.pulse(pulse),
                    BodyEvent::Lead(t_us, channel, lead) => body.set_lead(*t_us, *channel, *lead),
                    BodyEvent::Begin => body.begin_trial(),
                }
            }
            body.advance(looked_us);
            sample.true_deg = Some(body.angle_deg());
        };
        for (_, trial) in &mut trials {
            trial.samples.modify_each(&mut look);
        }
        match body.uncomputed_intervals() {
            0 => Ok(trials),
            stretches => Err(RunError::Unsettled(stretches)),
        }
    }
}

/// Returns the index of the first condition whose trials differ between the simulations with and
/// without the device, and the difference in words; `None` if all are equal.
fn difference(
    device_trials: &[(usize, Trial)],
    alone: &[(usize, Trial)],
) -> Option<(usize, String)> {
    if device_trials.len() != alone.len() {
        return Some((0, "the number of trials".to_owned()));
    }
    let mut pairs = device_trials.iter().zip(alone);
    pairs.find_map(|((c, device_trial), (_, alone))| {
        let samples = device_trial.samples.iter().zip(&alone.samples);
        let sample = samples.into_iter().find(|(a, b)| a != b);
        let description = match sample {
            Some((whole, alone)) => in_words(&whole, &alone),
            None if device_trial.samples.len() != alone.samples.len() => {
                "the number of samples".into()
            }
            None if device_trial.events != alone.events => "an event".into(),
            None if device_trial.pulses != alone.pulses => "the number of pulses".into(),
            None if device_trial.counters != alone.counters => "a counter".into(),
            None => return None,
        };
        Some((*c, description))
    })
}

fn in_words(device_sample: &Sample, alone: &Sample) -> String {
    let t_s = device_sample.t_s;
    match (device_sample.true_deg, alone.true_deg) {
        (Some(a), Some(b)) if a != b => {
            format!("the true angle at {t_s} s is {a}° with the device, {b}° without it")
        }
        _ => format!("telemetry at {t_s} s"),
    }
}

/// Returns whether the unit at this position of a shard, from 0, is also simulated with the whole
/// device.
pub(super) const fn is_checked(position: u64) -> bool {
    position.is_multiple_of(CHECKED_OF)
}

#[cfg(test)]
mod tests;
