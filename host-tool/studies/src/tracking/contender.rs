//! The contenders of a campaign.

use super::TrackingError;
use super::ablation::Term;
use super::candidate::{Candidate, Equipment};
use super::default;
use super::driver::{Device, Driver, RecordedDriver};
use super::exercise::{Exercise, Outcome};
use super::trial::{self, PULSE_EVERY_MS};
use super::wearer::{self, Points};
use host_core::session::LawName;
use methods::control::Form;

/// A controller of the finger that takes part in a campaign.
#[derive(Clone, PartialEq, Debug)]
pub enum Contender {
    /// A law in f64 with the parameters that the search found.
    Searched(Equipment, Candidate),
    /// The default controller (`LawSpec::RECOMMENDED`) in fixed point, by the code of the firmware.
    Shipped,
    /// The default controller without one of its terms; the other parameters are not tuned again.
    Ablated(Term),
}

impl Contender {
    /// Returns the contender's name in CSV and JSON; a plus means that the law has add-ons.
    pub fn name(&self) -> String {
        match self {
            Self::Searched(equipment, candidate) => candidate.name(*equipment),
            Self::Shipped => default::NAME.to_owned(),
            Self::Ablated(term) => format!("- {}", term.name()),
        }
    }

    /// Returns the contender's name in text tables and charts; a plus means that the law has
    /// add-ons.
    pub fn title(&self) -> String {
        match self {
            Self::Searched(equipment, candidate) => candidate.title(*equipment),
            Self::Shipped => LawName::Recommended.title().to_owned(),
            Self::Ablated(_) => self.name(),
        }
    }

    /// Returns whether the contender is a PID controller, with which the others are compared.
    pub fn is_pid(&self) -> bool {
        matches!(self, Self::Searched(_, candidate) if candidate.form == Form::Pid)
    }

    /// Returns the name of the arithmetic in which the contender computes.
    pub const fn arithmetic(&self) -> &'static str {
        match self {
            Self::Searched(..) => "f64",
            Self::Shipped | Self::Ablated(_) => "fixed",
        }
    }

    /// Lets the contender attempt an exercise, and judges the attempt.
    ///
    /// # Errors
    /// Returns [`TrackingError`] if the plant or the law is invalid.
    pub fn attempt(&self, exercise: &Exercise) -> Result<Outcome, TrackingError> {
        let mut driver = self.driver(exercise.points)?;
        let attempt = trial::run(&exercise.plant, &mut *driver, &exercise.wanted)?;
        Ok(exercise.judge(attempt))
    }

    /// Returns the effort of each pulse while the contender attempts an exercise, −1 (full
    /// extension) to 1 (full flexion).
    ///
    /// # Errors
    /// Returns [`TrackingError`] if the plant or the law is invalid.
    pub fn efforts(&self, exercise: &Exercise) -> Result<Vec<f64>, TrackingError> {
        let points = exercise.points;
        let mut recorded = RecordedDriver {
            driver: self.driver(points)?,
            volts: Vec::with_capacity(exercise.wanted.len()),
        };
        trial::run(&exercise.plant, &mut recorded, &exercise.wanted)?;
        let pulses = recorded.volts.into_iter().step_by(PULSE_EVERY_MS);
        Ok(pulses.map(|v| wearer::effort_of(points, v)).collect())
    }

    fn driver(&self, points: Points) -> Result<Box<dyn Driver>, TrackingError> {
        Ok(match self {
            Self::Searched(_, candidate) => Box::new(candidate.driver::<f64>(points)?),
            Self::Shipped => Box::new(Device::new(&wearer::shipped(points))?),
            Self::Ablated(term) => Box::new(Device::new(&term.without(points))?),
        })
    }
}
