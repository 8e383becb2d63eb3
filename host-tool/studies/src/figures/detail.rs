//! Figure of the hands with fewer motor units: error against instructions.

use crate::hands::detail::{Row, TOLERANCES};
use host_core::plot::ink::{INK, PALETTE, stroke};
use host_core::plot::{Axis, Figure, Key, Mark, Paint, Panel, Shape};

/// Number of motor units of each pool, and instructions of a second of the counted session.
pub type Cost = (usize, f64);

/// Ends of the error axis, as powers of ten of a percent.
const DECADES: (i32, i32) = (-2, 2);
/// Shares of the sessions whose errors are below a curve, with their names.
const SHARES: [(f64, &str); 2] = [(0.5, "median session"), (0.95, "95 % of the sessions")];

/// Draws the error of each number of motor units against its instructions, as an SVG file, and
/// returns its text.
pub fn picture(rows: &[Row], costs: &[Cost], seed: u64) -> String {
    let mut marks = Vec::new();
    for ((share, _), color) in SHARES.into_iter().zip(PALETTE) {
        let points: Vec<(f64, f64)> = costs
            .iter()
            .filter_map(|&(units, instructions)| {
                let error = quantile(&errors(rows, units), share)?;
                (error > 0.0).then_some((instructions * 1e-6, error * 100.0))
            })
            .collect();
        let dot = |at: &(f64, f64)| Mark::Dot(*at, Shape::SERIES[0], 3.5, Paint::Full(color));
        marks.extend(points.iter().map(dot));
        marks.push(Mark::Line(points, stroke(color, 1.5)));
    }
    for &(units, instructions) in costs {
        if let Some(error) = quantile(&errors(rows, units), 0.95).filter(|error| *error > 0.0) {
            let at = (instructions * 1e-6, error * 100.0);
            marks.push(Mark::Beside(at, 6.0, units.to_string()));
        }
    }
    let most = costs.iter().map(|cost| cost.1 * 1e-6).fold(1.0, f64::max);
    let x = Axis::linear(
        "instructions of the host per second (millions)",
        (0.0, most * 1.1),
        6.0,
    );
    let y = Axis::decades(
        "rms difference of the angle (% of the reference range)",
        DECADES,
    );
    let limits = TOLERANCES
        .iter()
        .map(|tolerance| tolerance.fraction() * 100.0);
    let y = limits.fold(y, |y, limit| y.reference_line(limit, "", INK));
    let legend = SHARES.into_iter().zip(PALETTE);
    let legend = legend.map(|((_, name), color)| {
        (
            Key::Dot(Shape::SERIES[0], Paint::Full(color)),
            name.to_owned(),
        )
    });
    Figure {
        title: "A simulated hand with fewer motor units (simulated)".to_owned(),
        description: "Error of a hand with fewer motor units against its instructions".to_owned(),
        legend: legend.collect(),
        rows: vec![vec![Panel {
            marks,
            ..Panel::new("Motor units per pool, at each mark", x, y, 260.0)
        }]],
        notes: vec![format!(
            "Errors: {} random sessions of seed {seed}, against the same session with every motor \
             unit. Instructions: one session of two points, board and host program included. Lines: \
             tolerances at which the choice is judged.",
            rows.len()
        )],
        ..Figure::default()
    }
    .file()
}

/// Returns the errors of this number of motor units in ascending order.
fn errors(rows: &[Row], units: usize) -> Vec<f64> {
    let effects = rows.iter().flat_map(|row| &row.judged);
    let own = effects.filter(|effect| effect.setting as usize == units);
    let mut errors: Vec<f64> = own.map(|effect| effect.error).collect();
    errors.sort_by(f64::total_cmp);
    errors
}

/// Returns the smallest of the sorted values that is at least as large as this share of them.
fn quantile(sorted: &[f64], share: f64) -> Option<f64> {
    let place = (share * sorted.len() as f64).ceil() as usize;
    sorted.get(place.saturating_sub(1)).copied()
}
