//! A declaration with its sessions: what can be run.

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

/// A checked experiment.
#[derive(Clone, Debug)]
pub struct Experiment {
    /// What was written before looking.
    pub declaration: Declaration,
    /// What a command calls it: its name in the program, or its file.
    pub asked: String,
    /// The text of its file.
    pub text: String,
    /// Name and text of each session that it names, in its order.
    pub sessions: Vec<(String, String)>,
    /// Name and text of each wearer file that these name.
    pub wearers: Vec<(String, String)>,
    /// The wearer file that takes their place, if one does.
    pub worn: Option<String>,
    /// Its conditions, each level of a factor with each of the others.
    pub conditions: Vec<Condition>,
    /// SHA-256 of the declaration, of each session that it names and of each wearer file
    /// that these name, as files.
    pub hashes: Vec<(String, String)>,
}

/// What stands before the name of a wearer file that takes the place of the sessions' own,
/// among the files of an experiment.
pub(super) const WORN: &str = "--wearer/";

/// What one wearer did in one condition: a number for each of the declaration's
/// measures, where there is one.
pub type TrialMeasures = Vec<Option<f64>>;

impl Experiment {
    /// The experiment that `text`, called `file`, declares; `texts` knows its
    /// sessions.
    ///
    /// # Errors
    /// Everything wrong with the declaration; a condition that no device would arm.
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
        let mut conditions =
            conditions.map_err(|all| unchangeable_fields(&declaration, (file, text), &all))?;
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
        let whole = Self {
            declaration,
            asked: file.to_owned(),
            text: text.to_owned(),
            sessions,
            wearers,
            worn: None,
            conditions,
            hashes,
        };
        // Whatever is wrong is told before anything runs.
        let declared = whole.sessions(&[])?;
        whole.check_wearable(file)?;
        let drawn = whole.unit(whole.declaration.seed, 1, 0);
        for files in [declared, whole.sessions(&drawn.fields)?] {
            let sessions: Vec<_> = files.into_iter().map(|file| file.session).collect();
            whole.check_worn(&sessions)?;
            whole.check_stop(&sessions)?;
        }
        Ok(whole)
    }

    /// The same on another wearer than its sessions name: `file` of this text. What the
    /// file says of a simulated elbow is not drawn.
    ///
    /// # Errors
    /// The file; a session that names no wearer file (E663) or cannot be played on this one.
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

    /// The same, as a command calls it: `name`, of a file without its folder.
    #[must_use]
    pub fn with_name(mut self, name: &str) -> Self {
        let file = Path::new(name).file_name();
        self.asked = file.map_or_else(
            || name.to_owned(),
            |file| file.to_string_lossy().into_owned(),
        );
        self
    }

    /// The declaration's measures.
    pub fn measures(&self) -> impl Iterator<Item = &'static Measure> {
        self.declaration
            .measures
            .iter()
            .filter_map(|id| measure::find_measure(id))
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

    /// Whether every condition has what the protocol stops at.
    fn check_stop(&self, sessions: &[Session]) -> Result<(), LaboratoryError> {
        let stop = self.declaration.protocol.stop;
        let all = self.conditions.iter().zip(sessions);
        let unmet = all.flat_map(|(condition, session)| {
            let name = condition.name();
            let unmet = stop.unusable_criteria(session).into_iter();
            unmet.map(move |(field, what)| format!("`{field}` in `{name}`, which has no {what}"))
        });
        match unmet.collect::<Vec<_>>() {
            unmet if unmet.is_empty() => Ok(()),
            unmet => Err(LaboratoryError::Unmet(unmet.join("; "))),
        }
    }

    /// Whether one wearer can wear these conditions, where one has to.
    ///
    /// # Errors
    /// They differ in what one wearer has once.
    pub(super) fn check_worn(&self, sessions: &[Session]) -> Result<(), LaboratoryError> {
        match self.declaration.protocol.wearer {
            Wearer::Rested => Ok(()),
            Wearer::Same => shared_session(sessions).map(|_| ()),
        }
    }

    /// What a drawn wearer goes through: every condition once; one who is kept the whole
    /// protocol, in an order of their own.
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

    /// The session of each condition with these fields of a wearer.
    ///
    /// # Errors
    /// A session that no device arms.
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

    /// What a unit does in each condition: the whole device, natively. A wearer who is
    /// kept goes through the whole protocol; of several rounds it is their mean.
    ///
    /// # Errors
    /// A session that no device arms, or one that ended early.
    pub fn measure_unit(&self, unit: &Unit) -> Result<Vec<TrialMeasures>, LaboratoryError> {
        let files = self.sessions(&unit.fields)?;
        let trials = self.play(unit, &files, &mut |_| ())?;
        Ok(self.means(&files, &trials))
    }

    /// The trials of a unit, each with its condition; `meet` meets every device that
    /// they open.
    ///
    /// # Errors
    /// No device, or a trial that ended early.
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

    /// The measures of each condition, of several trials the mean of those that have
    /// one.
    pub(super) fn means(
        &self,
        files: &[SessionFile],
        trials: &[(usize, Trial)],
    ) -> Vec<TrialMeasures> {
        let of = |(c, file): (usize, &SessionFile)| {
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
        files.iter().enumerate().map(of).collect()
    }

    /// The measures of a trial of `file`.
    #[must_use]
    pub fn measure_trial(&self, file: &SessionFile, trial: &Trial) -> TrialMeasures {
        let number = |measure: &Measure| (measure.of)(&file.session, trial);
        self.measures().map(number).collect()
    }
}

/// That levels change fields which cannot be changed.
fn unchangeable_fields(
    d: &Declaration,
    (file, text): (&str, &str),
    refused: &[IneffectiveLevel],
) -> LaboratoryError {
    let written = DeclarationText::new(text);
    let mistake = |((f, l), what): &IneffectiveLevel| {
        let level = d.factors.get(*f).and_then(|factor| factor.levels.get(*l));
        let name = level.map_or("", |level| &level.name);
        let line = written.line_of_level(*f, *l);
        Mistake::at(line, &format!("level `{name}`: {what}"))
    };
    LaboratoryError::Fields {
        file: file.to_owned(),
        mistakes: refused.iter().map(mistake).collect(),
    }
}
