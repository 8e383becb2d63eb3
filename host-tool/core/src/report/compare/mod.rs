//! Comparison of several records: numbers, traces and session files.
//!
//! This module keeps the data of each record that a comparison needs ([`ComparedRecord`]), matches their
//! trials (`pairs`), and writes the comparison as text (`text`) and as a page (`page`). What a
//! number means is in `analysis`. Only one trial of a record is in memory at a time.

mod files;
mod overlay;
mod page;
mod pairs;
mod sessions;
mod text;

pub use files::{FileDifference, KeyChange};
pub use page::compare_body;
pub use sessions::session_differences;
pub use text::compare_text;

use super::tables::models_in_words;
use super::trajectory::TrialTrace;
use crate::analysis::{
    ChannelDose, doses, force_metrics, limit_cycles, metrics_without_lag, wall_contacts,
};
use crate::record::{Identity, RecordError, Run, Trial, load_each};
use overlay::Course;
use serde::Serialize;
use std::path::Path;

/// Data of one record that a comparison needs.
#[derive(Debug)]
pub struct ComparedRecord {
    /// Folder of the record, as the user gave it.
    pub name: String,
    title: String,
    device: String,
    is_simulated: bool,
    is_complete: bool,
    caveat: Option<String>,
    /// Description of the data that the record has lost since it was closed; `None` if it has lost
    /// none.
    pub damaged: Option<String>,
    trials: Vec<ComparedTrial>,
}

/// Data of one trial that a comparison needs.
#[derive(Debug)]
struct ComparedTrial {
    row: TrialRow,
    traced: TrialTrace,
    courses: Vec<Course>,
    session: String,
    wearer: String,
    is_simulated: bool,
    identity: Option<Identity>,
}

/// Row of a comparison: one trial of one record, with its numbers.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct CompareRow {
    /// Number of the record, from 1.
    pub number: usize,
    /// Folder of the record, as the user gave it.
    pub record: String,
    /// Kind and name of the device that stimulated.
    pub device: String,
    /// Whether the wearer was simulated.
    pub simulated: bool,
    /// Whether the run was carried out to its end.
    pub complete: bool,
    /// Whether the record has lost data since it was closed.
    pub damaged: bool,
    /// Results and doses of the trial.
    #[serde(flatten)]
    pub of: TrialRow,
}

/// Results and doses of one trial. A number is `None` if the trial has nothing that it could
/// describe.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct TrialRow {
    /// Name of the trial.
    pub trial: String,
    /// Duration of the trial, s.
    pub duration_s: f64,
    /// Root mean square error of the angle of a controlled joint, degrees.
    pub rmse_deg: Option<f64>,
    /// Root mean square error of the force on the channel under force control that has the largest
    /// error, N.
    pub rmse_n: Option<f64>,
    /// Deepest penetration of a virtual wall in any hit, degrees.
    pub deepest_deg: Option<f64>,
    /// Number of pulses with an amplitude above 0 that were output. Pulses of the electrode check
    /// do not count.
    pub pulses: Option<u64>,
    /// Number of times that the device lowered the feedback of a joint because of a limit cycle.
    pub limit_cycles: usize,
    /// Model level at which each muscle began, in words.
    pub models: Option<String>,
    /// Dose that each channel delivered: amplitude, charge, current and time.
    pub channels: Vec<ChannelDose>,
}

impl ComparedTrial {
    fn from_trial(trial: &Trial) -> Self {
        let forces = force_metrics(trial).into_iter().map(|m| m.rmse_n);
        let depths = wall_contacts(trial).into_iter().map(|hit| hit.deepest_deg);
        let wearer = trial.wearer.as_ref();
        Self {
            row: TrialRow {
                trial: trial.name.clone(),
                duration_s: trial.duration_s,
                rmse_deg: metrics_without_lag(trial).map(|m| m.rmse_deg),
                rmse_n: forces.reduce(f64::max),
                deepest_deg: depths.reduce(f64::max),
                pulses: trial.pulses,
                limit_cycles: limit_cycles(trial).count(),
                models: models_in_words(trial),
                channels: doses(trial),
            },
            traced: TrialTrace::from_trial(trial),
            courses: Course::channel_courses(trial),
            session: trial.session_text.clone(),
            wearer: wearer.map_or_else(String::new, |wearer| wearer.text.clone()),
            is_simulated: trial.is_simulated(),
            identity: trial.identity.clone(),
        }
    }
}

impl ComparedRecord {
    /// Reads the record in `dir` with only one trial in memory at a time.
    ///
    /// # Errors
    /// As [`load_each`].
    pub fn read(dir: &Path) -> Result<Self, RecordError> {
        let mut trials = Vec::new();
        let run = load_each(dir, &mut |trial| {
            trials.push(ComparedTrial::from_trial(&trial))
        })?;
        Ok(Self::from_parts(dir, run, trials))
    }

    /// Extracts the data of a run in memory, whose record is in `dir`.
    #[must_use]
    pub fn from_run(dir: &Path, run: &Run) -> Self {
        let trials = run.trials.iter().map(ComparedTrial::from_trial).collect();
        let run = Run {
            trials: Vec::new(),
            ..run.clone()
        };
        Self::from_parts(dir, run, trials)
    }

    fn from_parts(dir: &Path, mut run: Run, trials: Vec<ComparedTrial>) -> Self {
        // The description of the device needs no samples.
        run.trials = trials
            .iter()
            .map(|kept| Trial {
                identity: kept.identity.clone(),
                ..Trial::default()
            })
            .collect();
        Self {
            name: dir.display().to_string(),
            device: run.device_in_words(),
            is_simulated: trials.iter().any(|kept| kept.is_simulated),
            is_complete: !run.ending.is_incomplete(),
            caveat: run.caveat(),
            damaged: run.damage_error(dir).map(|error| error.to_string()),
            title: run.title,
            trials,
        }
    }
}

/// Returns a row for each trial of each record; records and trials keep their order.
#[must_use]
pub fn compare_rows(records: &[ComparedRecord]) -> Vec<CompareRow> {
    let numbered = records.iter().enumerate();
    let rows = numbered.flat_map(|(position, compared)| {
        let row = move |kept: &ComparedTrial| CompareRow {
            number: position + 1,
            record: compared.name.clone(),
            device: compared.device.clone(),
            simulated: compared.is_simulated,
            complete: compared.is_complete,
            damaged: compared.damaged.is_some(),
            of: kept.row.clone(),
        };
        compared.trials.iter().map(row)
    });
    rows.collect()
}
