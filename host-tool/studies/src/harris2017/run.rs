//! Connects the study to the laboratory's runner.

use super::declared::DECLARED;
use super::error::RampsError;
use super::found::{DrawMeasurements, DrawResult, Pulses};
use super::outcome::RunInfo;
use super::study::{NAME, Study};
use crate::laboratory::{self, Outcome, StudyIdentity};
use host_core::run::DeviceName;

/// A study, and the pulses of its stimulations as a device plays them.
pub struct Run {
    study: Study,
    pulses: Pulses,
    /// Notes about the device for the report.
    notes: Vec<String>,
}

impl Run {
    /// Creates the study with this seed and number of wearers, where `None` takes the preregistered
    /// value, and plays all stimulations on the device.
    ///
    /// # Errors
    /// Fails like [`Study::new`] and [`Study::play_on_device`].
    pub fn new(
        decided: (Option<u64>, Option<u64>),
        device: DeviceName,
    ) -> Result<Self, RampsError> {
        let study = Study::new(decided, device)?;
        let (pulses, notes) = study.play_on_device()?;
        Ok(Self {
            study,
            pulses,
            notes,
        })
    }

    /// Restores the wearers of these units from the seed.
    fn restore_draws(&self, kept: &[DrawMeasurements]) -> Result<Vec<DrawResult>, RampsError> {
        let all = (0..).zip(kept);
        all.map(|(index, kept)| self.study.restore_draw(index, kept.clone()))
            .collect()
    }
}

impl Run {
    /// Returns the device as an argument of the command line.
    fn device_argument(&self) -> String {
        format!("--device {}", self.study.device.to_argument())
    }
}

impl laboratory::Study for Run {
    type Unit = DrawMeasurements;

    fn metadata(&self) -> StudyIdentity<'_> {
        StudyIdentity {
            name: NAME,
            arguments: self.device_argument(),
            declaration: ("harris-ramps.toml", DECLARED),
            seed: self.study.seed,
            draws: self.study.draws,
        }
    }

    fn units(&self) -> u64 {
        self.study.persons()
    }

    fn compute(
        &self,
        index: u64,
        _: &(dyn Fn() -> bool + Sync),
    ) -> anyhow::Result<Option<DrawMeasurements>> {
        let found = self.study.compute_draw(index, &self.pulses)?;
        Ok(Some(found.kept))
    }

    fn outcome(
        &self,
        kept: &[DrawMeasurements],
        cut_short: Option<String>,
    ) -> anyhow::Result<Outcome> {
        let told = RunInfo {
            command: format!(
                "experiment {NAME} {} --draws {}",
                self.device_argument(),
                self.study.draws
            ),
            cut_short,
            notes: self.notes.clone(),
        };
        Ok(self.study.outcome(&self.restore_draws(kept)?, told)?)
    }

    fn files(&self, kept: &[DrawMeasurements]) -> anyhow::Result<Vec<(String, String)>> {
        let all = self.restore_draws(kept)?;
        let mut files = vec![("draws.csv".to_owned(), self.study.csv(&all))];
        let wearers = all.iter().take(2).enumerate();
        let wearers = wearers.filter_map(|(nth, found)| self.study.wearer(nth, found));
        files.extend(wearers.map(|wearer| (format!("{}.toml", wearer.name), wearer.to_toml())));
        Ok(files)
    }

    fn progress_text(&self, done: u64) -> String {
        format!("{done} of {} wearers", self.units())
    }
}
