//! Formats medians and ranges of draws as cells of tables.

use host_core::statistics::Spread;

/// Formats a number with this many decimal places, or a dash if there is none.
pub(super) fn cell(value: Option<f64>, places: usize) -> String {
    value.map_or_else(|| "-".to_owned(), |value| format!("{value:.places$}"))
}

/// Formats the median, the range from 5th to 95th percentile, and the number of values; without a
/// spread, two dashes and 0.
pub(super) fn cells(spread: Option<Spread>, places: usize) -> [String; 3] {
    let range = spread.map_or_else(
        || "-".to_owned(),
        |spread| {
            let Spread { low, high, .. } = spread;
            format!("{low:.places$} to {high:.places$}")
        },
    );
    [
        cell(spread.map(|spread| spread.median), places),
        range,
        spread.map_or(0, |spread| spread.n).to_string(),
    ]
}

/// Returns a label such as "P (1 draw)".
pub(super) fn draw_count_label(name: &str, count: usize) -> String {
    let draws = if count == 1 { "draw" } else { "draws" };
    format!("{name} ({count} {draws})")
}
