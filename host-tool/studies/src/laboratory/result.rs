//! `result.json`: what came out, beside what a paper printed.

use super::claims::{Share, Units, shares};
use super::condition::{Condition, condition_name};
use super::conduct::ConductedTrial;
use super::decides::{DecidingClaim, deciding_fields};
use super::declaration::Declaration;
use super::draw::{point_in_words, points};
use super::experiment::{Experiment, TrialMeasures};
use super::quoted::quote_for_shell;
use super::sheet::Sheet;
use host_core::statistics::Spread;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// What an experiment came to.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Outcome {
    /// The experiment.
    pub name: String,
    /// The page's heading.
    pub title: String,
    /// Of wearers, noise and order.
    pub seed: u64,
    /// Whether all of it is simulated; unknown where no device said.
    pub simulated: Option<bool>,
    /// What is missing of it, for people; nothing of what is whole.
    #[serde(default)]
    pub cut_short: Option<String>,
    /// What was written before looking.
    pub declared: Preregistration,
    /// The conditions, as the declaration crosses them.
    pub conditions: Vec<ShownCondition>,
    /// A number for each measure of each condition.
    pub rows: Vec<Row>,
    /// In how many cases each claim holds.
    pub shares: Vec<Share>,
    /// What decides each claim; empty where no wearers were drawn, and in results older
    /// than it.
    #[serde(default)]
    pub decides: Vec<DecidingClaim>,
    /// What stands beside the paper's own tables and figures, by their numbers; in results
    /// that lay them out.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub sheets: Vec<Sheet>,
    /// What one must know to read them.
    pub notes: Vec<String>,
}

/// A condition and the trial that the page shows of it.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct ShownCondition {
    /// A level of each factor.
    pub levels: Vec<String>,
    /// The place of its first trial in the record, from 0; nothing where none was
    /// recorded.
    pub trial: Option<usize>,
}

/// What was written before looking.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Preregistration {
    /// What a command calls it: its name in this program, or its file. Empty in
    /// results older than it.
    #[serde(default)]
    pub asked: String,
    /// What to type after `flexor` to have it again, but for the seed; nothing of what
    /// `experiment` or `sweep` repeats by its name.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub command: Option<String>,
    /// Where its trials were conducted, where they are all there is.
    #[serde(default)]
    pub device: Option<String>,
    /// SHA-256 of the declaration and its sessions, by file.
    pub sha256: BTreeMap<String, String>,
    /// The paper, section and figure.
    pub source: String,
    /// Wearers drawn, at each point of a grid; 0 where the trials of the record are
    /// all there is.
    pub draws: u64,
    /// What was drawn, in the plural, where it is not wearers.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub drawn: Option<String>,
    /// Whether seed, draws and wearer are the declaration's own.
    pub as_declared: bool,
}

/// What a terminal takes to have an experiment on another wearer again, but for its seed.
fn command(experiment: &Experiment, draws: u64, device: &str) -> Option<String> {
    let (asked, file) = (
        quote_for_shell(&experiment.asked),
        experiment.worn.as_deref()?,
    );
    let device = match device {
        "native" => String::new(),
        device => format!(" --device {device}"),
    };
    let file = quote_for_shell(file);
    Some(format!(
        "experiment {asked} --wearer {file}{device} --draws {draws}"
    ))
}

/// A measure in a condition.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Row {
    /// Condition and measure.
    pub id: String,
    /// The measure for people, and in which condition.
    pub quantity: String,
    /// Of the numbers.
    pub unit: String,
    /// What the paper printed.
    pub paper: Option<f64>,
    /// Median over the wearers.
    pub ours: Option<f64>,
    /// 5th percentile of the wearers.
    pub low: Option<f64>,
    /// 95th percentile.
    pub high: Option<f64>,
    /// Wearers that have it.
    pub n: usize,
}

impl Row {
    /// Median, 5th and 95th percentile of the numbers that are finite, and how many those
    /// are, beside what the paper printed.
    #[must_use]
    pub fn from_numbers(
        id: String,
        quantity: String,
        unit: &str,
        paper: Option<f64>,
        numbers: impl IntoIterator<Item = f64>,
    ) -> Self {
        let spread = Spread::of(numbers.into_iter().filter(|number| number.is_finite()));
        Self {
            id,
            quantity,
            unit: unit.to_owned(),
            paper,
            ours: spread.map(|spread| spread.median),
            low: spread.map(|spread| spread.low),
            high: spread.map(|spread| spread.high),
            n: spread.map_or(0, |spread| spread.n),
        }
    }
}

/// What is said of every simulated result.
const SIMULATED: &str = "Simulated: numbers of assumed bodies, no evidence about people.";
/// What is said where no device told what it is.
const UNKNOWN: &str = "No device answered: whether any of it is simulated is unknown.";
const MEANING: &str = "ours is the median, low and high the 5th and 95th percentile of the wearers \
                       drawn: a range of bodies, no confidence interval.";
const PLAYED: &str = "No wearer was drawn: ours is the median, low and high the 5th and 95th \
                      percentile of the rounds that were played. Shares have no interval: rounds \
                      of one body are no sample of wearers.";
const CASES: &str = "A share's interval (95 %, Wilson) counts wearers, since several cases of one \
                     wearer are not independent.";

impl Outcome {
    /// Of these units: `draws` wearers at each point of the grid.
    #[must_use]
    pub fn from_units(
        experiment: &Experiment,
        (seed, draws): (u64, u64),
        units: &Units,
        simulated: Option<bool>,
    ) -> Self {
        let drawn = experiment.declaration.drawn.iter().map(|drawn| {
            let (field, low, high, source) = (&drawn.field, drawn.low, drawn.high, &drawn.source);
            format!("Drawn: {field} from {low} to {high} ({source}).")
        });
        let told = (&[MEANING, CASES][..], drawn.collect());
        Self {
            decides: deciding_fields(experiment, (seed, draws), units),
            ..Self::build(experiment, (seed, draws), units, simulated, told)
        }
    }

    /// Of trials that were conducted on `device`, each round a unit of its own: with
    /// what the sessions say, at no point of the grid.
    #[must_use]
    pub fn from_trials(
        experiment: &Experiment,
        (device, seed): (&str, u64),
        trials: &[ConductedTrial],
        simulated: Option<bool>,
    ) -> Self {
        let repetitions = experiment.declaration.protocol.repetitions;
        let mut rounds = Units::new();
        for measurement in trials {
            let round =
                (measurement.place.block * repetitions + measurement.place.repetition) as u64;
            let nothing = || vec![TrialMeasures::new(); experiment.conditions.len()];
            let unit = rounds.entry(round).or_insert_with(nothing);
            if let Some(place) = unit.get_mut(measurement.place.condition) {
                place.clone_from(&measurement.measured);
            }
        }
        let rounds_of = experiment.declaration.protocol.rounds() as u64;
        let mut played = experiment.clone();
        let grid = std::mem::take(&mut played.declaration.grid).into_iter();
        let grid = grid.map(|grid| {
            let field = grid.field;
            format!("The grid is for wearers drawn: {field} is here what the session says.")
        });
        let told = (&[PLAYED][..], grid.collect());
        let mut outcome = Self::build(&played, (seed, rounds_of), &rounds, simulated, told);
        outcome.declared.draws = 0;
        outcome.declared.as_declared = false;
        outcome.declared.device = Some(device.to_owned());
        outcome.declared.command = command(experiment, 0, device);
        for share in &mut outcome.shares {
            (share.low, share.high) = (None, None);
        }
        outcome.with_trials(trials)
    }

    /// The same with the trials that were recorded beside it.
    #[must_use]
    pub fn with_trials(mut self, trials: &[ConductedTrial]) -> Self {
        for (position, measurement) in trials.iter().enumerate() {
            let is_first = (measurement.place.block, measurement.place.repetition) == (0, 0);
            if let (true, Some(own)) = (
                is_first,
                self.conditions.get_mut(measurement.place.condition),
            ) {
                own.trial = Some(position);
            }
        }
        self
    }

    fn build(
        experiment: &Experiment,
        (seed, draws): (u64, u64),
        units: &Units,
        simulated: Option<bool>,
        (meaning, more): (&[&str], Vec<String>),
    ) -> Self {
        let declaration = &experiment.declaration;
        let said = match simulated {
            Some(true) => Some(SIMULATED),
            Some(false) => None,
            None => Some(UNKNOWN),
        };
        let said = said.iter().chain(meaning).map(|text| (*text).to_owned());
        let assumed = declaration.assumed.iter().cloned();
        let printed = declaration.printed.iter().filter_map(|printed| {
            let (measure, mean, source) = (&printed.measure, printed.mean()?, &printed.source);
            Some(format!("The paper's {measure} of {mean:.4}: {source}."))
        });
        let more = more
            .into_iter()
            .chain(missing_measures(experiment, units))
            .chain(printed);
        let conditions = experiment
            .conditions
            .iter()
            .map(|condition| ShownCondition {
                levels: condition.levels.clone(),
                trial: None,
            });
        Self {
            name: declaration.name.clone(),
            title: declaration.title.clone(),
            seed,
            simulated,
            cut_short: None,
            declared: Preregistration {
                command: command(experiment, draws, "native"),
                asked: experiment.asked.clone(),
                device: None,
                sha256: experiment.hashes.iter().cloned().collect(),
                source: declaration.source.clone(),
                draws,
                drawn: None,
                as_declared: experiment.worn.is_none()
                    && (seed, draws) == (declaration.seed, declaration.draws),
            },
            conditions: conditions.collect(),
            rows: rows(experiment, draws, units),
            shares: shares(experiment, draws, units),
            decides: Vec::new(),
            sheets: Vec::new(),
            notes: said.chain(assumed).chain(more).collect(),
        }
    }

    /// Whether its shares are of points of a grid.
    #[must_use]
    pub fn is_grid(&self) -> bool {
        self.shares.iter().any(|share| !share.at.is_empty())
    }

    /// As the file has it.
    #[must_use]
    pub fn json(&self) -> String {
        // Strings, numbers and lists only.
        serde_json::to_string_pretty(self).unwrap_or_default() + "\n"
    }
}

impl ShownCondition {
    /// As [`Condition::name`](super::condition::Condition::name).
    #[must_use]
    pub fn name(&self) -> String {
        condition_name(&self.levels)
    }
}

/// Each measure of each condition at each point of the grid.
fn rows(experiment: &Experiment, draws: u64, units: &Units) -> Vec<Row> {
    let declaration = &experiment.declaration;
    let mut rows = Vec::new();
    for point in 0..points(declaration) {
        let place = point_in_words(declaration, point);
        let own = units.range(point * draws..(point + 1) * draws);
        let own: Vec<_> = own.map(|(_, measured)| measured).collect();
        for (c, condition) in experiment.conditions.iter().enumerate() {
            for (m, measure) in experiment.measures().enumerate() {
                let numbers = own.iter().filter_map(|unit| *unit.get(c)?.get(m)?);
                let name = condition.name();
                rows.push(Row::from_numbers(
                    format!("{place}{name}/{}", measure.id),
                    format!("{}: {place}{name}", measure.quantity),
                    measure.unit,
                    printed(declaration, &condition.levels, measure.id),
                    numbers,
                ));
            }
        }
    }
    rows
}

/// Measures that no wearer has in a condition in which wearers were measured.
fn missing_measures(experiment: &Experiment, units: &Units) -> Vec<String> {
    let mut told = Vec::new();
    for (m, measure) in experiment.measures().enumerate() {
        let lacks = |(c, _): &(usize, &Condition)| {
            let measured = units.values().filter_map(|unit| unit.get(*c)?.get(m));
            let mut measured = measured.peekable();
            measured.peek().is_some() && measured.all(Option::is_none)
        };
        let conditions = experiment.conditions.iter().enumerate();
        let names = conditions
            .filter(lacks)
            .map(|(_, condition)| format!("`{}`", condition.name()));
        let names: Vec<String> = names.collect();
        if !names.is_empty() {
            told.push(format!(
                "No {} ({}) in {}: the session has no such joint, wall or force, or nobody came \
                 there. Claims are not judged on it.",
                measure.id,
                measure.quantity,
                names.join(", ")
            ));
        }
    }
    told
}

fn printed(declaration: &Declaration, levels: &[String], measure: &str) -> Option<f64> {
    let mut all = declaration.printed_of(levels);
    all.find(|printed_value| printed_value.measure == measure)?
        .mean()
}
