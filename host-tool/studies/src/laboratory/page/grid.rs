//! Shows claims on a large grid as a table with one line per point, because a bar for each would
//! fill many pages.

use super::tables::table;
use crate::laboratory::claims::{Share, Verdict};
use crate::laboratory::result::Outcome;
use host_core::html;
use host_core::report::Html;

/// Largest number of grid points whose shares are shown as bars instead of a table.
const LARGE: usize = 20;

/// Groups the shares by grid point, in the order of the points.
fn points(outcome: &Outcome) -> Vec<&[Share]> {
    let alike = |a: &Share, b: &Share| a.at == b.at;
    outcome.shares.chunk_by(alike).collect()
}

/// Returns whether the grid is too large to show its shares as bars.
pub(super) fn is_large(outcome: &Outcome) -> bool {
    points(outcome).len() > LARGE
}

/// Tabulates the share of cases in which each claim holds at each grid point, %, and the number of
/// points that agree with the paper.
pub(super) fn section(outcome: &Outcome) -> Html {
    let points = points(outcome);
    let Some(claims) = points.first().copied() else {
        return Html::default();
    };
    let item = |share: &Share| {
        let paper = match share.paper {
            Some(true) => " (the paper: yes)",
            Some(false) => " (the paper: no)",
            None => "",
        };
        html!("<li>{}{}</li>\n", share.claim, paper)
    };
    let list: Html = claims.iter().map(item).collect();
    let numbers: Vec<String> = (1..=claims.len()).map(|index| index.to_string()).collect();
    let heads: Vec<&str> = std::iter::once("At")
        .chain(numbers.iter().map(String::as_str))
        .collect();
    let rows: Html = points.iter().map(|point| row(point)).collect();
    html!(
        "<ol>\n{}</ol>\n<p>Percentage of cases in which each of these claims holds:</p>\n{}",
        list,
        table(&heads, rows + like(&points, claims))
    )
}

/// Returns the table row of one grid point; a cell is darker the larger its share.
fn row(point: &[Share]) -> Html {
    let at = point.first().map_or("", |share| &share.at);
    let cell = |share: &Share| match share.of {
        0 => html!("<td>–</td>"),
        of => {
            let percent = 100.0 * share.holds as f64 / of as f64;
            // At most half, so that the text stays legible.
            let tint = 0.5 * percent;
            html!(
                "<td style=\"background:color-mix(in srgb,var(--accent) {}%,transparent)\">{}</td>",
                format!("{tint:.0}"),
                format!("{percent:.0}")
            )
        }
    };
    let cells: Html = point.iter().map(cell).collect();
    html!("<tr><th scope=\"row\">{}</th>{}</tr>\n", at, cells)
}

/// Returns the last row of the table: for each claim, the number of grid points at which most cases
/// agree with the paper.
fn like(points: &[&[Share]], claims: &[Share]) -> Html {
    let count = |(nth, claim): (usize, &Share)| {
        let at = points.iter().filter_map(|point| point.get(nth));
        let like = at.filter(|share| share.verdict() == Some(Verdict::Like));
        match claim.paper {
            Some(_) => html!("<td>{}</td>", like.count()),
            None => html!("<td>–</td>"),
        }
    };
    let cells: Html = claims.iter().enumerate().map(count).collect();
    html!(
        "<tr><th scope=\"row\">points of {} where most cases agree with the paper</th>{}</tr>\n",
        points.len(),
        cells
    )
}
