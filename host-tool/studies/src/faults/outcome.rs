//! What the cases of a class come to: its numbers, and the same of each kind in it.

use super::case::{Case, CaseResult};
use super::declaration::Class;
use super::simulated::TWO_WINDOWS_US;
use host_core::statistics::{median, share_upper_bound};
use std::collections::BTreeMap;

/// Of the upper bounds.
const LEVEL: f64 = 0.95;
/// The most that a pulse may leave which a fault cut off, µC.
pub(super) const MOST_TRUNCATED_UC: f64 = 65.0;

/// The numbers of a class, or of one kind in it.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// Of which class.
    pub class: Class,
    /// Of which kind, if not of all.
    pub kind: Option<String>,
    /// Cases played.
    pub drawn: u64,
    /// Of which something came that somebody could see ([`CaseResult::changed`]).
    pub changed: u64,
    /// Of which it is known that nothing came.
    pub harmless: u64,
    /// Which the device must find ([`CaseResult::must_find`]).
    pub to_find: u64,
    /// Of those, in which it did.
    pub found: u64,
    /// Of those, with the outputs isolated within two windows.
    pub soon: u64,
    /// Median time from fault to isolated outputs, of those, µs.
    pub median_us: Option<f64>,
    /// The longest, µs.
    pub latest_us: Option<u64>,
    /// The longest from what the device calls the moment of its fault, µs.
    pub slowest_us: Option<u64>,
    /// Severe, the stages as they are built.
    pub severe: u64,
    /// Severe without what protects.
    pub bare: u64,
    /// Pulses that were cut off or held, and are excused.
    pub truncated: u64,
    /// The charge of the worst of them, µC.
    pub truncated_uc: Option<f64>,
    /// For how long a flip of the tape was shown at most, µs.
    pub shown_us: Option<u64>,
    /// In which the simulator could not go on.
    pub stopped: u64,
    /// Why, and how often.
    pub reasons: BTreeMap<String, u64>,
    /// How often a case ended for which reason.
    pub ended: BTreeMap<&'static str, u64>,
    /// Cases to look at: severe, or not as they must be; of a class alone.
    pub listed: Vec<Case>,
    /// The same of each kind, by name; of a class that has some.
    pub kinds: Vec<Outcome>,
}

impl Outcome {
    /// Of these cases.
    #[must_use]
    pub fn from_cases(class: Class, cases: &[Case]) -> Self {
        let all: Vec<&Case> = cases.iter().collect();
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
            ..Self::count_cases(class, None, &all)
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

    /// In which it must have found something and did not.
    #[must_use]
    pub const fn missed(&self) -> u64 {
        self.to_find - self.found
    }

    /// The largest share of severe cases that these leave likely, at 95 %.
    #[must_use]
    pub fn severe_bound(&self) -> Option<f64> {
        let played = self.drawn - self.stopped;
        share_upper_bound(self.severe.min(played), played, LEVEL).ok()
    }

    /// How it is called in a table.
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

/// Why the simulator stopped, without where.
fn reason(why: &str) -> String {
    let what = why.rsplit_once("stopped: ").map_or(why, |(_, what)| what);
    let what = what.strip_prefix("not modelled: ").unwrap_or(what);
    what.split(" is not modelled")
        .next()
        .unwrap_or(what)
        .to_owned()
}
