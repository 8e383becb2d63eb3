//! Draws without feedback: where nothing that the body does comes back to the device,
//! what the device puts out is the same for every wearer. It plays once, the whole of
//! it, to somebody who only listens; then each drawn body is given those pulses at
//! those times, without device, link and host.

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

/// Of so many units that a part of a sweep computes, one runs on the whole device as
/// well; the first of them always.
const CHECKED_OF: u64 = 100;

/// What a device does to whoever wears it.
pub(super) struct Score {
    /// What the wearers go through.
    steps: Vec<Step>,
    /// The session of each condition, without its body.
    sessions: Vec<Session>,
    /// Each device that was opened.
    parts: Vec<Part>,
    checked: Mutex<DeviceCheck>,
}

/// From when a device is opened until it is left.
struct Part {
    loads: [Load; CHANNELS],
    /// What reached the body, and to when it had lived by then, µs.
    touches: Vec<(u64, BodyEvent)>,
    /// With their conditions. For the true angle of a sample stands when the host looked
    /// at it, µs.
    trials: Vec<(usize, Trial)>,
}

/// What came of the units that ran on the whole device as well: all were equal.
#[derive(Clone, Copy, Debug, Default)]
pub struct DeviceCheck {
    /// How many.
    pub units: u64,
    /// How long they took on the whole device.
    pub whole: Duration,
    /// How long as bodies and schedules alone.
    pub alone: Duration,
}

/// What reaches a body.
#[derive(Clone, Copy, Debug)]
enum BodyEvent {
    Pulse(Pulse),
    /// From when on, µs, what a channel's stage does with its lead.
    Lead(u64, usize, Lead),
    Begin,
}

type BodyEvents = Arc<Mutex<Vec<(u64, BodyEvent)>>>;

/// A body that notes down what reaches it. Its angle is the time.
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
        self.now_us as f64 // whole below 2^53
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

/// Whether nothing that a body does changes what is put out.
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
    /// Of an experiment none of whose conditions has feedback, played to the first
    /// wearer of `seed`; none of another.
    ///
    /// # Errors
    /// A session that no device arms, or one that ended early.
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
        // One device for all trials, or one for each.
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

    /// What `unit` does in each condition: body and schedule alone where the schedule
    /// is that of all, else the whole device; both if `is_checked`.
    ///
    /// # Errors
    /// As [`Experiment::perform`], and the two are not equal.
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
            let whole = experiment.play(unit, &files, &mut |_| ())?;
            let expected = experiment.means(&files, &whole);
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
            let unlike = |(c, what)| LaboratoryError::Unequal {
                unit: unit.index,
                condition: name(c).unwrap_or_default(),
                what,
            };
            difference(&whole, &alone).map_or(Ok(()), |difference| Err(unlike(difference)))?;
            if measured != expected {
                return Err(unlike((0, "a measure".to_owned())));
            }
        }
        Ok(measured)
    }

    /// What came of the units checked.
    pub(super) fn check_result(&self) -> DeviceCheck {
        *self.checked.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The trials of a unit, or nothing if it has a schedule of its own.
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
    /// The trials, as they are with this body.
    ///
    /// # Errors
    /// The body was not computed throughout.
    fn play(&self, body: &mut dyn Body) -> Result<Vec<(usize, Trial)>, RunError> {
        let mut touches = self.touches.iter();
        let mut trials = self.trials.clone();
        let mut look = |sample: &mut Sample| {
            let Some(looked_us) = sample.true_deg else {
                return;
            };
            let looked_us = looked_us as u64; // whole
            // What came at the same microsecond came after the body had lived to it.
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

/// In which condition the whole device and body and schedule alone first differ, and
/// in what.
fn difference(whole: &[(usize, Trial)], alone: &[(usize, Trial)]) -> Option<(usize, String)> {
    if whole.len() != alone.len() {
        return Some((0, "the number of trials".to_owned()));
    }
    let mut pairs = whole.iter().zip(alone);
    pairs.find_map(|((c, whole), (_, alone))| {
        let samples = whole.samples.iter().zip(&alone.samples);
        let sample = samples.into_iter().find(|(a, b)| a != b);
        let what = match sample {
            Some((whole, alone)) => in_words(&whole, &alone),
            None if whole.samples.len() != alone.samples.len() => "the number of samples".into(),
            None if whole.events != alone.events => "an event".into(),
            None if whole.pulses != alone.pulses => "the number of pulses".into(),
            None if whole.counters != alone.counters => "a counter".into(),
            None => return None,
        };
        Some((*c, what))
    })
}

fn in_words(whole: &Sample, alone: &Sample) -> String {
    let t_s = whole.t_s;
    match (whole.true_deg, alone.true_deg) {
        (Some(a), Some(b)) if a != b => {
            format!("the true angle at {t_s} s is {a}° there, {b}° here")
        }
        _ => format!("telemetry at {t_s} s"),
    }
}

/// Whether the unit at this position of a part, from 0, is checked.
pub(super) const fn is_checked(position: u64) -> bool {
    position.is_multiple_of(CHECKED_OF)
}

#[cfg(test)]
mod tests;
