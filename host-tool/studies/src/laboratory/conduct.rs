//! Runs a protocol on a device: the trials in their order, with rests and prompts.

use super::error::LaboratoryError;
use super::experiment::{Experiment, TrialMeasures};
use super::protocol::{Place, Step, Stop};
use super::wearer::TrialDevice;
use host_core::link::Interruption;
use host_core::record::{Sample, Trial};
use host_core::run::{
    DeviceName, Observation, Observer, ObserverRequest, RunError, SessionFile, TrialPlace,
    record_on,
};
use std::path::Path;

/// The operator who accompanies the wearer while a protocol runs, or a program in this role.
pub trait Operator {
    /// Shows `text` and waits until the wearer is ready; returns `false` to end the protocol.
    fn ready(&mut self, text: &str) -> bool;
    /// Waits for `rest_s` without stimulation; returns `false` to end the protocol.
    fn rest(&mut self, rest_s: f64) -> bool;
    /// Reports the completed share of the protocol, 0 to 1.
    fn progress(&mut self, part: f64);
    /// Returns the handle that can interrupt a running trial.
    fn interruption(&self) -> Interruption;
}

/// A recorded trial with its position in the protocol and its measures.
pub struct ConductedTrial {
    /// Samples, events and counters of the trial.
    pub trial: Trial,
    /// Block, repetition and condition of the trial in the protocol.
    pub place: Place,
    /// Value of each measure of the declaration; `None` where the trial does not have it.
    pub measured: TrialMeasures,
}

/// The trials of a protocol that were conducted, and why it ended early if it did.
pub struct Course {
    /// Trials in the order in which they ran; the last may be incomplete.
    pub trials: Vec<ConductedTrial>,
    /// Number of trials that the whole protocol has.
    pub of: usize,
    /// Reason why the protocol ended early; `None` if it was completed.
    pub ended: Option<ProtocolEnd>,
}

/// Reason why a protocol ended before its last trial.
#[derive(Debug)]
pub enum ProtocolEnd {
    /// The operator ended the protocol.
    Operator,
    /// A sample crossed a stop limit of the declaration; contains the limit and the value in words.
    Criterion(String),
    /// A trial failed; the error says why.
    Run(RunError),
}

impl Experiment {
    /// Runs the protocol on `device` in the order that `seed` gives, and records each trial in
    /// `dir`. The protocol's `wearer` setting decides whether a simulated wearer is rested before
    /// every trial; a real wearer never is.
    ///
    /// # Errors
    /// Fails if the device cannot be opened or a record cannot be written. An early end is not an
    /// error.
    pub fn conduct(
        &self,
        dir: &Path,
        (device, seed): (&DeviceName, u64),
        operator: &mut dyn Operator,
    ) -> Result<Course, LaboratoryError> {
        let steps = self.declaration.protocol.steps(self.conditions.len(), seed);
        let total = steps
            .iter()
            .filter(|step| matches!(step, Step::Trial(_)))
            .count();
        let files = self.sessions(&[])?;
        let sessions: Vec<_> = files.iter().map(|file| file.session.clone()).collect();
        let wearer = self.declaration.protocol.wearer;
        let mut worn = TrialDevice::new(wearer, &sessions, (device, seed))?;
        let mut course = Course {
            trials: Vec::new(),
            of: total,
            ended: None,
        };
        for step in steps {
            let goes_on = match step {
                Step::Rest(rest_s) => {
                    let interruption = operator.interruption();
                    worn.rest(rest_s, &mut || interruption.received_signal().is_none())?;
                    operator.rest(rest_s)
                }
                Step::Prompt(text) => operator.ready(&text),
                Step::Trial(place) => {
                    if let Some(file) = files.get(place.condition) {
                        self.trial(dir, (&mut worn, file), place, &mut course, operator)?;
                    }
                    operator.progress(course.trials.len() as f64 / total as f64);
                    course.ended.is_none()
                }
            };
            if !goes_on {
                course.ended = course.ended.or(Some(ProtocolEnd::Operator));
                break;
            }
        }
        Ok(course)
    }

    fn trial(
        &self,
        dir: &Path,
        (worn, file): (&mut TrialDevice<'_>, &SessionFile),
        place: Place,
        course: &mut Course,
        operator: &mut dyn Operator,
    ) -> Result<(), LaboratoryError> {
        let name = self.name_of(place);
        let at = TrialPlace {
            dir,
            position: course.trials.len(),
            name: &name,
        };
        let mut crossed = None;
        let watch = Watch {
            stop: self.declaration.protocol.stop,
            crossed: &mut crossed,
            interruption: operator.interruption(),
        };
        let half_us = file.session.duration_us / 2;
        let port = worn.open(&file.session, place, &mut |_| ())?;
        let (recorded, port) = record_on(at, file, port, half_us, watch)?;
        worn.give_back(port);
        let measured = self.measure_trial(file, &recorded.trial);
        course.trials.push(ConductedTrial {
            trial: recorded.trial,
            place,
            measured,
        });
        course.ended = match (crossed, recorded.error) {
            (Some(criterion), _) => Some(ProtocolEnd::Criterion(criterion)),
            (None, Some(error)) => Some(ProtocolEnd::Run(error)),
            (None, None) => None,
        };
        Ok(())
    }

    /// Returns the name of a trial, for example "pre-wall, 15 °/s". Block and repetition are added
    /// if the protocol has several.
    fn name_of(&self, place: Place) -> String {
        let protocol = &self.declaration.protocol;
        let condition = self.conditions.get(place.condition);
        let mut name = condition.map_or_else(String::new, |condition| condition.name());
        if protocol.blocks > 1 {
            name += &format!(", block {}", place.block + 1);
        }
        if protocol.repetitions > 1 {
            name += &format!(", repetition {}", place.repetition + 1);
        }
        name
    }
}

/// Observer that ends a trial when a sample crosses a stop limit.
struct Watch<'a> {
    stop: Stop,
    crossed: &'a mut Option<String>,
    interruption: Interruption,
}

impl Observer for Watch<'_> {
    fn observe(&mut self, seen: Observation<'_>) {
        if let (Observation::Sample(sample), true) = (seen, self.crossed.is_none()) {
            *self.crossed = self.stop.crossed_limit(sample);
        }
    }

    fn next_request(&mut self) -> ObserverRequest {
        match self.crossed {
            Some(_) => ObserverRequest::Stop,
            None => ObserverRequest::Nothing,
        }
    }

    fn interruption(&self) -> Option<Interruption> {
        Some(self.interruption.clone())
    }
}

impl Stop {
    /// Returns a message about the stop limit that this sample crosses, or `None` if it crosses
    /// none.
    fn crossed_limit(&self, sample: &Sample) -> Option<String> {
        let t_s = sample.t_s;
        let beyond = |value: Option<f64>, limit: Option<f64>, is: fn(f64, f64) -> bool| {
            value.zip(limit).filter(|(value, limit)| is(*value, *limit))
        };
        let force = sample.forces_n.iter().flatten().copied().reduce(f64::max);
        let above: fn(f64, f64) -> bool = |value, limit| value > limit;
        let below: fn(f64, f64) -> bool = |value, limit| value < limit;
        let angle = sample.measured_deg;
        let limits = [
            (
                "the angle rose above",
                "°",
                beyond(angle, self.angle_above_deg, above),
            ),
            (
                "the angle fell below",
                "°",
                beyond(angle, self.angle_below_deg, below),
            ),
            (
                "a force rose above",
                " N",
                beyond(force, self.force_above_n, above),
            ),
        ];
        limits.into_iter().find_map(|(phrase, unit, crossed)| {
            let (value, limit) = crossed?;
            Some(format!(
                "{phrase} {limit}{unit} ({value:.1}{unit}) at {t_s:.2} s"
            ))
        })
    }
}
