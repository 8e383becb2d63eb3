//! The tables of an experiment's page.

use crate::laboratory::claims::Share;
use crate::laboratory::numbers::{LARGE_T, digits, large_t};
use crate::laboratory::paper_claims::{ClaimStanding, paper_claims};
use crate::laboratory::result::Outcome;
use host_core::html;
use host_core::report::Html;

/// Tabulates the claims: a row for each claim of the paper, below it its parts, then our additional
/// claims. With a grid, each grid point is a part.
pub(super) fn shares_table(outcome: &Outcome) -> Html {
    let is_grid = outcome.is_grid();
    let (claims, beside) = paper_claims(outcome);
    let name = |says: &str| html!("<th scope=\"row\">{}</th>", says);
    let mut rows = Html::default();
    for claim in &claims {
        let standing = claim.standing().in_words();
        match claim.parts.as_slice() {
            [one] => rows += share_row(one, (&name(claim.says), is_grid), standing),
            parts => {
                let columns = if is_grid { "5" } else { "4" };
                rows += html!(
                    "<tr>{}<td colspan=\"{}\">{}</td><td>{}</td></tr>\n",
                    name(claim.says),
                    columns,
                    claim.counts_in_words() + ":",
                    standing
                );
                for part in parts {
                    let name = html!(
                        "<th scope=\"row\" style=\"font-weight:400\">· {}</th>",
                        part.claim
                    );
                    rows += share_row(part, (&name, is_grid), part_in_words(part));
                }
            }
        }
    }
    for share in &beside {
        rows += share_row(share, (&name(&share.claim), is_grid), "not in the paper");
    }
    let place = if is_grid { &["At"][..] } else { &[] };
    let heads = [
        &["Claim"],
        place,
        &["Paper", "Holds in", "95 % interval", "Cases", "Verdict"],
    ]
    .concat();
    let table = table(&heads, rows);
    match claims.is_empty() {
        true => table,
        false => html!("<p>{}</p>\n{}", RULE, table),
    }
}

/// Text that explains the verdicts below the table of claims.
const RULE: &str = "Each row is a claim of the paper, with its parts below it (·); a claim agrees \
                    only if all of its parts agree. Agrees: the whole 95 % interval of the share \
                    lies on the paper's side of one half. Disagrees: it lies on the other side. \
                    Undecided: it contains one half. A share of one independent case (n = 1) is \
                    not counted, and trials without randomly generated wearers get no verdict. \
                    Not in the paper: the paper does not claim this.";

/// Returns the verdict on one part of a claim, for its table cell.
fn part_in_words(share: &Share) -> &'static str {
    let standing = match share.verdict() {
        Some(verdict) => ClaimStanding::Judged(verdict),
        None if share.is_single() => ClaimStanding::Single,
        None => ClaimStanding::Unjudged,
    };
    standing.in_words()
}

/// Returns the table row of a claim's share: `name`, the numbers, and `verdict`.
fn share_row(share: &Share, (name, is_grid): (&Html, bool), verdict: &str) -> Html {
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
    let place = match is_grid {
        true => html!("<td>{}</td>", share.at),
        false => Html::default(),
    };
    html!(
        "<tr>{}{}<td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>\n",
        name,
        place,
        paper,
        share.percent(),
        interval,
        format!("{} of {}", share.holds, share.of),
        verdict
    )
}

/// Tabulates paper's value, our value and interval of each result. The column of the paper or of
/// the interval is left out if no row has one.
pub(super) fn rows_table(outcome: &Outcome) -> Html {
    let entries = &outcome.rows;
    let has_paper = entries.iter().any(|row| row.paper.is_some());
    let has_range = entries.iter().any(|row| row.low.is_some());
    let rows = entries.iter().map(|row| {
        let paper = has_paper.then(|| format_value(row.paper, &row.unit));
        let end =
            |value: f64| large_t(&row.quantity, value).map_or_else(|| digits(value), str::to_owned);
        let range = row.low.zip(row.high);
        let range = range.map_or_else(
            || "—".to_owned(),
            |(low, high)| format!("{} to {}", end(low), end(high)),
        );
        let unit = match &*row.unit {
            "" => "1",
            unit => unit,
        };
        let cells = [Some(unit.to_owned()), paper];
        let large = row.ours.and_then(|value| large_t(&row.quantity, value));
        let ours = large.map_or_else(|| format_value(row.ours, &row.unit), str::to_owned);
        let ours = [Some(ours), has_range.then_some(range)];
        let cells = cells.into_iter().chain(ours).flatten();
        let cells: Html = cells.map(|cell| html!("<td>{}</td>", cell)).collect();
        html!(
            "<tr><th scope=\"row\">{}</th>{}<td>{}</td></tr>\n",
            row.quantity,
            cells,
            row.n
        )
    });
    let (range, count) = match (outcome.declared.draws, &outcome.declared.drawn) {
        (_, Some(_)) => ("5 to 95 %", "Draws"),
        (0, None) => ("5 to 95 % of rounds", "Rounds"),
        _ => ("5 to 95 % of wearers", "Wearers"),
    };
    let heads = [("Paper", has_paper), ("Ours", true), (range, has_range)];
    let heads = heads.into_iter().filter(|head| head.1).map(|head| head.0);
    let heads: Vec<&str> = ["Quantity", "Unit"].into_iter().chain(heads).collect();
    let table = table(&[&heads[..], &[count]].concat(), rows.collect());
    let has_large = entries.iter().any(|row| {
        let numbers = [row.ours, row.low, row.high].into_iter().flatten();
        numbers
            .into_iter()
            .any(|value| large_t(&row.quantity, value).is_some())
    });
    let has_ones = entries.iter().any(|row| row.unit.is_empty());
    let notes = [
        (
            has_ones,
            "Unit 1: a ratio, a correlation, a probability or a test statistic.",
        ),
        (has_large, LARGE_T),
    ];
    let notes = notes.into_iter().filter(|note| note.0);
    let notes: Html = notes
        .map(|(_, text)| html!("<p class=\"note\">{}</p>\n", text))
        .collect();
    match table.is_empty() {
        true => table,
        false => table + notes,
    }
}

/// Formats a value with its unit; values with the unit "cases" are whole numbers.
pub(super) fn format_value(value: Option<f64>, unit: &str) -> String {
    match value {
        None => "—".to_owned(),
        Some(cases) if unit == "cases" => format!("{cases:.0}"),
        Some(value) => digits(value),
    }
}

/// Returns a table with these rows under a row of heads; empty without rows.
pub(super) fn table(heads: &[&str], rows: Html) -> Html {
    let heads: Html = heads
        .iter()
        .map(|head| html!("<th scope=\"col\">{}</th>", head))
        .collect();
    match rows.is_empty() {
        true => rows,
        false => html!(
            "<table><thead><tr>{}</tr></thead><tbody>\n{}</tbody></table>\n",
            heads,
            rows
        ),
    }
}
