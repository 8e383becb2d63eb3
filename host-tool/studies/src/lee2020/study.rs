//! Runs the study: many replications of ten subjects, and simulated wrists with another structure.

use super::SUBJECTS;
use super::alone::ExactWrist;
use super::analysis::{TrainAnalysis, run_analysis};
use super::declaration::Declaration;
use super::error::LeeError;
use super::foreign::{Mismatch, mismatch};
use super::protocol::{Amplitudes, SearchResult, Session, run_fifteen_trains, search};
use super::truth::Truth;
use hal_sim::body::bench::{Foreign, Kind};
use hal_sim::random::word;
use host_core::run::DeviceName;
use serde::{Deserialize, Serialize};

/// Mixed into the seed of a replication for the trains that start at the found threshold.
const FOUND: u64 = 0x1ee;

/// The study with its seed, number of draws and device.
#[derive(Clone, Debug)]
pub struct Study {
    /// The preregistered declaration.
    pub declared: Declaration,
    /// True values of K01 to K10.
    pub truths: Vec<Truth>,
    /// Seed of all draws.
    pub seed: u64,
    /// Number of replications of each subject.
    pub draws: u64,
    /// Device on which one subject is checked.
    pub device: DeviceName,
}

/// A unit of work, which is computed and stored separately.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Unit {
    /// Replication of a subject: index of the subject and of the replication.
    Own(usize, u64),
    /// Model mismatch in a replication: index of the subject, mismatch, and index of the
    /// replication.
    Foreign(usize, Foreign, u64),
}

/// Result of a unit of work.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub enum Part {
    /// Thresholds and fits of one subject.
    Own(Box<SubjectReplication>),
    /// Model mismatch, or the reason why it failed.
    Foreign(Result<Mismatch, String>),
}

/// Results of one replication of a subject.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct SubjectReplication {
    /// Index of the subject, from 0.
    pub subject: usize,
    /// Index of the replication, from 0.
    pub draw: u64,
    /// Results of the placement pulse and the threshold search (steps 2 and 3).
    pub searched: SearchResult,
    /// Analysis of fifteen trains (step 4) at the printed amplitudes, or the reason why it failed.
    pub printed: Result<TrainAnalysis, String>,
    /// Analysis of fifteen trains (step 4) from the found threshold on, or the reason why it
    /// failed.
    pub found: Result<TrainAnalysis, String>,
}

impl Study {
    /// Creates the study with this seed and number of draws, or those of the declaration.
    ///
    /// # Errors
    /// Fails with E646 if the declaration is invalid, or E649 if a test rig is.
    pub fn new(
        seed: Option<u64>,
        draws: Option<u64>,
        device: DeviceName,
    ) -> Result<Self, LeeError> {
        let declared = Declaration::load_embedded()?;
        let truths = (0..SUBJECTS).map(|index| Truth::for_subject(index, &declared));
        Ok(Self {
            truths: truths.collect::<Result<_, _>>()?,
            seed: seed.unwrap_or(declared.seed),
            draws: draws.unwrap_or(declared.draws),
            declared,
            device,
        })
    }

    /// Returns whether seed and draws are those of the declaration.
    #[must_use]
    pub fn is_as_declared(&self) -> bool {
        (self.seed, self.draws) == (self.declared.seed, self.declared.draws)
    }

    /// Returns all units, in the order of `draws.csv`.
    #[must_use]
    pub fn units(&self) -> Vec<Unit> {
        let subjects = 0..self.truths.len();
        let own = subjects
            .clone()
            .flat_map(|index| (0..self.draws).map(move |draw| Unit::Own(index, draw)));
        let mut units: Vec<Unit> = own.collect();
        for kind in Kind::ALL {
            for size in &self.declared.foreign.sizes {
                for subject in subjects.clone() {
                    let foreign = Foreign { kind, size: *size };
                    let draws = 0..self.declared.foreign.draws.min(self.draws);
                    units.extend(draws.map(|draw| Unit::Foreign(subject, foreign, draw)));
                }
            }
        }
        units
    }

    /// Returns the seed of a subject's replication, which does not depend on the other
    /// replications.
    #[must_use]
    pub fn seed_of(&self, subject: usize, draw: u64) -> u64 {
        word(word(self.seed, subject as u64), draw)
    }

    /// Simulates one unit; a failure of its analysis is part of the result.
    ///
    /// # Errors
    /// Fails if a test rig is invalid, which is a bug of this program.
    pub fn compute_unit(&self, unit: &Unit) -> Result<Part, LeeError> {
        match *unit {
            Unit::Own(subject, draw) => Ok(Part::Own(Box::new(self.replicate(subject, draw)?))),
            Unit::Foreign(subject, foreign, draw) => {
                let seed = self.seed_of(subject, draw);
                let own = (subject, &self.truths[subject]);
                let came = mismatch(own, foreign, seed, &self.declared);
                Ok(Part::Foreign(came.map_err(|e| e.to_string())))
            }
        }
    }

    fn replicate(&self, subject: usize, draw: u64) -> Result<SubjectReplication, LeeError> {
        let seed = self.seed_of(subject, draw);
        let mut alone = ExactWrist::new(self.truths[subject].spec, seed)?;
        let searched = search(&mut alone, &self.declared)?;
        let printed = self.printed_session(subject, draw);
        let printed = printed.and_then(|session| run_analysis(&session, &self.declared));
        let found = match searched.i_mt_ma() {
            None => Err("no motor threshold was found".to_owned()),
            Some(i_mt_ma) => self
                .session(subject, i_mt_ma, word(seed, FOUND))
                .and_then(|session| run_analysis(&session, &self.declared))
                .map_err(|e| e.to_string()),
        };
        Ok(SubjectReplication {
            subject,
            draw,
            searched,
            printed: printed.map_err(|e| e.to_string()),
            found,
        })
    }

    /// Simulates the fifteen trains of a replication at the printed amplitudes.
    ///
    /// # Errors
    /// Fails if the test rig is invalid.
    pub fn printed_session(&self, subject: usize, draw: u64) -> Result<Session, LeeError> {
        let i_mt_ma = self.truths[subject].printed_ma;
        self.session(subject, i_mt_ma, self.seed_of(subject, draw) ^ 1)
    }

    fn session(&self, subject: usize, i_mt_ma: f64, seed: u64) -> Result<Session, LeeError> {
        let mut alone = ExactWrist::new(self.truths[subject].spec, seed)?;
        let amplitudes = Amplitudes::from_threshold(i_mt_ma, &self.declared)?;
        run_fifteen_trains(&mut alone, amplitudes, &self.declared)
    }
}
