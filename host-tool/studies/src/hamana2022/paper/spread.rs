//! Median and range of what draws came to.

use host_core::statistics::quantile_of;

/// Of the draws that have a number.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Spread {
    pub median: f64,
    /// 5th and 95th percentile.
    pub range: [f64; 2],
    pub n: usize,
}

impl Spread {
    /// `None` of nothing.
    pub fn of(all: impl IntoIterator<Item = f64>) -> Option<Self> {
        let mut all: Vec<f64> = all.into_iter().collect();
        all.sort_unstable_by(f64::total_cmp);
        let at = |part| quantile_of(&all, part);
        (!all.is_empty()).then(|| Self {
            median: at(0.5),
            range: [at(0.05), at(0.95)],
            n: all.len(),
        })
    }
}

/// "24.0", or a dash.
pub(super) fn cell(value: Option<f64>, places: usize) -> String {
    value.map_or_else(|| "-".to_owned(), |it| format!("{it:.places$}"))
}

/// Median, range and count of a spread as cells.
pub(super) fn cells(spread: Option<Spread>, places: usize) -> [String; 3] {
    let range = spread.map_or_else(
        || "-".to_owned(),
        |it| {
            let [low, high] = it.range;
            format!("{low:.places$} to {high:.places$}")
        },
    );
    [
        cell(spread.map(|it| it.median), places),
        range,
        spread.map_or(0, |it| it.n).to_string(),
    ]
}

/// "P (1 draw)".
pub(super) fn of_draws(name: &str, count: usize) -> String {
    let draws = if count == 1 { "draw" } else { "draws" };
    format!("{name} ({count} {draws})")
}
