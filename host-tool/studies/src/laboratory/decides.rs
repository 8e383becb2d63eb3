//! Finds the parameters that decide whether a claim holds: compares the random values of the
//! wearers in whom it holds with those of the wearers in whom it does not.

use super::claims::{Case, Units, claim_verdicts};
use super::declaration::Claim;
use super::draw::Unit;
use super::experiment::Experiment;
use host_core::statistics::{holm, mann_whitney, median};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use toml::Value;

/// Smallest number of wearers that must be in each group, those in whom a claim holds and the
/// others, for a conclusion (rule of thumb; Peduzzi et al. 1996 ask for ten events per variable).
pub(super) const LEAST_WEARERS: usize = 10;
/// Significance level to which p is compared after Holm's correction.
pub(super) const LEVEL: f64 = 0.05;

/// Analysis of one claim: which random parameters decide whether it holds in a wearer.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct DecidingClaim {
    /// Identifier of the claim in the declaration.
    pub id: String,
    /// The claim as a sentence.
    pub claim: String,
    /// Number of wearers in whom the claim holds: those for whom it holds in at least half of their
    /// cases.
    pub holds: usize,
    /// Number of all other wearers.
    pub fails: usize,
    /// Whether `holds` and `fails` both reach [`LEAST_WEARERS`]; otherwise `fields` is empty.
    pub enough: bool,
    /// Comparison of each random field that varies between wearers, in the declaration's order.
    pub fields: Vec<Field>,
}

/// One random field, compared between the wearers in whom a claim holds and all others.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Field {
    /// Dotted path of the field in the session.
    pub field: String,
    /// Median of the field among the wearers in whom the claim holds.
    pub holds: f64,
    /// Median of the field among the other wearers.
    pub fails: f64,
    /// Probability of superiority, 0 to 1: that the value of a random wearer in whom the claim
    /// holds exceeds that of a random other wearer. ½ means no difference.
    pub superiority: f64,
    /// Two-sided p of the Mann–Whitney test.
    pub p: f64,
    /// `p` after Holm's correction for all fields of this claim.
    pub p_holm: f64,
    /// Whether `p_holm` is below 0.05.
    pub decides: bool,
    /// Share of wearers in whom the claim holds, 0 to 1, in each third of the wearers sorted by
    /// this field: smallest, middle, largest values. It shows effects that a superiority of ½
    /// hides.
    pub thirds: [f64; 3],
}

/// Compares the random fields for each claim, in the declaration's order. Each wearer counts once,
/// whatever the number of cases and grid points.
#[must_use]
pub(super) fn deciding_fields(
    experiment: &Experiment,
    (seed, draws): (u64, u64),
    units: &Units,
) -> Vec<DecidingClaim> {
    let declaration = &experiment.declaration;
    let known = claim_verdicts(experiment, units);
    let of_claim = |claim: &Claim| {
        let wearers = by_wearer(known.get(&*claim.id), draws);
        let units = wearers.keys().map(|key| experiment.unit(seed, draws, *key));
        let numbers: Vec<Vec<f64>> = units.map(|unit| numbers(&unit)).collect();
        let holds: Vec<bool> = wearers.into_values().collect();
        let fields = declaration.drawn.iter().enumerate().map(|(nth, drawn)| {
            let own = numbers.iter().filter_map(|values| values.get(nth).copied());
            (&*drawn.field, own.collect())
        });
        let count = |wanted: bool| holds.iter().filter(|is| **is == wanted).count();
        let enough = count(true).min(count(false)) >= LEAST_WEARERS;
        DecidingClaim {
            id: claim.id.clone(),
            claim: claim.says.clone(),
            holds: count(true),
            fails: count(false),
            enough,
            fields: match enough {
                true => compare_fields(&fields.collect::<Vec<_>>(), &holds),
                false => Vec::new(),
            },
        }
    };
    declaration.claims.iter().map(of_claim).collect()
}

/// Returns, by wearer, whether the claim holds in at least half of the wearer's cases. Wearers
/// without a case are left out.
fn by_wearer(cases: Option<&BTreeMap<Case, bool>>, draws: u64) -> BTreeMap<u64, bool> {
    let mut counts: BTreeMap<u64, (usize, usize)> = BTreeMap::new();
    for ((unit, _), is) in cases.into_iter().flatten() {
        let (holds, total) = counts.entry(unit % draws.max(1)).or_default();
        (*holds, *total) = (*holds + usize::from(*is), *total + 1);
    }
    let most = |(wearer, (holds, total))| (wearer, 2 * holds >= total);
    counts.into_iter().map(most).collect()
}

/// Returns the values of all fields of a unit as numbers, the random fields first, in the
/// declaration's order.
fn numbers(unit: &Unit) -> Vec<f64> {
    let number = |value: &Value| match value {
        Value::Integer(whole) => *whole as f64,
        other => other.as_float().unwrap_or_default(), // draws are numbers
    };
    unit.fields.iter().map(|(_, value)| number(value)).collect()
}

/// Compares each field between the wearers in whom the claim `holds` and the others. A field has
/// one value per wearer, in the order of `holds`. Fields that do not vary are left out.
pub(super) fn compare_fields(fields: &[(&str, Vec<f64>)], holds: &[bool]) -> Vec<Field> {
    let comparison = |(name, numbers): &(&str, Vec<f64>)| {
        let group = |wanted: bool| -> Vec<f64> {
            let own = numbers.iter().zip(holds).filter(|(_, is)| **is == wanted);
            own.map(|(number, _)| *number).collect()
        };
        let (with, without) = (group(true), group(false));
        let test = mann_whitney(&with, &without).ok()?;
        Some(Field {
            field: (*name).to_owned(),
            holds: median(&with)?,
            fails: median(&without)?,
            superiority: test.u / (with.len() * without.len()) as f64,
            p: test.p,
            p_holm: 1.0,
            decides: false,
            thirds: thirds(numbers, holds),
        })
    };
    let mut comparisons: Vec<Field> = fields.iter().filter_map(comparison).collect();
    let p: Vec<f64> = comparisons.iter().map(|field| field.p).collect();
    // If the correction fails, no field has a p either.
    for (field, p_holm) in comparisons.iter_mut().zip(holm(&p).unwrap_or_default()) {
        (field.p_holm, field.decides) = (p_holm, p_holm < LEVEL);
    }
    comparisons
}

/// Sorts the wearers by value and divides them into thirds; returns the share of wearers in whom
/// the claim holds, 0 to 1, in each third.
fn thirds(numbers: &[f64], holds: &[bool]) -> [f64; 3] {
    let mut pairs: Vec<(f64, bool)> = numbers.iter().copied().zip(holds.iter().copied()).collect();
    pairs.sort_by(|(a, _), (b, _)| a.total_cmp(b));
    let share = |third: usize| {
        let (from, to) = (third * pairs.len() / 3, (third + 1) * pairs.len() / 3);
        let own = pairs.get(from..to).unwrap_or_default();
        own.iter().filter(|(_, is)| *is).count() as f64 / own.len().max(1) as f64
    };
    [0, 1, 2].map(share)
}

#[cfg(test)]
mod tests {
    use super::{by_wearer, compare_fields};
    use std::collections::BTreeMap;

    /// Forty wearers and four fields: one field decides, one does not, one decides only by its
    /// middle range, and one does not vary.
    #[test]
    fn a_planted_field_is_found_and_no_other() {
        let wearers = || (0..40).map(f64::from);
        let decisive: Vec<f64> = wearers().collect();
        let idle: Vec<f64> = wearers().map(|n| (n * 7.0) % 40.0).collect();
        let holds: Vec<bool> = wearers().map(|n| n >= 25.0).collect();
        let constant = vec![3.0; 40];
        let fields = [
            ("idle", idle),
            ("decisive", decisive),
            ("constant", constant),
        ];
        let found = compare_fields(&fields, &holds);
        let names: Vec<&str> = found.iter().map(|field| &*field.field).collect();
        assert_eq!(names, ["idle", "decisive"]);
        let [idle, decisive] = &found[..] else {
            panic!("{found:?}")
        };
        assert!(decisive.decides && !idle.decides, "{found:?}");
        assert_eq!(decisive.superiority, 1.0);
        assert_eq!((decisive.holds, decisive.fails), (32.0, 12.0));
        assert_eq!(decisive.p_holm, 2.0 * decisive.p);
        assert_eq!(idle.p_holm, idle.p);
        assert_eq!(decisive.thirds[0], 0.0);
        assert_eq!(decisive.thirds[2], 1.0);
    }

    /// If the claim holds at both ends of a field's range and fails in the middle, superiority is
    /// ½, and only the thirds show the effect.
    #[test]
    fn thirds_show_what_superiority_hides() {
        let numbers: Vec<f64> = (0..60).map(f64::from).collect();
        let holds: Vec<bool> = (0..60).map(|n| (20..40).contains(&n)).collect();
        let found = compare_fields(&[("middle", numbers)], &holds);
        assert_eq!(found[0].superiority, 0.5);
        assert_eq!(found[0].thirds, [0.0, 1.0, 0.0]);
        assert!(!found[0].decides);
    }

    /// Two draws at two grid points and two speeds give four cases per wearer.
    #[test]
    fn a_wearer_counts_once_over_all_cases() {
        let speed = |name: &str| vec![("speed".to_owned(), name.to_owned())];
        let case = |unit, name, is| ((unit, speed(name)), is);
        let cases = BTreeMap::from([
            case(0, "slow", true),
            case(0, "fast", false),
            case(2, "slow", true),
            case(2, "fast", false),
            case(1, "slow", true),
            case(1, "fast", false),
            case(3, "slow", false),
            case(3, "fast", false),
        ]);
        let wanted = BTreeMap::from([(0, true), (1, false)]);
        assert_eq!(by_wearer(Some(&cases), 2), wanted);
        assert!(by_wearer(None, 2).is_empty());
    }
}
