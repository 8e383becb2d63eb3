//! The study: ten subjects, drawn again and again, and bodies of another structure.

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

/// Of the second session's seed.
const FOUND: u64 = 0x1ee;

/// A study as it is asked for.
#[derive(Clone, Debug)]
pub struct Study {
    /// What was decided before.
    pub declared: Declaration,
    /// K01 to K10.
    pub truths: Vec<Truth>,
    /// Of everybody's draws.
    pub seed: u64,
    /// Replications.
    pub draws: u64,
    /// What a sample runs on as well.
    pub device: DeviceName,
}

/// What is computed by itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Unit {
    /// A subject's replication.
    Own(usize, u64),
    /// A departure in a subject's replication.
    Foreign(usize, Foreign, u64),
}

/// What a unit became.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub enum Part {
    /// A subject's replication, or why it came to nothing.
    Own(Box<SubjectReplication>),
    /// A departure, or why it came to nothing.
    Foreign(Result<Mismatch, String>),
}

/// A subject's replication.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct SubjectReplication {
    /// Subject, from 0.
    pub subject: usize,
    /// Which replication, from 0.
    pub draw: u64,
    /// Steps 2 and 3.
    pub searched: SearchResult,
    /// Step 4 at the printed amplitudes, or why there is nothing.
    pub printed: Result<TrainAnalysis, String>,
    /// Step 4 from the threshold that was found.
    pub found: Result<TrainAnalysis, String>,
}

impl Study {
    /// With this seed and so many draws; the declaration's own without.
    ///
    /// # Errors
    /// E646: the declaration; E649: a bench that cannot be.
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

    /// Whether seed and draws are the declaration's.
    #[must_use]
    pub fn is_as_declared(&self) -> bool {
        (self.seed, self.draws) == (self.declared.seed, self.declared.draws)
    }

    /// What there is to compute, in the order of `draws.csv`.
    #[must_use]
    pub fn units(&self) -> Vec<Unit> {
        let all = 0..self.truths.len();
        let own = all
            .clone()
            .flat_map(|index| (0..self.draws).map(move |draw| Unit::Own(index, draw)));
        let mut units: Vec<Unit> = own.collect();
        for kind in Kind::ALL {
            for size in &self.declared.foreign.sizes {
                for subject in all.clone() {
                    let foreign = Foreign { kind, size: *size };
                    let draws = 0..self.declared.foreign.draws.min(self.draws);
                    units.extend(draws.map(|draw| Unit::Foreign(subject, foreign, draw)));
                }
            }
        }
        units
    }

    /// Of a subject's replication.
    #[must_use]
    pub fn seed_of(&self, subject: usize, draw: u64) -> u64 {
        word(word(self.seed, subject as u64), draw)
    }

    /// What a unit becomes.
    ///
    /// # Errors
    /// A bench that cannot be, which is a mistake of the program.
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

    /// Fifteen trains of a replication at the printed amplitudes.
    ///
    /// # Errors
    /// A bench that cannot be.
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
