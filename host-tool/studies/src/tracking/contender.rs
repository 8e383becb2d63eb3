//! Who takes part in a campaign.

use super::TrackingError;
use super::candidate::{Candidate, Equipment};
use super::driver::{Device, Driver, Recorded};
use super::plant::Plant;
use super::trial::{self, PULSE_EVERY_MS};
use super::wearer::{self, Points};
use methods::control::Form;

/// What drives the finger.
#[derive(Clone, PartialEq, Debug)]
pub enum Contender {
    /// A law in f64, with the numbers that the search found.
    Searched(Equipment, Candidate),
    /// The device's fixed-point default ([`LawSpec::RECOMMENDED`]): the very code
    /// that is flashed.
    Shipped,
}

impl Contender {
    /// For tables; a plus is for add-ons.
    pub fn name(&self) -> String {
        match self {
            Self::Searched(Equipment::Alone, candidate) => candidate.form.name().to_owned(),
            Self::Searched(Equipment::Equipped, candidate) => {
                format!("{} +", candidate.form.name())
            }
            Self::Shipped => "device default".to_owned(),
        }
    }

    /// Whether it is a PID: the baseline.
    pub fn is_pid(&self) -> bool {
        matches!(self, Self::Searched(_, candidate) if candidate.form == Form::Pid)
    }

    /// The arithmetic it runs in.
    pub const fn arithmetic(&self) -> &'static str {
        match self {
            Self::Searched(..) => "f64",
            Self::Shipped => "fixed",
        }
    }

    /// The true angle each millisecond, degrees, while it drives this plant.
    ///
    /// # Errors
    /// [`TrackingError`] if plant or law cannot be.
    pub fn track(
        &self,
        plant: &Plant,
        points: Points,
        wanted: &[f64],
    ) -> Result<Vec<f32>, TrackingError> {
        trial::run(plant, &mut *self.driver(points)?, wanted)
    }

    /// The effort of each pulse, −1…1, while it drives this plant.
    ///
    /// # Errors
    /// [`TrackingError`] if plant or law cannot be.
    pub fn efforts(
        &self,
        plant: &Plant,
        points: Points,
        wanted: &[f64],
    ) -> Result<Vec<f64>, TrackingError> {
        let mut recorded = Recorded {
            driver: self.driver(points)?,
            volts: Vec::with_capacity(wanted.len()),
        };
        trial::run(plant, &mut recorded, wanted)?;
        let pulses = recorded.volts.into_iter().step_by(PULSE_EVERY_MS);
        Ok(pulses.map(|v| wearer::effort_of(points, v)).collect())
    }

    fn driver(&self, points: Points) -> Result<Box<dyn Driver>, TrackingError> {
        Ok(match self {
            Self::Searched(_, candidate) => Box::new(candidate.driver::<f64>(points)?),
            Self::Shipped => Box::new(Device::new(&wearer::shipped(points))?),
        })
    }
}
