//! Runs the default controller with each file on all wearers of a population.

use super::outcome::{Files, Outcome};
use super::{CalibratedPoints, FilesError, fingers, hands};
use crate::hamana2022::Population as HandPopulation;
use crate::hands::DrivenHand;
use crate::tracking::exercise::{Exercise, Wearers};
use crate::tracking::statistics::{Interval, mean, paired, percentile};
use crate::tracking::target::Course;
use crate::tracking::wearer::Points;
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Population of a comparison.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Population {
    /// Multibody forearm models.
    Hands,
    /// Random fingers.
    Fingers(Wearers),
}

impl Population {
    /// All populations, in the order of tables.
    pub const ALL: [Self; 3] = [
        Self::Hands,
        Self::Fingers(Wearers::Earlier),
        Self::Fingers(Wearers::Widened),
    ];

    /// Returns the name in tables.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Hands => "hands",
            Self::Fingers(wearers) => wearers.name(),
        }
    }

    /// Returns whether the wearers of this population are compared with this file.
    pub const fn has(self, files: Files) -> bool {
        !matches!((self, files), (Self::Hands, Files::Nominal))
    }
}

/// Results on one wearer, with one stimulation point or with two.
#[derive(Clone, PartialEq, Debug)]
pub struct Case {
    /// Index of the wearer, from 0.
    pub index: u64,
    pub points: Points,
    /// Results by file.
    pub outcomes: BTreeMap<Files, Outcome>,
    /// The calibration of this wearer.
    pub calibrated: CalibratedPoints,
}

/// Results on all wearers of one population.
#[derive(Clone, PartialEq, Debug)]
pub struct Comparison {
    pub population: Population,
    pub seed: u64,
    /// Number of wearers that were generated.
    pub draws: u64,
    /// Wearers that can be driven, each with one point and with two.
    pub cases: Vec<Case>,
}

/// Score of the default controller with one file.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Score {
    /// Number of wearers.
    pub wearers: usize,
    /// Number of these on whom the session was refused or stopped.
    pub refused: usize,
    /// Number of all wearers whose session exceeds the stage ([`Outcome::is_beyond_stage`]).
    pub beyond_stage: usize,
    /// Mean RMSE over the others, °; NaN if there is none, as in the following fields.
    pub mean_deg: f64,
    /// 95th percentile of the RMSE, °.
    pub p95_deg: f64,
    /// Mean number of limit cycles in a trial.
    pub limit_cycles: f64,
    /// Mean difference between the RMSE and that without a file, °, over the wearers on whom
    /// neither was refused, with its 95 % interval.
    pub over_none: Interval,
}

impl Comparison {
    /// Lets the default controller drive all wearers with each file. The same arguments give
    /// bit-identical results.
    ///
    /// # Errors
    /// Fails if a wearer is invalid, or a calibration could not be carried out.
    pub fn run(
        population: Population,
        (seed, draws): (u64, u64),
        mut progress: impl FnMut(f64),
    ) -> Result<Self, FilesError> {
        let declared = HandPopulation::load_embedded()?;
        let (indices, mut cases): (Vec<u64>, _) = ((0..draws).collect(), Vec::new());
        let mut done = 0;
        for some in indices.chunks(2 * rayon::current_num_threads()) {
            let results = some.par_iter().map(|index| match population {
                Population::Hands => on_hand(&declared, seed, *index),
                Population::Fingers(wearers) => on_finger(wearers, seed, *index),
            });
            for result in results.collect::<Result<Vec<_>, _>>()? {
                cases.extend(result);
            }
            done += some.len();
            progress(done as f64 / indices.len() as f64);
        }
        Ok(Self {
            population,
            seed,
            draws,
            cases,
        })
    }

    fn outcomes(&self, points: Points, files: Files) -> impl Iterator<Item = (&Case, &Outcome)> {
        let cases = self.cases.iter().filter(move |case| case.points == points);
        cases.filter_map(move |case| Some((case, case.outcomes.get(&files)?)))
    }

    /// Returns the score with these points and this file.
    pub fn score(&self, points: Points, files: Files) -> Score {
        let tracked = || (self.outcomes(points, files)).filter(|(_, o)| o.refused.is_none());
        let errors: Vec<f64> = tracked().map(|(_, o)| o.rmse_deg).collect();
        let cycles: Vec<f64> = tracked().map(|(_, o)| o.limit_cycles as f64).collect();
        let pairs = tracked().filter_map(|(case, outcome)| {
            let none = case.outcomes.get(&Files::Absent)?;
            let is_tracked = none.refused.is_none();
            is_tracked.then_some((outcome.rmse_deg, none.rmse_deg))
        });
        let (ours, theirs): (Vec<f64>, Vec<f64>) = pairs.unzip();
        let wearers = self.outcomes(points, files).count();
        let beyond = self.outcomes(points, files);
        let beyond_stage = beyond
            .filter(|(_, outcome)| outcome.is_beyond_stage)
            .count();
        let nothing = Interval {
            mean: f64::NAN,
            low: f64::NAN,
            high: f64::NAN,
        };
        Score {
            wearers,
            refused: wearers - errors.len(),
            beyond_stage,
            mean_deg: mean(&errors),
            p95_deg: percentile(&errors, 0.95),
            limit_cycles: mean(&cycles),
            over_none: match ours.is_empty() {
                true => nothing,
                false => paired(&ours, &theirs),
            },
        }
    }

    /// Counts the refusals with these points and this file, by reason.
    pub fn refusals(&self, points: Points, files: Files) -> BTreeMap<&str, u64> {
        let mut counts = BTreeMap::new();
        for (_, outcome) in self.outcomes(points, files) {
            if let Some(why) = &outcome.refused {
                *counts.entry(why.as_str()).or_insert(0) += 1;
            }
        }
        counts
    }
}

/// Returns the results on hand `index`, or none if no controller can drive it.
fn on_hand(declared: &HandPopulation, seed: u64, index: u64) -> Result<Vec<Case>, FilesError> {
    let Ok(drawn) = DrivenHand::draw(declared, seed, index)? else {
        return Ok(Vec::new());
    };
    let calibrated = hands::calibrate(&drawn, index)?;
    let cases = drawn.ways.iter().map(|way| {
        let outcomes = outcomes(Population::Hands, |files| {
            hands::drive(&drawn, way, files, &calibrated)
        });
        Ok(Case {
            index,
            points: way.points,
            outcomes: outcomes?,
            calibrated,
        })
    });
    cases.collect()
}

fn on_finger(wearers: Wearers, seed: u64, index: u64) -> Result<Vec<Case>, FilesError> {
    let plant = wearers.plant(seed, index);
    let calibrated = fingers::calibrate(&plant, index)?;
    let cases = Points::ALL.into_iter().map(|points| {
        let course = wearers.course(Course::Sine, seed, index);
        let exercise = Exercise::new(plant.clone(), points, course)?;
        let outcomes = outcomes(Population::Fingers(wearers), |files| {
            fingers::drive(&exercise, files, &calibrated)
        });
        Ok(Case {
            index,
            points,
            outcomes: outcomes?,
            calibrated,
        })
    });
    cases.collect()
}

fn outcomes(
    population: Population,
    drive: impl Fn(Files) -> Result<Outcome, FilesError>,
) -> Result<BTreeMap<Files, Outcome>, FilesError> {
    let files = Files::ALL
        .into_iter()
        .filter(|files| population.has(*files));
    files.map(|files| Ok((files, drive(files)?))).collect()
}
