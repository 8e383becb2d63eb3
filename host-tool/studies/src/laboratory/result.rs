//! Defines `result.json`: our results beside those that a paper prints.

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

/// Result of an experiment or study: the content of `result.json`.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Outcome {
    /// Name of the experiment or study.
    pub name: String,
    /// Heading of the report page.
    pub title: String,
    /// Seed of wearers, noise and trial order.
    pub seed: u64,
    /// Whether everything was simulated; `None` if no device reported it.
    pub simulated: Option<bool>,
    /// Description of what is missing; `None` for a complete result.
    #[serde(default)]
    pub cut_short: Option<String>,
    /// Settings that were fixed before the result was seen, and how to repeat the result.
    pub declared: Preregistration,
    /// The conditions, in the declaration's order.
    pub conditions: Vec<ShownCondition>,
    /// In how many cases each claim holds.
    pub rows: Vec<Row>,
    /// Share of cases in which each claim holds.
    pub shares: Vec<Share>,
    /// For each claim, the random parameters that decide it. Empty without random wearers, and in
    /// results of older versions.
    #[serde(default)]
    pub decides: Vec<DecidingClaim>,
    /// Our results in the form of the paper's own tables and figures, by their numbers; empty for
    /// studies that have none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub sheets: Vec<Sheet>,
    /// Notes that the reader needs to interpret the numbers.
    pub notes: Vec<String>,
}

/// A condition, with the trial that is shown for it on the page.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct ShownCondition {
    /// Names of the condition's levels, one per factor.
    pub levels: Vec<String>,
    /// Index of the condition's first trial in the record, from 0; `None` if none was recorded.
    pub trial: Option<usize>,
}

/// Settings that were fixed before the result was seen, and how to repeat it.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Preregistration {
    /// Name by which a command refers to the experiment: its built-in name, or its file name. Empty
    /// in results of older versions.
    #[serde(default)]
    pub asked: String,
    /// Arguments after `flexor` that repeat the result, without the seed. `None` if the command
    /// `experiment` or `sweep` repeats it by the name of the experiment.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub command: Option<String>,
    /// Name of the device that ran the trials, if the result consists of trials only.
    #[serde(default)]
    pub device: Option<String>,
    /// SHA-256 of the declaration and its sessions, by file name.
    pub sha256: BTreeMap<String, String>,
    /// Paper, section and figure that the experiment replicates.
    pub source: String,
    /// Number of random wearers at each grid point; 0 if the result consists of recorded trials
    /// only.
    pub draws: u64,
    /// Plural noun for the draws if they are not wearers, such as "sessions".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub drawn: Option<String>,
    /// Whether seed, number of draws and wearer are those of the declaration.
    pub as_declared: bool,
}

/// Returns the arguments of the command that repeats an experiment with a wearer file from the
/// command line, without the seed. Returns `None` if no such file was given.
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

/// Values of one measure in one condition, ours beside the paper's.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Row {
    /// Identifier: condition, `/`, and identifier of the measure; preceded by the grid point if
    /// there is one.
    pub id: String,
    /// Readable name of the measure and its condition.
    pub quantity: String,
    pub unit: String,
    /// Value that the paper prints; `None` if it prints none.
    pub paper: Option<f64>,
    /// Median over the wearers; `None` if no wearer has a value.
    pub ours: Option<f64>,
    /// 5th percentile over the wearers; `None` if no wearer has a value.
    pub low: Option<f64>,
    /// 95th percentile over the wearers; `None` if no wearer has a value.
    pub high: Option<f64>,
    /// Number of wearers with a value.
    pub n: usize,
}

impl Row {
    /// Creates a row with median, 5th and 95th percentile and number of the finite `numbers`,
    /// beside the paper's value.
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

/// Note that accompanies every simulated result.
const SIMULATED: &str =
    "Simulated: the numbers come from assumed bodies and are no evidence about people.";
/// Note for a result of which no device reported whether it was simulated.
const UNKNOWN: &str = "No device answered: it is unknown whether any of this is simulated.";
const MEANING: &str = "“Ours” is the median of the randomly generated wearers, low and high are \
                       their 5th and 95th percentiles: a range of bodies, not a confidence \
                       interval.";
const PLAYED: &str = "No wearers were randomly generated: “ours” is the median of the rounds that \
                      were played, low and high are their 5th and 95th percentiles. Shares have no \
                      interval, because rounds with one body are not a sample of wearers.";
const CASES: &str = "The interval of a share (95 %, Wilson) counts wearers, because several cases \
                     of one wearer are not independent.";

impl Outcome {
    /// Creates the result of a sweep with `draws` wearers at each point of the grid.
    #[must_use]
    pub fn from_units(
        experiment: &Experiment,
        (seed, draws): (u64, u64),
        units: &Units,
        simulated: Option<bool>,
    ) -> Self {
        let drawn = experiment.declaration.drawn.iter().map(|drawn| {
            let (field, low, high, source) = (&drawn.field, drawn.low, drawn.high, &drawn.source);
            format!("Drawn at random: {field} from {low} to {high} ({source}).")
        });
        let notes = (&[MEANING, CASES][..], drawn.collect());
        Self {
            decides: deciding_fields(experiment, (seed, draws), units),
            ..Self::build(experiment, (seed, draws), units, simulated, notes)
        }
    }

    /// Creates the result of trials that were conducted on `device`. Each round of all conditions
    /// counts as a unit; no field is random, and there is no grid.
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
            format!("The grid applies only to sweeps: here {field} has the session's value.")
        });
        let notes = (&[PLAYED][..], grid.collect());
        let mut outcome = Self::build(&played, (seed, rounds_of), &rounds, simulated, notes);
        outcome.declared.draws = 0;
        outcome.declared.as_declared = false;
        outcome.declared.device = Some(device.to_owned());
        outcome.declared.command = command(experiment, 0, device);
        for share in &mut outcome.shares {
            (share.low, share.high) = (None, None);
        }
        outcome.with_trials(trials)
    }

    /// Adds to each condition the recorded trial that the page shows for it.
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
        let notice = match simulated {
            Some(true) => Some(SIMULATED),
            Some(false) => None,
            None => Some(UNKNOWN),
        };
        let notes = notice.iter().chain(meaning).map(|text| (*text).to_owned());
        let assumed = declaration.assumed.iter().cloned();
        let printed = declaration.printed.iter().filter_map(|printed| {
            let (measure, mean, source) = (&printed.measure, printed.mean()?, &printed.source);
            Some(format!("The paper's {measure} is {mean:.4}: {source}."))
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
            notes: notes.chain(assumed).chain(more).collect(),
        }
    }

    /// Returns whether the experiment has a grid, so that each share belongs to a grid point.
    #[must_use]
    pub fn is_grid(&self) -> bool {
        self.shares.iter().any(|share| !share.at.is_empty())
    }

    /// Returns the result as the text of `result.json`.
    #[must_use]
    pub fn json(&self) -> String {
        // Cannot fail: the result has only strings, numbers and lists.
        serde_json::to_string_pretty(self).unwrap_or_default() + "\n"
    }
}

impl ShownCondition {
    /// Returns the readable name of the condition: the names of its levels, separated by commas.
    #[must_use]
    pub fn name(&self) -> String {
        condition_name(&self.levels)
    }
}

/// Returns a row for each measure in each condition at each point of the grid.
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

/// Returns a note for each measure that no wearer has in a condition, although wearers were
/// simulated in it.
fn missing_measures(experiment: &Experiment, units: &Units) -> Vec<String> {
    let mut notes = Vec::new();
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
            notes.push(format!(
                "{} ({}) has no value in {}: the session lacks the joint, wall or force, or no \
                 wearer reached it. Claims about it are not judged.",
                measure.id,
                measure.quantity,
                names.join(", ")
            ));
        }
    }
    notes
}

fn printed(declaration: &Declaration, levels: &[String], measure: &str) -> Option<f64> {
    let mut printed_values = declaration.printed_of(levels);
    printed_values
        .find(|printed_value| printed_value.measure == measure)?
        .mean()
}
