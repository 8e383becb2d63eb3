//! Judges the claims of experiment 2 (Hamana 2022, III-B) in a replication.

use super::claims::ALIKE;
use super::replication::{CONDUCTED, Replication, Test};

/// Numbers of the isolated patterns.
const ISOLATED: [usize; 4] = [7, 9, 11, 13];

/// Judges the claims of experiment 2 (Hamana 2022, III-B) with p below `significant`.
pub(super) fn torque_verdicts(
    replication: &Replication,
    significant: f64,
) -> [(&'static str, Option<bool>); 8] {
    let is_significant = |test: Test| Some(test?[1] < significant);
    let differ = |numbers: &[usize], expected: bool| {
        let tests = numbers
            .iter()
            .map(|&number| is_significant(replication.table_5[number]));
        let tests: Option<Vec<bool>> = tests.collect();
        Some(tests?.into_iter().all(|is| is == expected))
    };
    let pattern = |number: usize| replication.patterns[number];
    let two_more = replication.one_point.and_then(|[one, _]| {
        let two: Option<Vec<f64>> = CONDUCTED.into_iter().map(pattern).collect();
        Some(two?.into_iter().all(|two| two > one))
    });
    let pairs = [6, 8, 10, 12].map(|number| Some(pattern(number)? > pattern(number + 1)?));
    let conducted_more: Option<Vec<bool>> = pairs.into_iter().collect();
    let alike = replication.one_point.map(|[c, i]| ALIKE.contains(&(c / i)));
    [
        ("2-two-more", two_more),
        (
            "2-table-5-conducted",
            differ(&[0, 1, 2, 3, 4, 8, 10, 12], true),
        ),
        ("2-table-5-short", differ(&[5, 6], false)),
        ("2-table-5-isolated", differ(&ISOLATED, false)),
        (
            "2-phase",
            is_significant(replication.friedman).map(|is| !is),
        ),
        ("2-isolation", is_significant(replication.isolation)),
        (
            "2-conducted-more",
            conducted_more.map(|all| all.into_iter().all(|is| is)),
        ),
        ("2-one-alike", alike),
    ]
}

/// Returns whether all of these hold; `None` if one cannot be judged.
pub(super) fn jointly(verdicts: impl IntoIterator<Item = Option<bool>>) -> Option<bool> {
    let all: Option<Vec<bool>> = verdicts.into_iter().collect();
    all.map(|all| all.into_iter().all(|holds| holds))
}
