//! The tables of an experiment's page.

use crate::laboratory::result::Outcome;
use host_core::html;
use host_core::report::Html;

/// A row for each claim, and for each point of a grid.
pub(super) fn shares_table(outcome: &Outcome) -> Html {
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
            html!("<td>{}</td>", share.at)
        } else {
            Html::default()
        };
        html!(
            "<tr><th scope=\"row\">{}</th>{}<td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>\n",
            share.claim,
            place,
            paper,
            share.percent(),
            interval,
            format!("{} of {}", share.holds, share.of)
        )
    });
    let place = if is_grid { &["At"][..] } else { &[] };
    let heads = [
        &["Claim"],
        place,
        &["Paper", "Holds in", "95 % interval", "Cases"],
    ]
    .concat();
    table(&heads, rows.collect())
}

/// Rows *paper | ours | interval*; without paper or interval where no row has one.
pub(super) fn rows_table(outcome: &Outcome) -> Html {
    let all = &outcome.rows;
    let has_paper = all.iter().any(|row| row.paper.is_some());
    let has_range = all.iter().any(|row| row.low.is_some());
    let rows = all.iter().map(|row| {
        let paper = has_paper.then(|| printed(row.paper, &row.unit));
        let range = row.low.zip(row.high);
        let range = range.map_or_else(
            || "—".to_owned(),
            |(low, high)| format!("{} to {}", digits(low), digits(high)),
        );
        let cells = [Some(row.unit.clone()), paper];
        let ours = [
            Some(printed(row.ours, &row.unit)),
            has_range.then_some(range),
        ];
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
        (_, Some(_)) => ("5 to 95 %", "Drawn"),
        (0, None) => ("5 to 95 % of rounds", "Rounds"),
        _ => ("5 to 95 % of wearers", "Wearers"),
    };
    let heads = [("Paper", has_paper), ("Ours", true), (range, has_range)];
    let heads = heads.into_iter().filter(|it| it.1).map(|it| it.0);
    let heads: Vec<&str> = ["Quantity", "Unit"].into_iter().chain(heads).collect();
    table(&[&heads[..], &[count]].concat(), rows.collect())
}

/// A value in its unit: cases are whole.
pub(super) fn printed(value: Option<f64>, unit: &str) -> String {
    match value {
        None => "—".to_owned(),
        Some(cases) if unit == "cases" => format!("{cases:.0}"),
        Some(value) => digits(value),
    }
}

/// A table of these rows, under heads that are text; nothing without a row.
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
