//! Tabulates kinds of cases in rows and their measures in columns.

use super::tables::{format_value, table};
use crate::laboratory::result::{Outcome, Row};
use host_core::html;
use host_core::report::Html;

/// Returns a table with a row for each kind of case and a column for each measure. Empty if the
/// result's rows are not divided into kinds.
pub(super) fn kinds_table(outcome: &Outcome) -> Html {
    let parts = |row: &'_ Row| {
        let (kind, measure) = row.quantity.split_once(": ")?;
        Some((kind.to_owned(), measure.to_owned()))
    };
    let pairs: Option<Vec<_>> = outcome.rows.iter().map(parts).collect();
    let (Some(pairs), true) = (pairs, outcome.declared.drawn.is_some()) else {
        return Html::default();
    };
    let kinds = distinct(pairs.iter().map(|pair| &pair.0));
    let measures = distinct(pairs.iter().map(|pair| &pair.1));
    let cell = |kind: &str, measure: &str| {
        let place = pairs
            .iter()
            .position(|pair| pair.0 == kind && pair.1 == measure);
        place.map(|at| &outcome.rows[at])
    };
    let has_any = |measure: &&String| {
        let mut values = kinds.iter().filter_map(|kind| cell(kind, measure));
        values.any(|row| row.ours.is_some())
    };
    let measures: Vec<_> = measures.into_iter().filter(has_any).collect();
    let rows = kinds.iter().map(|kind| {
        let drawn = cell(kind, measures.first()?).map(|row| row.n)?;
        let values = measures.iter().map(|measure| match cell(kind, measure) {
            Some(row) => html!("<td>{}</td>", format_value(row.ours, &row.unit)),
            None => html!("<td>—</td>"),
        });
        let values = values.collect::<Html>();
        let kind = kind.split_once('/').map_or("all", |pair| pair.1);
        Some(html!(
            "<tr><th scope=\"row\">{}</th><td>{}</td>{}</tr>\n",
            kind,
            drawn,
            values
        ))
    });
    let heads = measures.iter().map(|measure| {
        let unit = kinds.iter().find_map(|kind| cell(kind, measure));
        match unit.map_or("cases", |row| &row.unit) {
            "cases" => measure.to_string(),
            unit => format!("{measure}, {unit}"),
        }
    });
    let heads: Vec<_> = ["kind".to_owned(), "draws".to_owned()]
        .into_iter()
        .chain(heads)
        .collect();
    let heads: Vec<_> = heads.iter().map(String::as_str).collect();
    let table = table(&heads, rows.flatten().collect());
    html!("<div class=\"wide\">{}</div>\n", table)
}

/// Returns each of these texts once, in the order of first occurrence.
fn distinct<'a>(texts: impl Iterator<Item = &'a String>) -> Vec<&'a String> {
    let mut found: Vec<&String> = Vec::new();
    for text in texts {
        if !found.contains(&text) {
            found.push(text);
        }
    }
    found
}
