//! Computes the rows of `result.json`: numbers over all wearers.

use super::claims::PUBLISHED_S;
use super::declared::{Condition, Drive};
use super::study::{ConditionResult, DrawResult, Study};
use crate::laboratory::Row;

/// Power of the last knee extensions relative to the first, published by Laubacher 2017: with a
/// single electrode, then with distributed electrodes.
pub(super) const PUBLISHED_LEFT: [f64; 2] = [7.4 / 14.6, 9.9 / 14.9];

impl Study {
    /// Returns the rows of `result.json`: those of each condition, then the endurance relative to
    /// one electrode.
    pub(super) fn rows(&self, results: &[DrawResult]) -> Vec<Row> {
        let conditions = self.declared.conditions.iter();
        let mut rows: Vec<Row> = conditions
            .flat_map(|condition| condition_rows(condition, results))
            .collect();
        let [four, one] = PUBLISHED_S;
        for (id, paper) in [
            ("two", None),
            ("four", Some(four / one)),
            ("four-together", None),
            ("four-half", None),
            ("four-fast", Some(four / one)),
        ] {
            let ratios = results.iter().filter_map(|result| ratio(result, id));
            let says = format!("endurance ratio to one, {id}");
            rows.push(Row::from_numbers(
                format!("ratio/{id}"),
                says,
                "",
                paper,
                ratios,
            ));
        }
        rows
    }
}

/// Returns the endurance in condition `id` divided by that with one electrode; it is a lower bound
/// if the force was held to the end. Returns `None` if the force was not reached with one
/// electrode.
pub(super) fn ratio(found: &DrawResult, id: &str) -> Option<f64> {
    let own = found.condition_result(id)?.endurance.seconds;
    let single_s = found.condition_result("one")?.endurance.seconds;
    (single_s > 0.0).then(|| own / single_s)
}

fn condition_rows(condition: &Condition, results: &[DrawResult]) -> Vec<Row> {
    let own: Vec<&ConditionResult> = results
        .iter()
        .filter_map(|result| result.condition_result(&condition.id))
        .collect();
    let row = |what: &str,
               says: &str,
               unit: &str,
               paper,
               quantity: &dyn Fn(&ConditionResult) -> Option<f64>| {
        let numbers = own.iter().filter_map(|measurement| quantity(measurement));
        let id = format!("{}/{what}", condition.id);
        Row::from_numbers(
            id,
            format!("{says}, {}", condition.id),
            unit,
            paper,
            numbers,
        )
    };
    let percent = |value: f64| 1e2 * value;
    let ripple = row("ripple", "ripple", "%", None, &|measurement| {
        measurement.ripple.map(percent)
    });
    let id = &*condition.id;
    if condition.drive == Drive::Open {
        let [single, distributed] = PUBLISHED_LEFT;
        let paper = match id {
            "one-open" => Some(percent(single)),
            "four-open" => Some(percent(distributed)),
            _ => None,
        };
        let first = row(
            "first",
            "initial relative force",
            "%",
            None,
            &|measurement| measurement.first.map(percent),
        );
        let left = row(
            "left",
            "force left after 6 min",
            "%",
            paper,
            &|measurement| measurement.left.map(percent),
        );
        return vec![first, left, ripple];
    }
    let [four, one] = PUBLISHED_S;
    let paper = match id {
        "one" => Some(one),
        "four" | "four-fast" => Some(four),
        _ => None,
    };
    let endurance = row("endurance", "endurance", "s", paper, &|measurement| {
        Some(measurement.endurance.seconds)
    });
    let mut rows = vec![endurance, ripple];
    if condition.drive.model().is_some() {
        let says = "error in first minute";
        rows.push(row("off", says, "%", None, &|measurement| {
            measurement.distance.map(percent)
        }));
    }
    rows
}
