//! Figure of mean and maximum cycles of each algorithm on a logarithmic scale, with dots because
//! bars would have no zero.

use crate::bench::{Deadline, OnChip};
use host_core::plot::ink::{MUTED, PALETTE, stroke};
use host_core::plot::words::group_digits;
use host_core::plot::{Axis, Figure, Key, Mark, Paint, Panel, Shape};

const PITCH: f64 = 22.0;
const MEAN: (Shape, Paint) = (Shape::Disc, Paint::Full(PALETTE[0]));
const MOST: (Shape, Paint) = (Shape::Up, Paint::Full(PALETTE[4]));

/// Draws one row for each algorithm, measured with the default flash timing, as an SVG file and
/// returns its text.
pub fn picture(chip: &OnChip) -> String {
    let rows: Vec<_> = chip.algorithms().collect();
    let mut x = Axis::decades("cycles of one call", (1, 6));
    x.ticks
        .iter_mut()
        .for_each(|(cycles, words)| *words = group_digits(*cycles as u64));
    for (deadline, name) in [(Deadline::Window, "window"), (Deadline::Tick, "tick")] {
        let cycles = deadline.cycles();
        let words = format!("{name} {}", group_digits(cycles));
        x = x.reference_line(cycles as f64, &words, MUTED);
    }
    let names = rows.iter().map(|row| row.name.replace('_', " "));
    let mut y = Axis::rows("", names);
    let mut marks = Vec::new();
    for (at, row) in (0..).map(f64::from).zip(&rows) {
        let [mean, most] = [row.mean, row.max].map(|cycles| cycles as f64);
        marks.push(Mark::Line(
            vec![(mean, at), (most, at)],
            stroke(PALETTE[4], 2.0),
        ));
        marks.push(Mark::Dot((most, at), MOST.0, 4.0, MOST.1));
        marks.push(Mark::Dot((mean, at), MEAN.0, 4.0, MEAN.1));
        y = y.far_label(
            at,
            &format!("{} / {}", group_digits(row.mean), group_digits(row.max)),
        );
    }
    y.grid = true;
    let description = "Mean and maximum core clock cycles of each algorithm on the chip simulator";
    Figure {
        description: description.to_owned(),
        title: "Cycles of one call on the chip simulator".to_owned(),
        subtitle:
            "Five wait states, caches on, prefetched lines cached. At the right: mean / maximum."
                .to_owned(),
        legend: vec![
            (Key::Dot(MEAN.0, MEAN.1), "mean".to_owned()),
            (Key::Dot(MOST.0, MOST.1), "maximum".to_owned()),
            (
                Key::Line(stroke(MUTED, 1.4)),
                "deadline: next window or next tick".to_owned(),
            ),
        ],
        rows: vec![vec![Panel {
            marks,
            ..Panel::new("", x, y, rows.len() as f64 * PITCH)
        }]],
        ..Figure::default()
    }
    .file()
}
