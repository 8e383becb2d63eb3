//! Adapts a campaign to the laboratory's runner: a unit of work is a case.

use super::Campaign;
use super::case::Case;
use super::declaration::Declaration;
use super::error::FaultsError;
use super::outcome::Outcome;
use super::table::csv;
use crate::laboratory::{self, Study, StudyIdentity};
use hal_sim::chip::image::Image;
use host_core::record::{Program, sha256};
use std::collections::BTreeMap;
use std::path::Path;

/// File name under which an earlier program version stored the cases of a campaign.
const EARLIER: &str = "faults.jsonl";

/// A run of a campaign: the class, the simulator, and the number of cases.
pub struct Run {
    campaign: Campaign,
    declaration: Declaration,
    /// SHA-256 of the flashed image; `None` on the native backend, which has no image.
    image: Option<String>,
    seed: u64,
    count: u64,
}

impl Run {
    /// Prepares a run: on the chip simulator if an image is given, otherwise on the native backend.
    /// Where seed or number of cases is `None`, the value of the declaration applies.
    ///
    /// # Errors
    /// Fails as [`Campaign::on_chip`] and [`Campaign::native`] do.
    pub fn new(
        declaration: Declaration,
        image: Option<&Image>,
        (seed, count): (Option<u64>, Option<u64>),
    ) -> Result<Self, FaultsError> {
        let seed = seed.unwrap_or(declaration.seed());
        let campaign = match image {
            None => Campaign::native(seed, &declaration)?,
            Some(image) => Campaign::on_chip(seed, &declaration, image)?,
        };
        Ok(Self {
            campaign,
            image: image.map(|image| sha256(&image.flash)),
            seed,
            count: count.unwrap_or_else(|| declaration.count(image.is_none())),
            declaration,
        })
    }

    /// Returns the campaign that plays the cases.
    #[must_use]
    pub const fn campaign(&self) -> &Campaign {
        &self.campaign
    }

    /// Returns the simulator's name, `chip` or `native`.
    #[must_use]
    pub const fn device(&self) -> &'static str {
        match self.image {
            Some(_) => "chip",
            None => "native",
        }
    }

    /// Summarises the cases twice: for the table in a terminal, and as the contents of
    /// `result.json`.
    #[must_use]
    pub fn compute_outcomes(&self, cases: &[Case]) -> (Outcome, laboratory::Outcome) {
        let outcome = Outcome::from_cases(self.declaration.class, cases);
        let on = (self.device(), self.seed);
        let result = outcome.result(&self.declaration, on, &self.campaign.notes());
        (outcome, result)
    }

    /// Checks that the folder `dir` contains no campaign of an earlier version.
    ///
    /// # Errors
    /// Fails with E790 if it does.
    pub fn refuse_earlier(dir: &Path) -> Result<(), FaultsError> {
        match dir.join(EARLIER).exists() {
            true => Err(FaultsError::Earlier(dir.display().to_string())),
            false => Ok(()),
        }
    }
}

impl Study for Run {
    type Unit = Case;

    fn metadata(&self) -> StudyIdentity<'_> {
        StudyIdentity {
            name: "faults",
            arguments: format!(
                "--class {} --device {}",
                self.declaration.class,
                self.device()
            ),
            declaration: self.declaration.file(),
            seed: self.seed,
            draws: self.count,
        }
    }

    /// Returns the SHA-256 of the campaign file, its sessions and the flashed image, by name.
    fn hashes(&self) -> BTreeMap<String, String> {
        let image = self.image.clone().map(|hash| ("image".to_owned(), hash));
        let files = self.declaration.sha256.clone();
        files.into_iter().chain(image).collect()
    }

    /// Returns the program's version with its commit, because simulators and judge are part of the
    /// program.
    fn version(&self) -> String {
        Program::current().words()
    }

    fn is_extensible(&self) -> bool {
        true
    }

    fn compute(
        &self,
        index: u64,
        goes_on: &(dyn Fn() -> bool + Sync),
    ) -> anyhow::Result<Option<Case>> {
        let case = goes_on().then(|| self.campaign.case(index));
        Ok(case.transpose()?)
    }

    fn outcome(
        &self,
        cases: &[Case],
        cut_short: Option<String>,
    ) -> anyhow::Result<laboratory::Outcome> {
        let (_, result) = self.compute_outcomes(cases);
        Ok(laboratory::Outcome {
            cut_short,
            ..result
        })
    }

    fn files(&self, cases: &[Case]) -> anyhow::Result<Vec<(String, String)>> {
        let rows = csv(self.declaration.class, cases)?;
        Ok(vec![("faults.csv".to_owned(), String::from_utf8(rows)?)])
    }

    fn progress_text(&self, done: u64) -> String {
        format!("{done} of {} cases", self.count)
    }
}
