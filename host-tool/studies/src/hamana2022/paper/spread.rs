//! Medians and ranges of draws as cells of tables.

use host_core::statistics::Spread;

/// "24.0", or a dash.
pub(super) fn cell(value: Option<f64>, places: usize) -> String {
    value.map_or_else(|| "-".to_owned(), |value| format!("{value:.places$}"))
}

/// Median, range and count of a spread as cells.
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

/// "P (1 draw)".
pub(super) fn draw_count_label(name: &str, count: usize) -> String {
    let draws = if count == 1 { "draw" } else { "draws" };
    format!("{name} ({count} {draws})")
}
