//! Several records side by side: numbers, traces and session files.
//!
//! Lives here: what is kept of each record ([`Compared`]), which of their trials belong
//! together (`pairs`), the text (`text`) and the page (`page`) of it. Not here: what a
//! number means (`analysis`). Of a record no more than one trial is held at a time.

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
use super::trajectory::Traced;
use crate::analysis::{ChannelDose, doses, force_metrics, hits, limit_cycles, metrics_but_lag};
use crate::record::{Identity, RecordError, Run, Trial, load_each};
use overlay::Course;
use serde::Serialize;
use std::path::Path;

/// What is kept of a record, and what to call it.
#[derive(Debug)]
pub struct Compared {
    /// Its folder, as given.
    pub name: String,
    title: String,
    device: String,
    is_simulated: bool,
    is_complete: bool,
    caveat: Option<String>,
    /// What the record has lost since it was closed.
    pub damaged: Option<String>,
    trials: Vec<Kept>,
}

/// What is kept of a trial.
#[derive(Debug)]
struct Kept {
    row: TrialRow,
    traced: Traced,
    courses: Vec<Course>,
    session: String,
    wearer: String,
    is_simulated: bool,
    identity: Option<Identity>,
}

/// One trial of one record in numbers. `None`: it has no such thing.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct CompareRow {
    /// The record, from 1.
    pub number: usize,
    /// Its folder.
    pub record: String,
    /// What stimulated.
    pub device: String,
    /// Whether that was a simulator.
    pub simulated: bool,
    /// Whether the run came to its own end.
    pub complete: bool,
    /// Whether the record has lost something since.
    pub damaged: bool,
    /// Numbers of the trial.
    #[serde(flatten)]
    pub of: TrialRow,
}

/// Numbers of a trial. `None`: it has no such thing.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct TrialRow {
    /// The trial.
    pub trial: String,
    /// Length, s.
    pub duration_s: f64,
    /// Of a joint that followed a target, degrees.
    pub rmse_deg: Option<f64>,
    /// Of the worst channel under force control, N.
    pub rmse_n: Option<f64>,
    /// At a virtual wall, degrees inside.
    pub deepest_deg: Option<f64>,
    /// Pulses of more than 0 that were played; not the electrode check's.
    pub pulses: Option<u64>,
    /// How often the device lowered a joint's feedback for a limit cycle.
    pub limit_cycles: usize,
    /// The model that each muscle began with.
    pub models: Option<String>,
    /// What each channel put out.
    pub channels: Vec<ChannelDose>,
}

impl Kept {
    fn of(trial: &Trial) -> Self {
        let forces = force_metrics(trial).into_iter().map(|m| m.rmse_n);
        let depths = hits(trial).into_iter().map(|hit| hit.deepest_deg);
        let wearer = trial.wearer.as_ref();
        Self {
            row: TrialRow {
                trial: trial.name.clone(),
                duration_s: trial.duration_s,
                rmse_deg: metrics_but_lag(trial).map(|m| m.rmse_deg),
                rmse_n: forces.reduce(f64::max),
                deepest_deg: depths.reduce(f64::max),
                pulses: trial.pulses,
                limit_cycles: limit_cycles(trial).count(),
                models: models_in_words(trial),
                channels: doses(trial),
            },
            traced: Traced::of(trial),
            courses: Course::all(trial),
            session: trial.session_text.clone(),
            wearer: wearer.map_or_else(String::new, |wearer| wearer.text.clone()),
            is_simulated: trial.is_simulated(),
            identity: trial.identity.clone(),
        }
    }
}

impl Compared {
    /// Of the record in `dir`, which is read trial by trial.
    ///
    /// # Errors
    /// As [`load_each`].
    pub fn read(dir: &Path) -> Result<Self, RecordError> {
        let mut trials = Vec::new();
        let run = load_each(dir, &mut |trial| trials.push(Kept::of(&trial)))?;
        Ok(Self::with(dir, run, trials))
    }

    /// Of a run in memory that is the record in `dir`.
    #[must_use]
    pub fn of(dir: &Path, run: &Run) -> Self {
        let trials = run.trials.iter().map(Kept::of).collect();
        let run = Run {
            trials: Vec::new(),
            ..run.clone()
        };
        Self::with(dir, run, trials)
    }

    fn with(dir: &Path, mut run: Run, trials: Vec<Kept>) -> Self {
        // Of what the run says of its device no sample is needed.
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
            damaged: run.damaged(dir).map(|error| error.to_string()),
            title: run.title,
            trials,
        }
    }
}

/// A row for each trial of each record, in the order given.
#[must_use]
pub fn compare_rows(all: &[Compared]) -> Vec<CompareRow> {
    let numbered = all.iter().enumerate();
    let rows = numbered.flat_map(|(position, compared)| {
        let row = move |kept: &Kept| CompareRow {
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
