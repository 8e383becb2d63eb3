//! What a sweep draws, whoever declares it.

use super::Sweep;
use crate::laboratory::conduct::ConductedTrial;
use crate::laboratory::error::LaboratoryError;
use crate::laboratory::result::Outcome;
use std::collections::BTreeMap;

/// What a sweep draws: units, each of which is some rows of `draws.csv`.
pub trait Drawing: Sync {
    /// What a unit came to.
    type Unit: Send;
    /// Why a unit comes to nothing at all, which ends the sweep.
    type Error: From<LaboratoryError> + Send;

    /// What the sweep is called.
    fn name(&self) -> &str;
    /// Which part of what is declared it is, where it is not all of it.
    fn subset(&self) -> Option<String> {
        None
    }
    /// The program that computes its units, as `sweep.json` has it: another one neither goes on
    /// with them nor merges them.
    fn version(&self) -> String {
        env!("CARGO_PKG_VERSION").to_owned()
    }
    /// Whether a unit is the same however many are drawn, so that a folder of fewer draws goes
    /// on to more.
    fn is_extensible(&self) -> bool {
        false
    }
    /// The file that keeps what was computed.
    fn file(&self) -> &'static str {
        "draws.csv"
    }
    /// SHA-256 of everything declared, by file.
    fn hashes(&self) -> BTreeMap<String, String>;
    /// `declaration.toml`.
    fn declaration(&self) -> &str;
    /// Names of the columns; none: the file has no header.
    fn columns(&self) -> Vec<String>;
    /// Units in all, of so many draws.
    fn units(&self, draws: u64) -> u64;
    /// Rows of every unit.
    fn rows_per_unit(&self) -> usize;
    /// The index that the first row of a unit begins with.
    fn index_of(&self, row: &str) -> Option<u64> {
        row.split(',').next()?.parse().ok()
    }
    /// How each row of a unit begins: everything that is known before it is computed, its
    /// index first.
    fn row_prefixes(&self, sweep: &Sweep, unit: u64) -> Vec<String>;
    /// What a unit comes to; nothing once `goes_on` says no, if the unit is long enough to
    /// ask.
    ///
    /// # Errors
    /// The sweep ends, with everything before kept.
    fn compute(
        &self,
        sweep: &Sweep,
        unit: u64,
        goes_on: &(dyn Fn() -> bool + Sync),
    ) -> Result<Option<Self::Unit>, Self::Error>;
    /// The rest of each of its rows, with every digit that decides.
    fn row_suffixes(&self, unit: &Self::Unit) -> Vec<String>;
    /// What a unit came to of the rest of each of its rows.
    ///
    /// # Errors
    /// Which of them, from 0, says what, that [`Self::row_suffixes`] never says.
    fn parse_unit(&self, rest: &[&str]) -> Result<Self::Unit, (usize, String)>;
    /// What the units come to, be they all or the first ones.
    ///
    /// # Errors
    /// They cannot be analysed.
    fn outcome(
        &self,
        sweep: &Sweep,
        units: &BTreeMap<u64, Self::Unit>,
    ) -> Result<Outcome, Self::Error>;
    /// Files beside the page, by name: name and content.
    ///
    /// # Errors
    /// As [`Self::outcome`].
    fn files(
        &self,
        sweep: &Sweep,
        units: &BTreeMap<u64, Self::Unit>,
    ) -> Result<Vec<(String, String)>, Self::Error> {
        let _ = (sweep, units);
        Ok(Vec::new())
    }
    /// Some units of a sweep's in words: `12 of 40 sessions`.
    fn progress_text(&self, sweep: &Sweep, done: u64) -> String {
        format!("{done} of {} units", self.units(sweep.draws))
    }
    /// What a terminal shows of the units in 80 columns, where that is more than the outcome's
    /// own tables.
    fn table(&self, sweep: &Sweep, units: &BTreeMap<u64, Self::Unit>) -> Option<String> {
        let _ = (sweep, units);
        None
    }
    /// Trials that the page shows beside.
    fn trials(&self) -> &[ConductedTrial] {
        &[]
    }
}
