//! Interface between a sweep and the experiment or study that it computes.

use super::Sweep;
use crate::laboratory::conduct::ConductedTrial;
use crate::laboratory::error::LaboratoryError;
use crate::laboratory::result::Outcome;
use std::collections::BTreeMap;

/// The units that a sweep computes; each is stored as one or several rows.
pub trait Drawing: Sync {
    /// Result of a unit.
    type Unit: Send;
    /// Error of a unit that ends the sweep.
    type Error: From<LaboratoryError> + Send;

    /// Returns the name of the sweep.
    fn name(&self) -> &str;
    /// Returns the part of the declaration that the sweep covers, or `None` if it covers
    /// everything.
    fn subset(&self) -> Option<String> {
        None
    }
    /// Returns the version of the program that computes the units, as in `sweep.json`. Another
    /// version neither continues nor merges them.
    fn version(&self) -> String {
        env!("CARGO_PKG_VERSION").to_owned()
    }
    /// Returns whether a unit is independent of the number of draws, so that a folder can be
    /// extended to more draws.
    fn is_extensible(&self) -> bool {
        false
    }
    /// Returns the name of the file that stores the units.
    fn file(&self) -> &'static str {
        "draws.csv"
    }
    /// Returns the SHA-256 of every preregistered file, by name.
    fn hashes(&self) -> BTreeMap<String, String>;
    /// Returns the contents of `declaration.toml`.
    fn declaration(&self) -> &str;
    /// Returns the column names; if there are none, the file has no header.
    fn columns(&self) -> Vec<String>;
    /// Returns the number of units for this number of draws.
    fn units(&self, draws: u64) -> u64;
    /// Returns the number of rows of each unit.
    fn rows_per_unit(&self) -> usize;
    /// Parses the unit's index at the start of its first row.
    fn index_of(&self, row: &str) -> Option<u64> {
        row.split(',').next()?.parse().ok()
    }
    /// Returns the start of each row of a unit, which is known before the unit is computed; the
    /// index comes first.
    fn row_prefixes(&self, sweep: &Sweep, unit: u64) -> Vec<String>;
    /// Computes a unit; a long computation may return `None` after `goes_on` has returned `false`.
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
    /// Returns the remainder of each row of a unit, with all significant digits.
    fn row_suffixes(&self, unit: &Self::Unit) -> Vec<String>;
    /// Parses a unit from the remainders of its rows.
    ///
    /// # Errors
    /// Returns the index of the row, from 0, that [`Self::row_suffixes`] cannot have written, and
    /// the reason.
    fn parse_unit(&self, rest: &[&str]) -> Result<Self::Unit, (usize, String)>;
    /// Analyses the units, which are all or the first of them.
    ///
    /// # Errors
    /// Fails if the units cannot be analysed.
    fn outcome(
        &self,
        sweep: &Sweep,
        units: &BTreeMap<u64, Self::Unit>,
    ) -> Result<Outcome, Self::Error>;
    /// Returns name and content of further files beside the page.
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
    /// Returns the progress in words, as in `12 of 40 sessions`.
    fn progress_text(&self, sweep: &Sweep, done: u64) -> String {
        format!("{done} of {} units", self.units(sweep.draws))
    }
    /// Returns a text table of the units for a terminal with 80 columns, if the study has more than
    /// the tables of its outcome.
    fn table(&self, sweep: &Sweep, units: &BTreeMap<u64, Self::Unit>) -> Option<String> {
        let _ = (sweep, units);
        None
    }
    /// Returns the recorded trials that the page also shows.
    fn trials(&self) -> &[ConductedTrial] {
        &[]
    }
}
