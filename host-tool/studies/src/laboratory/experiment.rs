//! Combines a declaration with its sessions and wearer files to an experiment that can run.

use super::condition::{Condition, IneffectiveLevel, Texts};
use super::declaration::Declaration;
use super::draw::{Unit, points, unit_of};
use super::error::{LaboratoryError, Mistake};
use super::measure::{self, Measure};
use super::protocol::{Place, Step, Wearer};
use super::sources;
use super::wearer::{TrialDevice, shared_session};
use super::written::DeclarationText;
use host_core::link::Port;
use host_core::record::{Trial, sha256};
use host_core::run::{DeviceName, SessionFile, run};
use host_core::session::Session;
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::path::Path;
use toml::Value;

/// An experiment whose declaration, sessions and wearer files have been checked.
#[derive(Clone, Debug)]
pub struct Experiment {
    pub declaration: Declaration,
    /// Name by which a command refers to the experiment: its built-in name, or its file name.
    pub asked: String,
    /// Text of the declaration file, as it was read.
    pub text: String,
    /// Name and text of each session, in the declaration's order.
    pub sessions: Vec<(String, String)>,
    /// Name and text of each wearer file that the sessions name.
    pub wearers: Vec<(String, String)>,
    /// Name of the wearer file given on the command line, which replaces the wearer files of all
    /// sessions; `None` if none was given.
    pub worn: Option<String>,
    /// All conditions: every combination of the factors' levels.
    pub conditions: Vec<Condition>,
    /// Name and SHA-256 of the declaration, of each session and of each wearer file.
    pub hashes: Vec<(String, String)>,
}

/// Prefix for the name of a wearer file given on the command line, in the list of an experiment's
/// files.
pub(super) const WORN: &str = "--wearer/";

/// Values of all measures of the declaration in one trial; `None` where the trial does not have a
/// measure.
pub type TrialMeasures = Vec<Option<f64>>;

impl Experiment {
    /// Creates the experiment from the declaration `text` of `file`; `texts` returns the texts of
    /// its sessions and wearer files.
    ///
    /// # Errors
    /// Returns every mistake in the declaration, or the conditions whose sessions are invalid.
    pub fn new(file: &str, text: &str, texts: Texts<'_>) -> Result<Self, LaboratoryError> {
        let (declaration, mut mistakes) = Declaration::read_and_check(text);
        let named = declaration.as_ref();
        let named = named.map(|read| sources::sessions(read, text, texts));
        let (sessions, absent) = named.unwrap_or_default();
        mistakes.extend(absent);
        let refuse = |mistakes| LaboratoryError::declaration(file, mistakes);
        let declaration = match declaration {
            Some(declaration) if mistakes.is_empty() => declaration,
            _ => return Err(refuse(mistakes)),
        };
        let sum = |(name, text): (&str, &str)| (name.to_owned(), sha256(text.as_bytes()));
        let read = RefCell::new(BTreeMap::new());
        let wearer = |name: &str| sources::read_cached(&read, name, texts);
        let conditions = Condition::all(&declaration, &sources::tables(&sessions, &wearer)?);
        let mut conditions = conditions
            .map_err(|levels| unchangeable_fields(&declaration, (file, text), &levels))?;
        let mut wearers: Vec<(String, String)> = Vec::new();
        for worn in conditions
            .iter_mut()
            .filter_map(|condition| condition.load_wearer(&wearer))
        {
            if !wearers.contains(&worn) {
                wearers.push(worn);
            }
        }
        let mut hashes = vec![sum((file, text))];
        let others = sessions.iter().chain(&wearers);
        hashes.extend(others.map(|(name, text)| sum((name, text))));
        let experiment = Self {
            declaration,
            asked: file.to_owned(),
            text: text.to_owned(),
            sessions,
            wearers,
            worn: None,
            conditions,
            hashes,
        };
        // Reports every mistake before anything runs.
        let declared = experiment.sessions(&[])?;
        experiment.check_wearable(file)?;
        let drawn = experiment.unit(experiment.declaration.seed, 1, 0);
        for files in [declared, experiment.sessions(&drawn.fields)?] {
            let sessions: Vec<_> = files.into_iter().map(|file| file.session).collect();
            experiment.check_worn(&sessions)?;
            experiment.check_stop(&sessions)?;
        }
        Ok(experiment)
    }

    /// Replaces the wearer files of all sessions by `file`, whose content is `text`. Fields of a
    /// simulated elbow that the file determines are no longer random.
    ///
    /// # Errors
    /// Fails if the file is invalid, if a session names no wearer file (E663), or if a session
    /// cannot use this wearer.
    pub fn with_wearer(mut self, file: &str, text: &str) -> Result<Self, LaboratoryError> {
        let wearer = host_core::wearer::Wearer::parse(file, text)?;
        let refuse = |why| LaboratoryError::NotWorn {
            file: file.to_owned(),
            why,
        };
        for condition in &mut self.conditions {
            let known = condition.change_wearer((file, text), &wearer);
            let known = known.map_err(refuse)?;
            let drawn = &mut self.declaration.drawn;
            drawn.retain(|draw| !known.contains(&&*draw.field));
        }
        let name = format!("{WORN}{file}");
        self.hashes.push((name.clone(), sha256(text.as_bytes())));
        self.wearers.push((name, text.to_owned()));
        self.worn = Some(file.to_owned());
        self.sessions(&[])?;
        Ok(self)
    }

    /// Sets the name by which a command refers to the experiment; a folder in `name` is omitted.
    #[must_use]
    pub fn with_name(mut self, name: &str) -> Self {
        let file = Path::new(name).file_name();
        self.asked = file.map_or_else(
            || name.to_owned(),
            |file| file.to_string_lossy().into_owned(),
        );
        self
    }

    /// Returns the definitions of the measures that the declaration names.
    pub fn measures(&self) -> impl Iterator<Item = &'static Measure> {
        self.declaration
            .measures
            .iter()
            .filter_map(|id| measure::find_measure(id))
    }

    /// Returns the number of units for `draws` wearers, each of whom is simulated at each grid
    /// point.
    #[must_use]
    pub fn units(&self, draws: u64) -> u64 {
        points(&self.declaration).saturating_mul(draws)
    }

    /// Returns unit `index`: the values of one wearer at one point of the grid.
    #[must_use]
    pub fn unit(&self, seed: u64, draws: u64, index: u64) -> Unit {
        unit_of(&self.declaration, seed, draws, index)
    }

    /// Checks that the samples of every condition contain the measurements to which the stop limits
    /// refer.
    fn check_stop(&self, sessions: &[Session]) -> Result<(), LaboratoryError> {
        let stop = self.declaration.protocol.stop;
        let pairs = self.conditions.iter().zip(sessions);
        let unmet = pairs.flat_map(|(condition, session)| {
            let name = condition.name();
            let unmet = stop.unusable_criteria(session).into_iter();
            unmet.map(move |(field, quantity)| {
                format!("`{field}` in `{name}`, which has no {quantity}")
            })
        });
        match unmet.collect::<Vec<_>>() {
            unmet if unmet.is_empty() => Ok(()),
            unmet => Err(LaboratoryError::Unmet(unmet.join("; "))),
        }
    }

    /// Checks that a single wearer can go through all conditions, if the protocol requires that.
    ///
    /// # Errors
    /// Returns the first property of wearer or board in which the sessions differ.
    pub(super) fn check_worn(&self, sessions: &[Session]) -> Result<(), LaboratoryError> {
        match self.declaration.protocol.wearer {
            Wearer::Rested => Ok(()),
            Wearer::Same => shared_session(sessions).map(|_| ()),
        }
    }

    /// Returns the steps of a simulated wearer. A wearer who is rested before every trial has each
    /// condition once; any other wearer has the whole protocol, in an order that depends on `seed`.
    pub(super) fn steps_of(&self, seed: u64) -> Vec<Step> {
        let protocol = &self.declaration.protocol;
        match protocol.wearer {
            Wearer::Same => protocol.steps(self.conditions.len(), seed),
            Wearer::Rested => {
                let place = |condition| Place {
                    block: 0,
                    repetition: 0,
                    condition,
                };
                let conditions = 0..self.conditions.len();
                conditions.map(place).map(Step::Trial).collect()
            }
        }
    }

    /// Returns the session of each condition with these fields set to the values of a wearer.
    ///
    /// # Errors
    /// Returns every session that is then invalid.
    pub fn sessions(
        &self,
        fields: &[(String, Value)],
    ) -> Result<Vec<SessionFile>, LaboratoryError> {
        let (mut files, mut refused) = (Vec::new(), Vec::new());
        for condition in &self.conditions {
            match condition.session_with(fields) {
                Ok(file) => files.push(file),
                Err(reason) => refused.push((condition.name(), reason)),
            }
        }
        let file = self.hashes.first().map_or("", |(file, _)| file);
        match refused.is_empty() {
            true => Ok(files),
            false => Err(LaboratoryError::conditions(file, refused)),
        }
    }

    /// Simulates one unit in all conditions on the native backend. A wearer who is not rested goes
    /// through the whole protocol, and the rounds are averaged.
    ///
    /// # Errors
    /// Fails if a session is invalid or a trial ends early.
    pub fn measure_unit(&self, unit: &Unit) -> Result<Vec<TrialMeasures>, LaboratoryError> {
        let files = self.sessions(&unit.fields)?;
        let trials = self.play(unit, &files, &mut |_| ())?;
        Ok(self.means(&files, &trials))
    }

    /// Simulates the trials of a unit and returns each with the index of its condition. `meet` is
    /// called with every newly opened device.
    ///
    /// # Errors
    /// Fails if a device cannot be opened or a trial ends early.
    pub(super) fn play(
        &self,
        unit: &Unit,
        files: &[SessionFile],
        meet: &mut dyn FnMut(&mut dyn Port),
    ) -> Result<Vec<(usize, Trial)>, LaboratoryError> {
        let sessions: Vec<_> = files.iter().map(|file| file.session.clone()).collect();
        let wearer = self.declaration.protocol.wearer;
        let mut worn = TrialDevice::new(wearer, &sessions, (&DeviceName::Native, unit.seed))?;
        let mut trials = Vec::new();
        for step in self.steps_of(unit.seed) {
            let place = match step {
                Step::Rest(rest_s) => {
                    worn.rest(rest_s, &mut || true)?;
                    continue;
                }
                Step::Prompt(_) => continue,
                Step::Trial(place) => place,
            };
            let (c, Some(file)) = (place.condition, files.get(place.condition)) else {
                continue;
            };
            let port = worn.open(&file.session, place, meet)?;
            let (outcome, port) = run(file, port, None, |_: f64| ());
            worn.give_back(port);
            if let Some(error) = outcome.error {
                return Err(LaboratoryError::Draw {
                    draw: unit.index,
                    condition: self
                        .conditions
                        .get(c)
                        .map_or(String::new(), Condition::name),
                    error: error.to_string(),
                });
            }
            trials.push((c, outcome.trial));
        }
        Ok(trials)
    }

    /// Returns the measures of each condition, averaged over its trials; trials without a value are
    /// left out.
    pub(super) fn means(
        &self,
        files: &[SessionFile],
        trials: &[(usize, Trial)],
    ) -> Vec<TrialMeasures> {
        let condition_means = |(c, file): (usize, &SessionFile)| {
            let own = trials.iter().filter(|(condition, _)| *condition == c);
            let own: Vec<TrialMeasures> = own
                .map(|(_, trial)| self.measure_trial(file, trial))
                .collect();
            let mean = |m: usize| {
                let numbers = own.iter().filter_map(|measured| *measured.get(m)?);
                let numbers: Vec<f64> = numbers.collect();
                let sum = numbers.iter().copied().reduce(|a, b| a + b)?;
                Some(sum / numbers.len() as f64)
            };
            (0..self.measures().count()).map(mean).collect()
        };
        files.iter().enumerate().map(condition_means).collect()
    }

    /// Computes every measure of the declaration from one trial.
    #[must_use]
    pub fn measure_trial(&self, file: &SessionFile, trial: &Trial) -> TrialMeasures {
        let number = |measure: &Measure| (measure.of)(&file.session, trial);
        self.measures().map(number).collect()
    }
}

/// Creates the error for levels of factors that change session fields which cannot be changed.
fn unchangeable_fields(
    d: &Declaration,
    (file, text): (&str, &str),
    refused: &[IneffectiveLevel],
) -> LaboratoryError {
    let written = DeclarationText::new(text);
    let mistake = |((f, l), reason): &IneffectiveLevel| {
        let level = d.factors.get(*f).and_then(|factor| factor.levels.get(*l));
        let name = level.map_or("", |level| &level.name);
        let line = written.line_of_level(*f, *l);
        Mistake::at(line, &format!("level `{name}`: {reason}"))
    };
    LaboratoryError::Fields {
        file: file.to_owned(),
        mistakes: refused.iter().map(mistake).collect(),
    }
}
