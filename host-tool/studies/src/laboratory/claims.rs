//! Counts in how many cases a preregistered claim holds.

use super::declaration::{Claim, ClaimKind, Declaration, LevelComparison};
use super::draw::{point_in_words, points};
use super::experiment::{Experiment, TrialMeasures};
use host_core::statistics;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};

/// A case in which a claim is judged: index of a unit (one wearer at one grid point), and levels of
/// the factors that the claim does not compare.
pub type Case = (u64, OtherFactors);

/// Each factor that a claim does not compare, by name, with its level.
pub type OtherFactors = Vec<(String, String)>;

/// Result of a claim: in how many cases it holds, with a confidence interval of the share.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Share {
    /// Identifier of the claim in the declaration.
    pub id: String,
    /// Grid point of these cases, in words; empty without a grid.
    pub at: String,
    /// The claim as a sentence.
    pub claim: String,
    /// What the paper says: `true` if the claim holds, `false` if it does not; `None` where the
    /// paper is silent.
    pub paper: Option<bool>,
    /// Number of cases in which the claim holds.
    pub holds: u64,
    /// Number of cases in which the claim could be judged.
    pub of: u64,
    /// Lower end of the 95 % confidence interval of the share, 0 to 1. `None` without any case, or
    /// if wearers were not generated at random.
    pub low: Option<f64>,
    /// Upper end of the 95 % confidence interval of the share, 0 to 1; `None` like `low`.
    pub high: Option<f64>,
}

/// Whether the share of cases agrees with what the paper says.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Verdict {
    /// The whole interval lies on the paper's side of one half.
    Like,
    /// The whole interval lies on the other side of one half than the paper.
    Unlike,
    /// The interval contains one half.
    Undecided,
}

/// Whether the share of cases reaches a required minimum.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Reach {
    /// The whole interval is at or above the minimum.
    Met,
    /// The whole interval is below the minimum.
    Missed,
    /// The minimum lies within the interval, so that the share may be on either side.
    Undecided,
}

impl Share {
    /// Creates the result of claim `id`, which holds in `holds` of `of` independent cases.
    #[must_use]
    pub fn from_counts(
        id: String,
        claim: String,
        paper: Option<bool>,
        (holds, of): (u64, u64),
    ) -> Self {
        let interval = statistics::wilson_share(holds as f64, of, LEVEL).ok();
        Self {
            id,
            at: String::new(),
            claim,
            paper,
            holds,
            of,
            low: interval.map(|share| share.low),
            high: interval.map(|share| share.high),
        }
    }

    /// Returns whether the share agrees with the paper. Returns `None` where the paper is silent,
    /// where no case could be judged, or where only one case is independent.
    #[must_use]
    pub fn verdict(&self) -> Option<Verdict> {
        let paper = self.paper.filter(|_| !self.is_single())?;
        let reaches = self.reaches(0.5)?;
        Some(match (reaches, paper) {
            (Reach::Undecided, _) => Verdict::Undecided,
            (Reach::Met, true) | (Reach::Missed, false) => Verdict::Like,
            (Reach::Met, false) | (Reach::Missed, true) => Verdict::Unlike,
        })
    }

    /// Returns whether the share of cases in which the claim holds is at least `least`, 0 to 1,
    /// judged by its confidence interval; `None` without an interval.
    #[must_use]
    pub fn reaches(&self, least: f64) -> Option<Reach> {
        let (low, high) = self.low.zip(self.high).filter(|_| self.of > 0)?;
        Some(match () {
            () if low >= least => Reach::Met,
            () if high < least => Reach::Missed,
            () => Reach::Undecided,
        })
    }

    /// Returns whether the share rests on a single independent case: only one case was judged, or
    /// all belong to one wearer.
    #[must_use]
    pub fn is_single(&self) -> bool {
        let has_single_interval = || {
            let part = self.holds as f64 / self.of as f64;
            let interval = statistics::wilson_share(part, 1, LEVEL).ok()?;
            let (low, high) = self.low.zip(self.high)?;
            Some((low - interval.low).abs() < 1e-9 && (high - interval.high).abs() < 1e-9)
        };
        self.of == 1 || (self.of > 0 && has_single_interval() == Some(true))
    }

    /// Returns the share in percent as text, for example "7.5 %", or "no case".
    #[must_use]
    pub fn percent(&self) -> String {
        match self.of {
            0 => "no case".to_owned(),
            of => format!("{:.1} %", 100.0 * self.holds as f64 / of as f64),
        }
    }
}

/// Values of all measures in each condition, by index of the unit (one wearer at one grid point).
pub type Units = BTreeMap<u64, Vec<TrialMeasures>>;

/// Confidence level of the shares' intervals.
const LEVEL: f64 = 0.95;

/// Returns the results of all claims in the declaration's order; with a grid, once for each grid
/// point. Each point has `draws` units.
#[must_use]
pub fn shares(experiment: &Experiment, draws: u64, units: &Units) -> Vec<Share> {
    let declaration = &experiment.declaration;
    let known = claim_verdicts(experiment, units);
    let at_point = |point: u64| {
        let own = point * draws..(point + 1) * draws;
        let place = point_in_words(declaration, point);
        let known = &known;
        declaration.claims.iter().map(move |claim| {
            let cases = known.get(&*claim.id).into_iter().flatten();
            let cases = cases.filter(|((unit, _), _)| own.contains(unit));
            share(claim, &place, cases)
        })
    };
    (0..points(declaration)).flat_map(at_point).collect()
}

/// Returns for each claim, by identifier, whether it holds in each case in which it can be judged.
pub(super) fn claim_verdicts<'e>(
    experiment: &'e Experiment,
    units: &Units,
) -> BTreeMap<&'e str, BTreeMap<Case, bool>> {
    let mut known = BTreeMap::new();
    for claim in &experiment.declaration.claims {
        let cases = match &claim.what {
            ClaimKind::Compared(compared) => cases(experiment, compared, units),
            ClaimKind::Combined { all, none } => combine_claims(&known, all, none),
        };
        known.insert(&*claim.id, cases);
    }
    known
}

/// Counts the cases of a claim at one grid point. The confidence interval counts wearers, because
/// several cases of a wearer are not independent.
fn share<'a>(
    claim: &Claim,
    place: &str,
    cases: impl Iterator<Item = (&'a Case, &'a bool)>,
) -> Share {
    let (mut holds, mut total, mut wearers) = (0, 0, BTreeSet::new());
    for ((unit, _), is) in cases {
        (holds, total) = (holds + u64::from(*is), total + 1);
        wearers.insert(*unit);
    }
    let wearers = wearers.len() as u64;
    let successes = holds as f64 * wearers as f64 / (total as f64).max(1.0);
    let interval = statistics::wilson_share(successes, wearers, LEVEL).ok();
    Share {
        id: claim.id.clone(),
        at: place.trim_end_matches("; ").to_owned(),
        claim: claim.says.clone(),
        paper: claim.paper,
        holds,
        of: total,
        low: interval.map(|share| share.low),
        high: interval.map(|share| share.high),
    }
}

/// Returns for each case whether the comparison `c` holds. A case is a unit in a combination of the
/// other factors in which both compared levels have the measure.
fn cases(experiment: &Experiment, c: &LevelComparison, units: &Units) -> BTreeMap<Case, bool> {
    let declaration = &experiment.declaration;
    let Some(measure) = declaration.measures.iter().position(|m| *m == c.measure) else {
        return BTreeMap::new();
    };
    let pairs = pairs(experiment, c);
    let in_unit = |(&index, measured): (&u64, &Vec<TrialMeasures>)| {
        let number = |condition: usize| *measured.get(condition)?.get(measure)?;
        let held = pairs.iter().filter_map(|(others, this, than)| {
            let holds = c.is.holds(number(*this)?, number(*than)?, c.by);
            Some(((index, others.clone()), holds))
        });
        held.collect::<Vec<_>>()
    };
    units.iter().flat_map(in_unit).collect()
}

/// Returns all pairs of conditions that differ only in the compared factor. Each contains the
/// levels of the other factors, the index of the condition that the claim is about, and the index
/// of the condition with which it is compared.
fn pairs(experiment: &Experiment, c: &LevelComparison) -> Vec<(OtherFactors, usize, usize)> {
    let Declaration { factors, .. } = &experiment.declaration;
    let others = |levels: &[String]| -> OtherFactors {
        let named = factors.iter().zip(levels);
        let rest = named.filter(|(factor, _)| factor.name != c.factor);
        rest.map(|(factor, level)| (factor.name.clone(), level.clone()))
            .collect()
    };
    let level = |levels: &[String]| {
        let at = factors.iter().position(|factor| factor.name == c.factor);
        at.and_then(|at| levels.get(at).cloned())
    };
    let wanted = |others: &[(String, String)]| {
        let is = |(factor, name): (&String, &String)| {
            others.iter().any(|(f, l)| f == factor && l == name)
        };
        c.only.iter().all(is)
    };
    let conditions = || experiment.conditions.iter().enumerate();
    let about =
        conditions().filter(|(_, condition)| level(&condition.levels).as_ref() == Some(&c.this));
    about
        .filter_map(|(this, item)| {
            let rest = others(&item.levels);
            let fits = |(_, other): &(usize, &super::condition::Condition)| {
                level(&other.levels).as_ref() == Some(&c.than) && others(&other.levels) == rest
            };
            let (than, _) = conditions().find(fits)?;
            wanted(&rest).then_some((rest, this, than))
        })
        .collect()
}

/// Returns for each case whether all claims in `required` hold and no claim in `none` does. Cases in
/// which one of these claims was not judged are left out.
fn combine_claims(
    known: &BTreeMap<&str, BTreeMap<Case, bool>>,
    required: &[String],
    none: &[String],
) -> BTreeMap<Case, bool> {
    let own = |id: &String| known.get(&**id);
    let first = required.iter().chain(none).find_map(own);
    let holds = |case: &Case, ids: &[String], wanted: bool| {
        let verdicts = ids
            .iter()
            .map(|id| own(id)?.get(case).map(|holds| *holds == wanted));
        verdicts
            .collect::<Option<Vec<bool>>>()
            .map(|flags| flags.iter().all(|is| *is))
    };
    let cases = first.into_iter().flat_map(BTreeMap::keys);
    cases
        .filter_map(|case| {
            let (has_required, none) = (holds(case, required, true)?, holds(case, none, false)?);
            Some((case.clone(), has_required && none))
        })
        .collect()
}
