//! Connects the study to the laboratory's runner.

use super::declaration::{DECLARED, Study};
use super::error::EndpointError;
use super::metrics::median;
use super::picture::page;
use super::played::play_c3;
use super::population::{RunInfo, outcome};
use super::replication::{Replication, replication};
use crate::laboratory::{self, Outcome, StudyIdentity};
use host_core::run::DeviceName;
use std::fmt::Write;

/// Name of the study on the command line.
pub const NAME: &str = "sierotowicz";

/// The study, and the description of how a device played one of its conditions.
pub struct Run {
    study: Study,
    seed: u64,
    draws: u64,
    device: DeviceName,
    played: String,
}

impl Run {
    /// Creates the study with this seed and number of replications; `None` takes the preregistered
    /// value. Plays C3 on the device first, so that problems with the device appear before the
    /// draws.
    ///
    /// # Errors
    /// Fails if the declaration is invalid, or the device plays other pulses.
    pub fn new(
        (seed, draws): (Option<u64>, Option<u64>),
        device: DeviceName,
    ) -> Result<Self, EndpointError> {
        let study = Study::load_embedded()?;
        let seed = seed.unwrap_or(study.seed);
        Ok(Self {
            draws: draws.unwrap_or(study.replications),
            played: play_c3(&study, seed, &device)?.in_words(&device),
            study,
            seed,
            device,
        })
    }
}

/// Separates the complete studies from the reasons why others are missing.
fn split_results(units: &[Result<Replication, String>]) -> (Vec<Replication>, Vec<String>) {
    let whole = units
        .iter()
        .filter_map(|replication| replication.as_ref().ok().cloned());
    let failed = units
        .iter()
        .filter_map(|replication| replication.as_ref().err().cloned());
    (whole.collect(), failed.collect())
}

/// Formats one row for each condition of each participant.
fn csv(all: &[Replication]) -> String {
    let mut text = "study,participant,condition,rmse_x_n,rmse_y_n,rmse_z_n,rmse_n,\
                    median_error_n,median_angle_deg\n"
        .to_owned();
    for study in all {
        for (nth, person) in (1..).zip(&study.people) {
            for condition in &person.conditions {
                let [x, y, z, whole] = condition.measures.rmse_n;
                let error = median(&condition.measures.errors_n);
                let angle = median(&condition.measures.angles_deg);
                // Writing to a string cannot fail.
                let _ = writeln!(
                    text,
                    "{},S{nth},{},{x},{y},{z},{whole},{error},{angle}",
                    study.index, condition.name
                );
            }
        }
    }
    text
}

impl Run {
    /// Returns the device as an argument of the command line.
    fn device_argument(&self) -> String {
        format!("--device {}", self.device.to_argument())
    }
}

impl laboratory::Study for Run {
    type Unit = Result<Replication, String>;

    fn metadata(&self) -> StudyIdentity<'_> {
        StudyIdentity {
            name: NAME,
            arguments: self.device_argument(),
            declaration: ("study.toml", DECLARED),
            seed: self.seed,
            draws: self.draws,
        }
    }

    fn compute(
        &self,
        index: u64,
        _: &(dyn Fn() -> bool + Sync),
    ) -> anyhow::Result<Option<Self::Unit>> {
        let found = replication(&self.study, self.seed, index);
        Ok(Some(
            found.map_err(|error| format!("study {index}: {error}")),
        ))
    }

    fn outcome(&self, units: &[Self::Unit], cut_short: Option<String>) -> anyhow::Result<Outcome> {
        let (whole, failed) = split_results(units);
        let told = RunInfo {
            seed: self.seed,
            draws: self.draws,
            command: format!(
                "experiment {NAME} {} --draws {}",
                self.device_argument(),
                self.draws
            ),
            played: Some((self.device.to_argument(), self.played.clone())),
            cut_short,
            failed,
        };
        Ok(outcome(&self.study, &whole, told)?)
    }

    fn files(&self, units: &[Self::Unit]) -> anyhow::Result<Vec<(String, String)>> {
        let (whole, _) = split_results(units);
        let lines = whole.iter().map(laboratory::line);
        let mut files = vec![
            ("draws.csv".to_owned(), csv(&whole)),
            ("studies.jsonl".to_owned(), lines.collect()),
        ];
        files.extend(
            whole
                .first()
                .map(|replication| ("arms.html".to_owned(), page(replication))),
        );
        Ok(files)
    }

    fn progress_text(&self, done: u64) -> String {
        format!("{done} of {} studies", self.draws)
    }
}
