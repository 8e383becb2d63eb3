//! Claims at many points of a grid: a table with a line for each point, where a bar for
//! each would fill many pages.

use super::tables::table;
use crate::laboratory::claims::{Share, Verdict};
use crate::laboratory::result::Outcome;
use host_core::plot::canvas::escape;

/// A grid of more points than this is large.
const LARGE: usize = 20;

/// Shares of one point after those of another, in their order.
fn points(outcome: &Outcome) -> Vec<&[Share]> {
    let alike = |a: &Share, b: &Share| a.at == b.at;
    outcome.shares.chunk_by(alike).collect()
}

/// Whether bars of all its shares would fill many pages.
pub(super) fn is_large(outcome: &Outcome) -> bool {
    points(outcome).len() > LARGE
}

/// In how many of a hundred cases each claim holds at each point, and at how many points
/// that is as in the paper.
pub(super) fn section(outcome: &Outcome) -> String {
    let points = points(outcome);
    let Some(claims) = points.first().copied() else {
        return String::new();
    };
    let item = |share: &Share| {
        let paper = match share.paper {
            Some(true) => " (the paper: yes)",
            Some(false) => " (the paper: no)",
            None => "",
        };
        format!("<li>{}{paper}</li>\n", escape(&share.claim))
    };
    let list: String = claims.iter().map(item).collect();
    let numbers: Vec<String> = (1..=claims.len()).map(|it| it.to_string()).collect();
    let heads: Vec<&str> = std::iter::once("At")
        .chain(numbers.iter().map(String::as_str))
        .collect();
    let rows: String = points.iter().map(|point| row(point)).collect();
    format!(
        "<ol>\n{list}</ol>\n<p>In how many of a hundred cases each of these holds:</p>\n{}",
        table(&heads, rows + &like(&points, claims))
    )
}

/// A line: the darker, the more.
fn row(point: &[Share]) -> String {
    let at = point.first().map_or("", |share| &share.at);
    let cell = |share: &Share| match share.of {
        0 => "<td>–</td>".to_owned(),
        of => {
            let percent = 100.0 * share.holds as f64 / of as f64;
            // At most half, so that what is written stays legible.
            let tint = 0.5 * percent;
            format!(
                "<td style=\"background:color-mix(in srgb,var(--accent) {tint:.0}%,transparent)\">\
                 {percent:.0}</td>"
            )
        }
    };
    let cells: String = point.iter().map(cell).collect();
    format!("<tr><th scope=\"row\">{}</th>{cells}</tr>\n", escape(at))
}

/// The last line: at how many points most cases are as in the paper.
fn like(points: &[&[Share]], claims: &[Share]) -> String {
    let count = |(nth, claim): (usize, &Share)| {
        let at = points.iter().filter_map(|point| point.get(nth));
        let like = at.filter(|share| share.verdict() == Some(Verdict::Like));
        match claim.paper {
            Some(_) => format!("<td>{}</td>", like.count()),
            None => "<td>–</td>".to_owned(),
        }
    };
    let cells: String = claims.iter().enumerate().map(count).collect();
    let of = points.len();
    format!("<tr><th scope=\"row\">of {of} points, most as the paper says</th>{cells}</tr>\n")
}
