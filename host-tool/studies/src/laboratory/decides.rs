//! What decides whether a claim holds: the drawn numbers of the wearers in whom it
//! does, held against those of the wearers in whom it does not.

use super::claims::{Case, Units, claim_verdicts};
use super::declaration::Claim;
use super::draw::Unit;
use super::experiment::Experiment;
use host_core::statistics::{holm, mann_whitney, median};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use toml::Value;

/// Least wearers in whom a claim holds, and in whom it does not, for anything to be
/// concluded of it (rule of thumb; Peduzzi et al. 1996 ask ten events for each
/// variable).
pub(super) const LEAST_WEARERS: usize = 10;
/// Of p, corrected.
pub(super) const LEVEL: f64 = 0.05;

/// What decides a claim among the wearers drawn.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct DecidingClaim {
    /// The claim's id.
    pub id: String,
    /// The claim for people.
    pub claim: String,
    /// Wearers in whom it holds: in at least half of their cases.
    pub holds: usize,
    /// Wearers in whom it does not.
    pub fails: usize,
    /// Whether both are [`LEAST_WEARERS`] or more; no field is compared otherwise.
    pub enough: bool,
    /// The drawn fields that differ between wearers, as declared.
    pub fields: Vec<Field>,
}

/// A drawn field compared between both groups.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Field {
    /// Its dotted path.
    pub field: String,
    /// Median where the claim holds.
    pub holds: f64,
    /// Median where it does not.
    pub fails: f64,
    /// Probability of superiority: that a wearer in whom the claim holds has more of
    /// it than one in whom it does not. 0 to 1; ½ is no difference.
    pub superiority: f64,
    /// Of Mann and Whitney's test, two-sided.
    pub p: f64,
    /// Corrected by Holm for all fields of this claim.
    pub p_holm: f64,
    /// Whether `p_holm` is below 0.05.
    pub decides: bool,
    /// Share of wearers in whom the claim holds among those with the least, a middling
    /// and the most of it, a third each: what a superiority of ½ can hide.
    pub thirds: [f64; 3],
}

/// For each claim in the declaration's order, the drawn fields of its wearers. A
/// wearer counts once, over all cases and all points of a grid.
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
            let own = numbers.iter().filter_map(|all| all.get(nth).copied());
            (&*drawn.field, own.collect())
        });
        let of = |wanted: bool| holds.iter().filter(|is| **is == wanted).count();
        let enough = of(true).min(of(false)) >= LEAST_WEARERS;
        DecidingClaim {
            id: claim.id.clone(),
            claim: claim.says.clone(),
            holds: of(true),
            fails: of(false),
            enough,
            fields: match enough {
                true => compare_fields(&fields.collect::<Vec<_>>(), &holds),
                false => Vec::new(),
            },
        }
    };
    declaration.claims.iter().map(of_claim).collect()
}

/// Whether a claim holds in each wearer that has a case: in at least half of them.
fn by_wearer(cases: Option<&BTreeMap<Case, bool>>, draws: u64) -> BTreeMap<u64, bool> {
    let mut counts: BTreeMap<u64, (usize, usize)> = BTreeMap::new();
    for ((unit, _), is) in cases.into_iter().flatten() {
        let (holds, of) = counts.entry(unit % draws.max(1)).or_default();
        (*holds, *of) = (*holds + usize::from(*is), *of + 1);
    }
    let most = |(wearer, (holds, of))| (wearer, 2 * holds >= of);
    counts.into_iter().map(most).collect()
}

/// What was drawn of a unit, in the declaration's order.
fn numbers(unit: &Unit) -> Vec<f64> {
    let number = |value: &Value| match value {
        Value::Integer(whole) => *whole as f64,
        other => other.as_float().unwrap_or_default(), // draws are numbers
    };
    unit.fields.iter().map(|(_, value)| number(value)).collect()
}

/// Each field's numbers, one of each wearer, between those in whom the claim `holds`
/// and the others. A field that does not vary is left out.
pub(super) fn compare_fields(fields: &[(&str, Vec<f64>)], holds: &[bool]) -> Vec<Field> {
    let one = |(name, numbers): &(&str, Vec<f64>)| {
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
    let mut all: Vec<Field> = fields.iter().filter_map(one).collect();
    let p: Vec<f64> = all.iter().map(|field| field.p).collect();
    // Without a p there is no field either.
    for (field, p_holm) in all.iter_mut().zip(holm(&p).unwrap_or_default()) {
        (field.p_holm, field.decides) = (p_holm, p_holm < LEVEL);
    }
    all
}

/// The share that `holds` in each third of the wearers by their number.
fn thirds(numbers: &[f64], holds: &[bool]) -> [f64; 3] {
    let mut all: Vec<(f64, bool)> = numbers.iter().copied().zip(holds.iter().copied()).collect();
    all.sort_by(|(a, _), (b, _)| a.total_cmp(b));
    let share = |third: usize| {
        let (from, to) = (third * all.len() / 3, (third + 1) * all.len() / 3);
        let own = all.get(from..to).unwrap_or_default();
        own.iter().filter(|(_, is)| *is).count() as f64 / own.len().max(1) as f64
    };
    [0, 1, 2].map(share)
}

#[cfg(test)]
mod tests {
    use super::{by_wearer, compare_fields};
    use std::collections::BTreeMap;

    /// Forty wearers: one field decides, one does not, one does in the middle only,
    /// one does not vary.
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

    /// Where the ends are alike and the middle is not, superiority is a half: the
    /// thirds tell.
    #[test]
    fn thirds_show_what_superiority_hides() {
        let numbers: Vec<f64> = (0..60).map(f64::from).collect();
        let holds: Vec<bool> = (0..60).map(|n| (20..40).contains(&n)).collect();
        let found = compare_fields(&[("middle", numbers)], &holds);
        assert_eq!(found[0].superiority, 0.5);
        assert_eq!(found[0].thirds, [0.0, 1.0, 0.0]);
        assert!(!found[0].decides);
    }

    /// Two draws at two points of a grid, two speeds: four cases of each wearer.
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
