//! Figure of a simulated limb with less detail: error against instructions.

use crate::detail::{Limb, Row};
use host_core::plot::ink::{INK, PALETTE, stroke};
use host_core::plot::{Axis, Figure, Key, Mark, Paint, Panel, Shape};

/// Level of detail, and instructions of a second of the counted session.
pub type Cost = (u32, f64);

/// Ends of the error axis, as powers of ten of a percent.
const DECADES: (i32, i32) = (-3, 2);
/// Shares of the sessions whose errors are below a curve, with their names.
const SHARES: [(f64, &str); 2] = [(0.5, "median session"), (0.95, "95 % of the sessions")];

/// Words of the figure for one limb.
struct Words {
    title: &'static str,
    panel: &'static str,
    /// Name of the error axis.
    error: &'static str,
    /// Session with which instructions are counted, and the most detailed level.
    counted: &'static str,
}

const fn words(limb: Limb) -> Words {
    match limb {
        Limb::Hand => Words {
            title: "A simulated hand with fewer motor units (simulated)",
            panel: "Motor units per pool, at each mark",
            error: "rms difference of the angle (% of the reference range)",
            counted: "against the same session with every motor unit. Instructions: one session of \
                      two points",
        },
        Limb::Arm => Words {
            title: "A simulated arm in coarser time steps (simulated)",
            panel: "Time step in ms, at each mark",
            error: "rms difference of force or angle (%)",
            counted: "against the same session in steps of 1 ms. Instructions: one session of an arm \
                      in the cuff",
        },
    }
}

/// Draws the error of each level of detail against its instructions, as an SVG file, and returns its
/// text.
pub fn picture(limb: Limb, rows: &[Row], costs: &[Cost], seed: u64) -> String {
    let words = words(limb);
    let mut marks = Vec::new();
    for ((share, _), color) in SHARES.into_iter().zip(PALETTE) {
        let points: Vec<(f64, f64)> = costs
            .iter()
            .filter_map(|&(level, instructions)| {
                let error = quantile(&errors(rows, level), share)?;
                (error > 0.0).then_some((instructions * 1e-6, error * 100.0))
            })
            .collect();
        let dot = |at: &(f64, f64)| Mark::Dot(*at, Shape::SERIES[0], 3.5, Paint::Full(color));
        marks.extend(points.iter().map(dot));
        marks.push(Mark::Line(points, stroke(color, 1.5)));
    }
    for &(level, instructions) in costs {
        if let Some(error) = quantile(&errors(rows, level), 0.95).filter(|error| *error > 0.0) {
            let at = (instructions * 1e-6, error * 100.0);
            marks.push(Mark::Beside(at, 6.0, level.to_string()));
        }
    }
    let most = costs.iter().map(|cost| cost.1 * 1e-6).fold(1.0, f64::max);
    let x = Axis::linear(
        "instructions of the host per second (millions)",
        (0.0, most * 1.1),
        6.0,
    );
    let y = Axis::decades(words.error, DECADES);
    let limits = limb
        .tolerances()
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
        title: words.title.to_owned(),
        description: format!(
            "Error of a simulated {} with less detail against its instructions",
            limb.name()
        ),
        legend: legend.collect(),
        rows: vec![vec![Panel {
            marks,
            ..Panel::new(words.panel, x, y, 260.0)
        }]],
        notes: vec![format!(
            "Errors: {} random sessions of seed {seed}, {}, board and host program included, {} \
             profile. Lines: tolerances at which the choice is judged.",
            rows.len(),
            words.counted,
            if cfg!(debug_assertions) {
                "development"
            } else {
                "release"
            }
        )],
        ..Figure::default()
    }
    .file()
}

/// Returns the errors of this level of detail in ascending order.
fn errors(rows: &[Row], level: u32) -> Vec<f64> {
    let effects = rows.iter().flat_map(|row| &row.judged);
    let own = effects.filter(|effect| effect.setting == level);
    let mut errors: Vec<f64> = own.map(|effect| effect.error).collect();
    errors.sort_by(f64::total_cmp);
    errors
}

/// Returns the smallest of the sorted values that is at least as large as this share of them.
fn quantile(sorted: &[f64], share: f64) -> Option<f64> {
    let place = (share * sorted.len() as f64).ceil() as usize;
    sorted.get(place.saturating_sub(1)).copied()
}
