//! Interface between a sweep and the experiment or study that it computes.

use super::Sweep;
use crate::laboratory::conduct::ConductedTrial;
use crate::laboratory::error::LaboratoryError;
use crate::laboratory::result::Outcome;
use std::collections::BTreeMap;

/// An experiment or study whose units a sweep computes. Each unit is stored as one or several rows.
pub trait Drawing: Sync {
    /// Result of a unit, for example the measures of one wearer in all conditions.
    type Unit: Send;
    /// Error of a unit, which ends the sweep.
    type Error: From<LaboratoryError> + Send;

    /// Returns the name of the experiment or study.
    fn name(&self) -> &str;
    /// Returns the part of the declaration that the sweep covers, or `None` if it covers
    /// everything.
    fn subset(&self) -> Option<String> {
        None
    }
    /// Returns the version of the program that computes the units, as stored in `sweep.json`. A
    /// folder with units of another version is neither continued nor merged.
    fn version(&self) -> String {
        env!("CARGO_PKG_VERSION").to_owned()
    }
    /// Returns whether a unit does not depend on the number of draws, so that a finished folder can
    /// be extended to more draws.
    fn is_extensible(&self) -> bool {
        false
    }
    /// Returns the name of the file in which the units are stored.
    fn file(&self) -> &'static str {
        "draws.csv"
    }
    /// Returns the SHA-256 of every preregistered file, by name.
    fn hashes(&self) -> BTreeMap<String, String>;
    /// Returns the text that is stored as `declaration.toml`.
    fn declaration(&self) -> &str;
    /// Returns the column names for the header of the file; empty if the file has no header.
    fn columns(&self) -> Vec<String>;
    /// Returns the number of units of a sweep with `draws` random wearers.
    fn units(&self, draws: u64) -> u64;
    /// Returns the number of rows in which every unit is stored.
    fn rows_per_unit(&self) -> usize;
    /// Parses the index of a unit, which is at the start of its first row.
    fn index_of(&self, row: &str) -> Option<u64> {
        row.split(',').next()?.parse().ok()
    }
    /// Returns the start of each row of a unit, beginning with the index. It is known before the
    /// unit is computed, and a stored row must begin with it.
    fn row_prefixes(&self, sweep: &Sweep, unit: u64) -> Vec<String>;
    /// Computes a unit. A long computation calls `goes_on` now and then, and may return `None`
    /// after it has returned `false`.
    ///
    /// # Errors
    /// Fails if the unit cannot be computed. The sweep then ends, and all earlier units stay
    /// stored.
    fn compute(
        &self,
        sweep: &Sweep,
        unit: u64,
        goes_on: &(dyn Fn() -> bool + Sync),
    ) -> Result<Option<Self::Unit>, Self::Error>;
    /// Returns the part of each row of a unit that follows the known start, with all significant
    /// digits.
    fn row_suffixes(&self, unit: &Self::Unit) -> Vec<String>;
    /// Parses a unit from the parts of its rows that [`Self::row_suffixes`] has written.
    ///
    /// # Errors
    /// Returns the index of the row, from 0, that cannot be parsed, and the reason.
    fn parse_unit(&self, rest: &[&str]) -> Result<Self::Unit, (usize, String)>;
    /// Analyses the units, which are all or only the first ones.
    ///
    /// # Errors
    /// Fails if the units cannot be analysed.
    fn outcome(
        &self,
        sweep: &Sweep,
        units: &BTreeMap<u64, Self::Unit>,
    ) -> Result<Outcome, Self::Error>;
    /// Returns name and content of the files that are written beside the page.
    ///
    /// # Errors
    /// Fails as [`Self::outcome`] does.
    fn files(
        &self,
        sweep: &Sweep,
        units: &BTreeMap<u64, Self::Unit>,
    ) -> Result<Vec<(String, String)>, Self::Error> {
        let _ = (sweep, units);
        Ok(Vec::new())
    }
    /// Returns the progress in words, for example `12 of 40 sessions`.
    fn progress_text(&self, sweep: &Sweep, done: u64) -> String {
        format!("{done} of {} units", self.units(sweep.draws))
    }
    /// Returns a text table for a terminal of 80 columns, if the study has tables beyond those of
    /// its outcome.
    fn table(&self, sweep: &Sweep, units: &BTreeMap<u64, Self::Unit>) -> Option<String> {
        let _ = (sweep, units);
        None
    }
    /// Returns recorded trials that the page also shows.
    fn trials(&self) -> &[ConductedTrial] {
        &[]
    }
}
