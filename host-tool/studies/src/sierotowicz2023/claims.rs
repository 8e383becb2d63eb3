//! Counts over wearers and over studies how often each claim holds.

use super::metrics::median;
use super::replication::{CONDITIONS, ParticipantResult, Replication, wearers};
use crate::laboratory::Share;
use host_core::statistics::{mann_whitney, wilcoxon};

/// Significance level of the paper.
const SIGNIFICANT: f64 = 0.05;

/// Returns the diagonals of the correlation matrices of all participants of a study in one
/// condition.
pub(super) fn diagonal(of: &Replication, name: &str) -> Vec<f64> {
    let each = of.people.iter().filter_map(|wearer| wearer.condition(name));
    each.flat_map(|condition| condition.measures.diagonal())
        .collect()
}

/// Returns the size of every error of all participants of a study in one condition, N.
pub(super) fn errors(of: &Replication, name: &str) -> Vec<f64> {
    let each = of.people.iter().filter_map(|wearer| wearer.condition(name));
    each.flat_map(|condition| condition.measures.errors_n.clone())
        .collect()
}

/// Returns the median error of one condition, N, or NaN if the condition is missing.
pub(super) fn median_of(person: &ParticipantResult, name: &str) -> f64 {
    person
        .condition(name)
        .map_or(f64::NAN, |condition| condition.measures.median_n())
}

fn count((id, claim): (&str, &str), paper: Option<bool>, cases: Vec<bool>) -> Share {
    let holds = cases.iter().filter(|case| **case).count() as u64;
    let of = cases.len() as u64;
    Share::from_counts(id.to_owned(), claim.to_owned(), paper, (holds, of))
}

/// Counts how often each claim holds: first those about wearers, then those about studies.
pub(super) fn shares(all: &[Replication]) -> Vec<Share> {
    let mut shares = wearer_claims(all);
    shares.extend(study_claims(all));
    shares
}

/// Counts for how many wearers, S2 and S3 of every study, each claim about wearers holds.
fn wearer_claims(all: &[Replication]) -> Vec<Share> {
    let lower = |less: &str, more: &str| -> Vec<bool> {
        wearers(all)
            .map(|wearer| median_of(wearer, less) < median_of(wearer, more))
            .collect()
    };
    let higher: Vec<bool> = wearers(all)
        .map(|wearer| {
            let sum = |name| {
                wearer.condition(name).map_or(f64::NAN, |condition| {
                    condition.measures.diagonal().iter().sum()
                })
            };
            sum("C3") > sum("C2")
        })
        .collect();
    let nearer = wearers(all)
        .map(|wearer| wearer.geometry()[1] < wearer.geometry()[0])
        .collect();
    let yes = Some(true);
    vec![
        count(
            ("c3-c2", "C3: lower median error than C2 (wearers)"),
            yes,
            lower("C3", "C2"),
        ),
        count(
            (
                "fresh-c2",
                "calibrated without fatigue: lower error than C2",
            ),
            None,
            lower("fresh", "C2"),
        ),
        count(
            (
                "rested-c2",
                "calibrated at rest: lower median error than C2",
            ),
            None,
            lower("rested", "C2"),
        ),
        count(
            (
                "rested-c3",
                "calibrated at rest: lower median error than C3",
            ),
            None,
            lower("rested", "C3"),
        ),
        count(
            ("c4-c2", "C4: lower median error than C2"),
            yes,
            lower("C4", "C2"),
        ),
        count(
            ("correlation", "C3: higher correlation than C2"),
            yes,
            higher,
        ),
        count(
            ("geometry", "calibrated geometry is nearer to the true one"),
            None,
            nearer,
        ),
        count(
            ("squares", "least squares: lower median error than C3"),
            None,
            lower("squares", "C3"),
        ),
        count(
            ("slow", "force circle: 20 Hz at most 10 % worse than 200 Hz"),
            None,
            wearers(all)
                .map(|wearers| wearers.walks[1].part <= 1.1 * wearers.walks[0].part)
                .collect(),
        ),
    ]
}

/// Counts in how many studies each claim about studies holds. Two of these claims are judged only
/// once, over all studies together.
fn study_claims(all: &[Replication]) -> Vec<Share> {
    let signed = |name: &str, other: &str| -> f64 {
        let of = |name| {
            all.iter()
                .flat_map(|replication| diagonal(replication, name))
                .sum::<f64>()
        };
        of(name) - of(other)
    };
    let significant = all.iter().map(|replication| {
        let (c2, c3) = (diagonal(replication, "C2"), diagonal(replication, "C3"));
        let rises = c3.iter().sum::<f64>() > c2.iter().sum::<f64>();
        rises && wilcoxon(&c2, &c3).is_ok_and(|wilcoxon| wilcoxon.p < SIGNIFICANT)
    });
    let smaller = all.iter().map(|replication| {
        let (c2, c3) = (errors(replication, "C2"), errors(replication, "C3"));
        let falls = median(&c3) < median(&c2);
        falls && mann_whitney(&c2, &c3).is_ok_and(|mann_whitney| mann_whitney.p < SIGNIFICANT)
    });
    let most = CONDITIONS
        .iter()
        .skip(1)
        .all(|condition| signed("C1", condition) > 0.0);
    let less = signed("C4", "C2") < 0.0;
    let yes = Some(true);
    vec![
        count(
            ("wilcoxon", "studies: C3 correlates more than C2, p < 0.05"),
            yes,
            significant.collect(),
        ),
        count(
            (
                "mann-whitney",
                "studies: C3 has less error than C2, p < 0.05",
            ),
            yes,
            smaller.collect(),
        ),
        count(
            ("c4-sign", "all studies: C4 correlates less than C2"),
            yes,
            vec![less],
        ),
        count(
            ("c1-sign", "all studies: C1 correlates most"),
            yes,
            vec![most],
        ),
    ]
}
