//! The tables of an experiment's page.

use crate::laboratory::result::Outcome;
use host_core::plot::canvas::escape;

/// A row for each claim, and for each point of a grid.
pub(super) fn shares_table(outcome: &Outcome) -> String {
    let is_grid = outcome.is_grid();
    let rows = outcome.shares.iter().map(|share| {
        let paper = match share.paper {
            Some(true) => "yes",
            Some(false) => "no",
            None => "—",
        };
        let interval = share
            .low
            .zip(share.high)
            .map_or_else(String::new, |(low, high)| {
                format!("{:.1} to {:.1} %", 100.0 * low, 100.0 * high)
            });
        let place = if is_grid {
            format!("<td>{}</td>", escape(&share.at))
        } else {
            String::new()
        };
        format!(
            "<tr><th scope=\"row\">{}</th>{place}<td>{paper}</td><td>{}</td>\
             <td>{interval}</td><td>{} of {}</td></tr>\n",
            escape(&share.claim),
            share.percent(),
            share.holds,
            share.of
        )
    });
    let place = if is_grid { &["At"][..] } else { &[] };
    let heads = [
        &["Claim"],
        place,
        &["Paper", "Holds in", "Interval", "Cases"],
    ]
    .concat();
    table(&heads, rows.collect())
}

/// Rows *paper | ours | interval*.
pub(super) fn rows_table(outcome: &Outcome) -> String {
    let printed = |value: Option<f64>| value.map_or_else(|| "—".to_owned(), digits);
    let rows = outcome.rows.iter().map(|row| {
        let range = row.low.zip(row.high);
        let range = range.map_or_else(
            || "—".to_owned(),
            |(low, high)| format!("{} to {}", digits(low), digits(high)),
        );
        format!(
            "<tr><th scope=\"row\">{}</th><td>{}</td><td>{}</td><td>{}</td><td>{range}</td>\
             <td>{}</td></tr>\n",
            escape(&row.quantity),
            escape(&row.unit),
            printed(row.paper),
            printed(row.ours),
            row.n
        )
    });
    let (range, count) = match (outcome.declared.draws, &outcome.declared.drawn) {
        (_, Some(_)) => ("5 to 95 %", "Drawn"),
        (0, None) => ("5 to 95 % of rounds", "Rounds"),
        _ => ("5 to 95 % of wearers", "Wearers"),
    };
    let heads = ["Quantity", "Unit", "Paper", "Ours", range, count];
    table(&heads, rows.collect())
}

pub(super) fn table(heads: &[&str], rows: String) -> String {
    let heads = heads
        .iter()
        .map(|head| format!("<th scope=\"col\">{head}</th>"))
        .collect::<String>();
    match rows.is_empty() {
        true => rows,
        false => {
            format!("<table><thead><tr>{heads}</tr></thead><tbody>\n{rows}</tbody></table>\n")
        }
    }
}

/// Three digits that count.
pub(super) fn digits(value: f64) -> String {
    let places = match value.abs() {
        small if small < 1.0 => 3,
        some if some < 10.0 => 2,
        many if many < 100.0 => 1,
        _ => 0,
    };
    format!("{value:.places$}")
}
