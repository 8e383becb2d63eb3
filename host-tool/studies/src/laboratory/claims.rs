//! In how many cases a declared claim holds.

use super::declaration::{Claim, ClaimKind, Declaration, LevelComparison};
use super::draw::{point_in_words, points};
use super::experiment::{Experiment, TrialMeasures};
use host_core::statistics;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};

/// A wearer in one combination of the factors that a claim does not compare: its
/// unit's index, and their levels.
pub type Case = (u64, OtherFactors);

/// Factors that a claim does not compare, and their levels.
pub type OtherFactors = Vec<(String, String)>;

/// In how many cases a claim holds.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Share {
    /// Its id.
    pub id: String,
    /// At which point of the grid; empty without one.
    pub at: String,
    /// For people.
    pub claim: String,
    /// What the paper says of it.
    pub paper: Option<bool>,
    /// Cases in which it holds.
    pub holds: u64,
    /// Cases in which it could be judged.
    pub of: u64,
    /// Lower end of the interval of the share, 0 to 1; nothing without a case, or
    /// where no wearers were drawn.
    pub low: Option<f64>,
    /// Upper end.
    pub high: Option<f64>,
}

/// A share held against what the paper says.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Verdict {
    /// Most cases are as the paper says.
    Like,
    /// Most are not.
    Unlike,
    /// Half of them lies in the interval.
    Undecided,
}

/// A share held against the least that was asked for.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Reach {
    /// All of its interval has that much.
    Met,
    /// None of it has.
    Missed,
    /// The least lies within it.
    Undecided,
}

impl Share {
    /// Of a claim called `id` that holds in so many of so many independent cases.
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

    /// Whether it is in most cases as the paper says; nothing where the paper says
    /// nothing, no case could be judged, or there is one independent case alone.
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

    /// Whether it holds in a part of the cases of `least` or more, by its interval; nothing
    /// where it has none.
    #[must_use]
    pub fn reaches(&self, least: f64) -> Option<Reach> {
        let (low, high) = self.low.zip(self.high).filter(|_| self.of > 0)?;
        Some(match () {
            () if low >= least => Reach::Met,
            () if high < least => Reach::Missed,
            () => Reach::Undecided,
        })
    }

    /// Whether only one case is independent: one was judged, or all are of one wearer.
    #[must_use]
    pub fn is_single(&self) -> bool {
        let one = || {
            let part = self.holds as f64 / self.of as f64;
            let one = statistics::wilson_share(part, 1, LEVEL).ok()?;
            let (low, high) = self.low.zip(self.high)?;
            Some((low - one.low).abs() < 1e-9 && (high - one.high).abs() < 1e-9)
        };
        self.of == 1 || (self.of > 0 && one() == Some(true))
    }

    /// "7.5 %".
    #[must_use]
    pub fn percent(&self) -> String {
        match self.of {
            0 => "no case".to_owned(),
            of => format!("{:.1} %", 100.0 * self.holds as f64 / of as f64),
        }
    }
}

/// What each unit did in each condition, in the order of the units.
pub type Units = BTreeMap<u64, Vec<TrialMeasures>>;

/// Of the intervals of shares.
const LEVEL: f64 = 0.95;

/// The shares of all claims in the declaration's order; with a grid, at each of its
/// points of `draws` units.
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

/// Whether each claim, by its id, holds in each case in which it can be judged.
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

/// The share of a claim at a place of the grid.
fn share<'a>(
    claim: &Claim,
    place: &str,
    cases: impl Iterator<Item = (&'a Case, &'a bool)>,
) -> Share {
    let (mut holds, mut of, mut wearers) = (0, 0, BTreeSet::new());
    for ((unit, _), is) in cases {
        (holds, of) = (holds + u64::from(*is), of + 1);
        wearers.insert(*unit);
    }
    let wearers = wearers.len() as u64;
    let successes = holds as f64 * wearers as f64 / (of as f64).max(1.0);
    let interval = statistics::wilson_share(successes, wearers, LEVEL).ok();
    Share {
        id: claim.id.clone(),
        at: place.trim_end_matches("; ").to_owned(),
        claim: claim.says.clone(),
        paper: claim.paper,
        holds,
        of,
        low: interval.map(|share| share.low),
        high: interval.map(|share| share.high),
    }
}

/// Where `compared` holds: every unit in every combination of the other factors
/// in which both levels have the measure.
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

/// Conditions that differ in the compared factor alone: the levels of the others,
/// the condition the claim is about, and the one it is held against.
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

/// Where all of these and none of those hold, of the cases that all have.
fn combine_claims(
    known: &BTreeMap<&str, BTreeMap<Case, bool>>,
    all: &[String],
    none: &[String],
) -> BTreeMap<Case, bool> {
    let own = |id: &String| known.get(&**id);
    let first = all.iter().chain(none).find_map(own);
    let holds = |case: &Case, ids: &[String], wanted: bool| {
        let each = ids
            .iter()
            .map(|id| own(id)?.get(case).map(|holds| *holds == wanted));
        each.collect::<Option<Vec<bool>>>()
            .map(|each| each.iter().all(|is| *is))
    };
    let cases = first.into_iter().flat_map(BTreeMap::keys);
    cases
        .filter_map(|case| {
            let (all, none) = (holds(case, all, true)?, holds(case, none, false)?);
            Some((case.clone(), all && none))
        })
        .collect()
}
