//! Figure of the random sessions: error of the chosen model against that of the next cheaper one.

use crate::ladder::judge::{Row, TOLERANCES};
use host_core::choice::measured_levels;
use host_core::plot::ink::{INK, PALETTE};
use host_core::plot::{Axis, Figure, Key, Mark, Paint, Panel, Shape};
use host_core::session::level_name;

/// Ends of both axes, as powers of ten of a percent.
const DECADES: (i32, i32) = (-3, 3);
/// Smallest error on the axes, %; smaller errors are drawn at the edge.
const LEAST: f64 = 1e-3;

/// Draws one panel per tolerance, as an SVG file, and returns its text.
pub fn picture(rows: &[Row], seed: u64) -> String {
    let legend = measured_levels().enumerate().map(|(n, level)| {
        let name = format!("{} chosen", level_name(level));
        (Key::Dot(Shape::SERIES[n], Paint::Full(PALETTE[n])), name)
    });
    let panels: Vec<Panel> = (0..TOLERANCES.len()).map(|n| panel(rows, n)).collect();
    let sessions = rows.chunk_by(|a, b| a.session == b.session).count();
    Figure {
        title: format!("Muscle models chosen for {sessions} random sessions (simulated)"),
        description: "Error of the chosen muscle model and of the next cheaper one".to_owned(),
        legend: legend.collect(),
        rows: panels.chunks(2).map(<[Panel]>::to_vec).collect(),
        notes: vec![format!(
            "Seed {seed}; {} muscles. A muscle is marked in each panel in which a model was chosen \
             for which a cheaper one exists. Errors are those of the predicted values that the \
             session uses, in % of its largest true force; errors of {LEAST} % and less are drawn \
             at the edge.",
            rows.len()
        )],
        ..Figure::default()
    }
    .file()
}

/// Draws the panel of the tolerance with index `n`. To the right of the vertical line the chosen
/// model misses the tolerance; below the horizontal line the next cheaper model would have met it.
fn panel(rows: &[Row], n: usize) -> Panel {
    let limit_pct = TOLERANCES[n].fraction() * 100.0;
    let levels: Vec<_> = measured_levels().collect();
    let dots = rows.iter().filter_map(|row| {
        let verdict = row.verdicts[n];
        let place = levels
            .iter()
            .position(|level| Some(*level) == verdict.chosen)?;
        let at = (
            verdict.error_pct.max(LEAST),
            verdict.cheaper_pct?.max(LEAST),
        );
        Some(Mark::Dot(
            at,
            Shape::SERIES[place],
            3.5,
            Paint::Full(PALETTE[place]),
        ))
    });
    let x = Axis::decades("error of the chosen model (%)", DECADES);
    let y = Axis::decades("error of the next cheaper model (%)", DECADES);
    Panel {
        marks: dots.collect(),
        ..Panel::new(
            &format!("Tolerance {limit_pct:.0} %"),
            x.reference_line(limit_pct, "", INK),
            y.reference_line(limit_pct, "tolerated", INK),
            260.0,
        )
    }
}
