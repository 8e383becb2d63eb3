//! A declaration with its sessions: what can be run.

use super::condition::{Condition, Texts};
use super::declaration::Declaration;
use super::draw::{Unit, points, unit_of};
use super::error::LaboratoryError;
use super::measure::{self, Measure};
use host_core::record::{Trial, sha256};
use host_core::run::{DeviceName, SessionFile, run};

/// A checked experiment.
#[derive(Clone, Debug)]
pub struct Experiment {
    /// What was written before looking.
    pub declaration: Declaration,
    /// The text of its file.
    pub text: String,
    /// Its conditions, each level of a factor with each of the others.
    pub conditions: Vec<Condition>,
    /// SHA-256 of the declaration and of each session that it names, as files.
    pub hashes: Vec<(String, String)>,
}

/// What one wearer did in one condition: a number for each of the declaration's
/// measures, where there is one.
pub type Measured = Vec<Option<f64>>;

impl Experiment {
    /// The experiment that `text`, called `file`, declares; `texts` knows its
    /// sessions.
    ///
    /// # Errors
    /// Everything wrong with the declaration; a condition that no device would arm.
    pub fn new(file: &str, text: &str, texts: Texts<'_>) -> Result<Self, LaboratoryError> {
        let declaration = Declaration::parse(file, text)?;
        let mut hashes = vec![(file.to_owned(), sha256(text.as_bytes()))];
        let levels = declaration.factors.iter().flat_map(|factor| &factor.levels);
        let mut sessions: Vec<&str> = levels
            .filter_map(|level| level.session.as_deref())
            .collect();
        sessions.insert(0, &declaration.session);
        for session in sessions {
            if !hashes.iter().any(|(known, _)| known == session) {
                hashes.push((session.to_owned(), sha256(texts(session)?.as_bytes())));
            }
        }
        let conditions = Condition::all(&declaration, texts)?;
        let whole = Self {
            declaration,
            text: text.to_owned(),
            conditions,
            hashes,
        };
        // Whatever is wrong is told before anything runs.
        for condition in &whole.conditions {
            condition.session(&[])?;
            condition.session(&whole.unit(whole.declaration.seed, 1, 0).fields)?;
        }
        Ok(whole)
    }

    /// The declaration's measures.
    pub fn measures(&self) -> impl Iterator<Item = &'static Measure> {
        self.declaration
            .measures
            .iter()
            .filter_map(|id| measure::named(id))
    }

    /// How many units `draws` wearers make: one at each point of the grid.
    #[must_use]
    pub fn units(&self, draws: u64) -> u64 {
        points(&self.declaration).saturating_mul(draws)
    }

    /// A wearer at a point of the grid.
    #[must_use]
    pub fn unit(&self, seed: u64, draws: u64, index: u64) -> Unit {
        unit_of(&self.declaration, seed, draws, index)
    }

    /// What a unit does in each condition: the whole device, natively.
    ///
    /// # Errors
    /// A session that no device arms, or one that ended early.
    pub fn perform(&self, unit: &Unit) -> Result<Vec<Measured>, LaboratoryError> {
        let one = |condition: &Condition| {
            let file = condition.session(&unit.fields)?;
            let port = DeviceName::Native.open(&file.session, unit.seed)?;
            let (outcome, _) = run(&file, port, None, |_: f64| ());
            match outcome.error {
                None => Ok(self.measured(&file, &outcome.trial)),
                Some(error) => Err(LaboratoryError::Draw {
                    draw: unit.index,
                    condition: condition.name(),
                    error: error.to_string(),
                }),
            }
        };
        self.conditions.iter().map(one).collect()
    }

    /// The measures of a trial of `file`.
    #[must_use]
    pub fn measured(&self, file: &SessionFile, trial: &Trial) -> Measured {
        let number = |measure: &Measure| (measure.of)(&file.session, trial);
        self.measures().map(number).collect()
    }
}
