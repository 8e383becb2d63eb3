//! Summarises the cases of a fault class, in total and for each kind.

use super::case::{Case, CaseResult};
use super::declaration::Class;
use super::simulated::TWO_WINDOWS_US;
use host_core::statistics::{median, share_upper_bound};
use std::collections::BTreeMap;

/// Confidence level of the upper bound of the share of severe cases.
const LEVEL: f64 = 0.95;
/// Largest net charge that the judge excuses in a pulse that a fault truncated, µC.
pub(super) const MOST_TRUNCATED_UC: f64 = 65.0;

/// Counts and times over the cases of a fault class, or of one kind of fault in it.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// Fault class of the cases.
    pub class: Class,
    /// Kind of fault; `None` for the whole class.
    pub kind: Option<String>,
    /// Number of all cases, whatever their result.
    pub drawn: u64,
    /// Number of cases with a visible effect ([`CaseResult::has_effect`]).
    pub changed: u64,
    /// Number of cases that certainly had no effect.
    pub harmless: u64,
    /// Number of cases that the device must detect ([`CaseResult::must_find`]).
    pub to_find: u64,
    /// Number of `to_find` cases that the device detected.
    pub found: u64,
    /// Number of `found` cases whose outputs were isolated within two refill windows (500 µs) of
    /// the fault.
    pub soon: u64,
    /// Median time from the fault to isolated outputs, µs, over the `found` cases.
    pub median_us: Option<f64>,
    /// Longest time from the fault to isolated outputs, µs, over the `found` cases.
    pub latest_us: Option<u64>,
    /// Longest time from the device's own time stamp of the fault to isolated outputs, µs, over the
    /// `found` cases.
    pub slowest_us: Option<u64>,
    /// Number of severe cases with the output stages of docs/reference/hardware.md.
    pub severe: u64,
    /// Number of cases that would be severe without protective circuits.
    pub bare: u64,
    /// Number of pulses that a fault truncated or prolonged and that the judge excuses.
    pub truncated: u64,
    /// Largest magnitude of the net charge of a `truncated` pulse, µC.
    pub truncated_uc: Option<f64>,
    /// Longest time for which a bit flip of the pulse tape changed an output line, µs.
    pub shown_us: Option<u64>,
    /// Number of cases in which the simulator could not continue, because it does not model what
    /// the chip did.
    pub stopped: u64,
    /// Number of `stopped` cases for each reason.
    pub reasons: BTreeMap<String, u64>,
    /// Number of cases by how their run ended, under the names of `CaseEnd`.
    pub ended: BTreeMap<&'static str, u64>,
    /// Cases that a person should review ([`CaseResult::needs_review`]). Empty in the summary of a
    /// single kind.
    pub listed: Vec<Case>,
    /// Summary of each kind of fault, sorted by name; empty for a class without kinds.
    pub kinds: Vec<Outcome>,
}

impl Outcome {
    /// Summarises the cases of a class.
    #[must_use]
    pub fn from_cases(class: Class, cases: &[Case]) -> Self {
        let counted_cases: Vec<&Case> = cases.iter().collect();
        let mut kinds = BTreeMap::<&str, Vec<&Case>>::new();
        for case in cases {
            kinds
                .entry(case.kind().unwrap_or(""))
                .or_default()
                .push(case);
        }
        if kinds.keys().all(|kind| kind.is_empty()) {
            kinds.clear();
        }
        let kinds = kinds.into_iter();
        let kinds =
            kinds.map(|(kind, cases)| Self::count_cases(class, Some(kind.to_owned()), &cases));
        let listed = cases.iter().filter(|case| case.fate.needs_review());
        Self {
            listed: listed.cloned().collect(),
            kinds: kinds.collect(),
            ..Self::count_cases(class, None, &counted_cases)
        }
    }

    fn count_cases(class: Class, kind: Option<String>, cases: &[&Case]) -> Self {
        let fates = || cases.iter().map(|case| &case.fate);
        let count =
            |is: &dyn Fn(&CaseResult) -> bool| fates().filter(|fate| is(fate)).count() as u64;
        let found = || fates().filter(|fate| fate.must_find && fate.found);
        let mut isolated: Vec<u64> = found().filter_map(|fate| fate.isolated_us).collect();
        isolated.sort_unstable();
        let as_numbers: Vec<f64> = isolated.iter().map(|us| *us as f64).collect();
        let slow = found().filter_map(|fate| Some(fate.isolated_us?.saturating_sub(fate.told_us?)));
        let truncated = || fates().flat_map(|fate| &fate.truncated_uc);
        let (mut reasons, mut ended) = (BTreeMap::new(), BTreeMap::new());
        for fate in fates() {
            *ended.entry(fate.ended.name()).or_default() += 1;
            if let Some(why) = &fate.stopped {
                *reasons.entry(reason(why)).or_default() += 1;
            }
        }
        Self {
            class,
            kind,
            drawn: cases.len() as u64,
            changed: count(&CaseResult::has_effect),
            harmless: count(&CaseResult::is_harmless),
            to_find: count(&|fate| fate.must_find),
            found: found().count() as u64,
            soon: found().filter(|fate| is_soon(fate)).count() as u64,
            median_us: median(as_numbers),
            latest_us: isolated.last().copied(),
            slowest_us: slow.max(),
            severe: count(&|fate| !fate.severe.is_empty()),
            bare: count(&|fate| !fate.bare.is_empty()),
            truncated: truncated().count() as u64,
            truncated_uc: truncated().map(|uc| uc.abs()).max_by(f64::total_cmp),
            shown_us: fates().filter_map(|fate| fate.shown_us).max(),
            stopped: count(&|fate| fate.stopped.is_some()),
            reasons,
            ended,
            listed: Vec::new(),
            kinds: Vec::new(),
        }
    }

    /// Returns the number of cases whose fault the device must detect and did not.
    #[must_use]
    pub const fn missed(&self) -> u64 {
        self.to_find - self.found
    }

    /// Returns the upper 95 % confidence bound of the share of severe cases, 0 to 1; `None` if no
    /// case was played.
    #[must_use]
    pub fn severe_bound(&self) -> Option<f64> {
        let played = self.drawn - self.stopped;
        share_upper_bound(self.severe.min(played), played, LEVEL).ok()
    }

    /// Returns the text for the first column of the table: the class, or the indented kind.
    #[must_use]
    pub fn name(&self) -> String {
        match &self.kind {
            None => self.class.to_string(),
            Some(kind) if kind.is_empty() => "  others".to_owned(),
            Some(kind) => format!("  {kind}"),
        }
    }
}

fn is_soon(fate: &CaseResult) -> bool {
    fate.isolated_us.is_some_and(|us| us <= TWO_WINDOWS_US)
}

/// Returns the reason why the simulator stopped, without the place in the program where it did.
fn reason(why: &str) -> String {
    let what = why.rsplit_once("stopped: ").map_or(why, |(_, what)| what);
    let detail = what.strip_prefix("not modelled: ").unwrap_or(what);
    detail
        .split(" is not modelled")
        .next()
        .unwrap_or(detail)
        .to_owned()
}
