//! Adapts the study to the laboratory's runner.

use super::declaration::DECLARED;
use super::error::LeeError;
use super::outcome::RunInfo;
use super::study::{Part, Study};
use crate::laboratory::{self, Outcome, StudyIdentity};
use host_core::run::DeviceName;

/// The study, and the results of its check on a device.
pub struct Run {
    study: Study,
    device: Vec<String>,
}

impl Run {
    /// Creates a run with this seed and number of replications, or those of the declaration. Checks
    /// the device first, so that a problem shows before minutes of computing.
    ///
    /// # Errors
    /// Fails as [`Study::new`] and [`Study::check_on_device`] do.
    pub fn new(
        (seed, draws): (Option<u64>, Option<u64>),
        device: DeviceName,
    ) -> Result<Self, LeeError> {
        let study = Study::new(seed, draws, device)?;
        let device = study.check_on_device()?;
        Ok(Self { study, device })
    }
}

impl Run {
    /// Returns the device as a command-line argument.
    fn device_argument(&self) -> String {
        format!("--device {}", self.study.device.to_argument())
    }
}

impl laboratory::Study for Run {
    type Unit = Part;

    fn metadata(&self) -> StudyIdentity<'_> {
        StudyIdentity {
            name: "lee",
            arguments: self.device_argument(),
            declaration: ("lee.toml", DECLARED),
            seed: self.study.seed,
            draws: self.study.draws,
        }
    }

    fn units(&self) -> u64 {
        self.study.units().len() as u64
    }

    fn compute(&self, index: u64, _: &(dyn Fn() -> bool + Sync)) -> anyhow::Result<Option<Part>> {
        let units = self.study.units();
        let unit = usize::try_from(index)
            .ok()
            .and_then(|index| units.get(index));
        Ok(unit.map(|unit| self.study.compute_unit(unit)).transpose()?)
    }

    fn outcome(&self, parts: &[Part], cut_short: Option<String>) -> anyhow::Result<Outcome> {
        let run_info = RunInfo {
            command: format!(
                "experiment lee {} --draws {}",
                self.device_argument(),
                self.study.draws
            ),
            cut_short,
            device: self.device.clone(),
        };
        Ok(self.study.outcome(parts, run_info)?)
    }

    fn files(&self, parts: &[Part]) -> anyhow::Result<Vec<(String, String)>> {
        let mut files = vec![
            ("draws.csv".to_owned(), self.study.csv(parts)),
            ("mismatch.csv".to_owned(), self.study.mismatch_csv(parts)),
        ];
        files.extend(self.study.wearers(parts)?);
        Ok(files)
    }

    fn progress_text(&self, done: u64) -> String {
        format!("{done} of {} sessions", self.units())
    }
}
