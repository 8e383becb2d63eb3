//! Defines a study for the runner: units of work that depend on a seed and are stored one by one,
//! and their analysis.

use super::result::Outcome;
use super::sweep::{Drawing, Sweep};
use host_core::record::sha256;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::collections::BTreeMap;

/// The inputs of a study that determine all of its units.
pub struct StudyIdentity<'a> {
    /// Name of the study on the command line.
    pub name: &'a str,
    /// Arguments besides seed and draws that affect the result, as typed on the command line; empty
    /// without any.
    pub arguments: String,
    /// File name and text of the study's declaration.
    pub declaration: (&'a str, &'a str),
    /// Seed from which all draws are generated.
    pub seed: u64,
    /// Number of random wearers, or of repetitions of the whole study.
    pub draws: u64,
}

/// A study with its arguments: its units of work, how each is computed, and how all are analysed.
pub trait Study: Sync {
    /// Result of a unit of work. It is stored as one line of JSON, with all significant digits.
    type Unit: Serialize + DeserializeOwned + Clone + Send + Sync;

    /// Returns the inputs that determine all units.
    fn metadata(&self) -> StudyIdentity<'_>;
    /// Returns the SHA-256 of every preregistered file, by name. By default this is only the
    /// declaration.
    fn hashes(&self) -> BTreeMap<String, String> {
        let (file, text) = self.metadata().declaration;
        [(file.to_owned(), sha256(text.as_bytes()))].into()
    }
    /// Returns the version of the program that computes the units. A folder with units of another
    /// version is neither continued nor merged.
    fn version(&self) -> String {
        env!("CARGO_PKG_VERSION").to_owned()
    }
    /// Returns whether a unit does not depend on the number of draws, so that a finished folder can
    /// be extended to more draws.
    fn is_extensible(&self) -> bool {
        false
    }
    /// Returns the number of units of work. By default each draw is a unit.
    fn units(&self) -> u64 {
        self.metadata().draws
    }
    /// Computes unit `index`, from 0. A long computation calls `goes_on` now and then, and returns
    /// `None` after it has returned `false`.
    ///
    /// # Errors
    /// Fails if the unit cannot be computed. The study then ends, and all earlier units stay
    /// stored.
    fn compute(
        &self,
        index: u64,
        goes_on: &(dyn Fn() -> bool + Sync),
    ) -> anyhow::Result<Option<Self::Unit>>;
    /// Analyses the units, which are all or only the first ones. `cut_short` describes what is
    /// missing.
    ///
    /// # Errors
    /// Fails if the units cannot be analysed.
    fn outcome(&self, units: &[Self::Unit], cut_short: Option<String>) -> anyhow::Result<Outcome>;
    /// Returns name and content of the files that are written beside `result.json`. Studies with
    /// random participants include `draws.csv`.
    ///
    /// # Errors
    /// Fails as [`Self::outcome`] does.
    fn files(&self, units: &[Self::Unit]) -> anyhow::Result<Vec<(String, String)>>;
    /// Returns the progress in words, for example `12 of 40 sessions`.
    fn progress_text(&self, done: u64) -> String;
}

/// Adapter that runs a study as a sweep, with one line of JSON for each unit.
pub struct Lines<'a, S>(pub &'a S);

impl<S: Study> Lines<'_, S> {
    /// Returns the units as a list, without their indices; they are always the first units of the
    /// study.
    fn listed(units: &BTreeMap<u64, S::Unit>) -> Vec<S::Unit> {
        units.values().cloned().collect()
    }
}

/// Returns the checksum of a line, which reveals changes by hand: the first 16 digits of its
/// SHA-256.
fn checksum(text: &str) -> String {
    sha256(text.as_bytes()).chars().take(16).collect()
}

/// Returns a value as a line of JSON, with all significant digits.
pub(crate) fn line(value: &impl Serialize) -> String {
    // Cannot fail: the types have only numbers, strings and lists.
    serde_json::to_string(value).unwrap_or_default() + "\n"
}

impl<S: Study> Drawing for Lines<'_, S> {
    type Unit = S::Unit;
    type Error = anyhow::Error;

    fn name(&self) -> &str {
        self.0.metadata().name
    }

    fn subset(&self) -> Option<String> {
        Some(self.0.metadata().arguments).filter(|arguments| !arguments.is_empty())
    }

    fn version(&self) -> String {
        self.0.version()
    }

    fn is_extensible(&self) -> bool {
        self.0.is_extensible()
    }

    fn file(&self) -> &'static str {
        "units.jsonl"
    }

    fn hashes(&self) -> BTreeMap<String, String> {
        self.0.hashes()
    }

    fn declaration(&self) -> &str {
        self.0.metadata().declaration.1
    }

    fn columns(&self) -> Vec<String> {
        Vec::new()
    }

    fn units(&self, _: u64) -> u64 {
        self.0.units()
    }

    fn rows_per_unit(&self) -> usize {
        1
    }

    fn index_of(&self, row: &str) -> Option<u64> {
        row.strip_prefix("{\"unit\":")?
            .split(',')
            .next()?
            .parse()
            .ok()
    }

    fn row_prefixes(&self, _: &Sweep, unit: u64) -> Vec<String> {
        vec![format!("{{\"unit\":{unit}")]
    }

    fn compute(
        &self,
        _: &Sweep,
        unit: u64,
        goes_on: &(dyn Fn() -> bool + Sync),
    ) -> Result<Option<Self::Unit>, Self::Error> {
        self.0.compute(unit, goes_on)
    }

    fn row_suffixes(&self, unit: &Self::Unit) -> Vec<String> {
        // Cannot fail: the types have only numbers, strings and lists.
        let text = serde_json::to_string(unit).unwrap_or_default();
        vec![format!(
            "\"sum\":\"{}\",\"became\":{text}}}",
            checksum(&text)
        )]
    }

    fn parse_unit(&self, rest: &[&str]) -> Result<Self::Unit, (usize, String)> {
        let rest = rest.first().copied().unwrap_or_default();
        let parts = rest.split_once("\",\"became\":");
        let parts = parts.and_then(|(begin, text)| {
            Some((begin.strip_prefix("\"sum\":\"")?, text.strip_suffix('}')?))
        });
        match parts {
            Some((own, text)) if own == checksum(text) => {
                serde_json::from_str(text).map_err(|error| (0, error.to_string()))
            }
            _ => Err((
                0,
                "its checksum does not match: the line was changed".to_owned(),
            )),
        }
    }

    fn outcome(
        &self,
        _: &Sweep,
        units: &BTreeMap<u64, Self::Unit>,
    ) -> Result<Outcome, Self::Error> {
        let done = units.len() as u64;
        let cut_short = (done < self.0.units())
            .then(|| format!("Cut short after {}.", self.0.progress_text(done)));
        self.0.outcome(&Self::listed(units), cut_short)
    }

    fn files(
        &self,
        _: &Sweep,
        units: &BTreeMap<u64, Self::Unit>,
    ) -> Result<Vec<(String, String)>, Self::Error> {
        self.0.files(&Self::listed(units))
    }

    fn progress_text(&self, _: &Sweep, done: u64) -> String {
        self.0.progress_text(done)
    }
}
