//! A study as the runner runs it: units of work decided by a seed, kept as they come, and an
//! analysis of them.

use super::result::Outcome;
use super::sweep::{Drawing, Sweep};
use host_core::record::sha256;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::collections::BTreeMap;

/// What decides every unit of a study.
pub struct StudyIdentity<'a> {
    /// The name that a command has for it.
    pub name: &'a str,
    /// Arguments that decide the result, beside seed and draws: as they are typed, empty
    /// without any.
    pub arguments: String,
    /// File name and text of its declaration.
    pub declaration: (&'a str, &'a str),
    /// Of all draws.
    pub seed: u64,
    /// How many wearers, or replications of the whole study, are drawn.
    pub draws: u64,
}

/// A study of a paper, with its arguments: which units of work there are, what each becomes,
/// and what all of them come to.
pub trait Study: Sync {
    /// What a unit of work became. It is kept as JSON, with every digit that decides.
    type Unit: Serialize + DeserializeOwned + Clone + Send + Sync;

    /// What decides it.
    fn metadata(&self) -> StudyIdentity<'_>;
    /// SHA-256 of everything declared, by file: of the declaration alone, if nothing else is.
    fn hashes(&self) -> BTreeMap<String, String> {
        let (file, text) = self.metadata().declaration;
        [(file.to_owned(), sha256(text.as_bytes()))].into()
    }
    /// The program that computes its units: another one neither goes on with them nor merges
    /// them.
    fn version(&self) -> String {
        env!("CARGO_PKG_VERSION").to_owned()
    }
    /// Whether a unit is the same however many are drawn, so that a folder of fewer draws goes
    /// on to more.
    fn is_extensible(&self) -> bool {
        false
    }
    /// How many units of work there are: one for each draw, if nothing else is.
    fn units(&self) -> u64 {
        self.metadata().draws
    }
    /// What unit `index`, from 0, becomes; nothing once `goes_on` says no.
    ///
    /// # Errors
    /// The study ends, with everything before kept.
    fn compute(
        &self,
        index: u64,
        goes_on: &(dyn Fn() -> bool + Sync),
    ) -> anyhow::Result<Option<Self::Unit>>;
    /// What the units come to, be they all or the first ones; `cut_short` says which are
    /// missing.
    ///
    /// # Errors
    /// They cannot be analysed.
    fn outcome(&self, units: &[Self::Unit], cut_short: Option<String>) -> anyhow::Result<Outcome>;
    /// Files beside `result.json`, by name: name and content; of a study that draws persons
    /// `draws.csv` is one of them.
    ///
    /// # Errors
    /// As [`Self::outcome`].
    fn files(&self, units: &[Self::Unit]) -> anyhow::Result<Vec<(String, String)>>;
    /// Some units of work in words: `12 of 40 sessions`.
    fn progress_text(&self, done: u64) -> String;
}

/// A study as a sweep keeps it: a line of JSON for each unit.
pub struct Lines<'a, S>(pub &'a S);

impl<S: Study> Lines<'_, S> {
    /// Its units, which are the first ones.
    fn listed(units: &BTreeMap<u64, S::Unit>) -> Vec<S::Unit> {
        units.values().cloned().collect()
    }
}

/// By which a line that was changed by hand is known: the beginning of its SHA-256.
fn checksum(text: &str) -> String {
    sha256(text.as_bytes()).chars().take(16).collect()
}

/// A line of JSON, with every digit that decides.
pub(crate) fn line(value: &impl Serialize) -> String {
    // Structs of numbers, words and lists always have a text.
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
        // Structs of numbers, words and lists always have a text.
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
            _ => Err((0, "its sum is another: the line was changed".to_owned())),
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
