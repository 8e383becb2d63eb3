//! Bar chart of the RMSE of this run beside the values that a paper printed.

use super::tables::degrees;
use crate::analysis::metrics_without_lag;
use crate::plot::axis::Head;
use crate::plot::ink::{EDGE, HALO, INK, PALETTE};
use crate::plot::words::truncate;
use crate::plot::{Axis, Figure, Key, Mark, Paint, Panel, Scale, Shape, Svg};
use crate::record::{PaperRow, Trial};

/// Height of a bar with the space around it, pixels.
const PITCH: f64 = 24.0;
/// Maximum width of the name of a bar, pixels.
const NAME: f64 = 300.0;

/// One bar of the chart: the RMSE of this run, or the mean of a paper's trials with a dot for each
/// of them.
struct Bar<'a> {
    label: &'a str,
    value: f64,
    dots: &'a [f64],
}

/// Draws the bars of every trial for which a paper reports values; an empty figure if there are
/// none.
pub(super) fn figure(trials: &[Trial], paper: &[PaperRow]) -> Svg {
    let groups = trials
        .iter()
        .filter_map(|trial| Some((trial.name.as_str(), trial_bars(trial, paper)?)));
    let (mut heads, mut ticks, mut marks) = (Vec::new(), Vec::new(), Vec::new());
    let (mut at, mut most) = (0.0, 1.0f64);
    for (name, bars) in groups {
        heads.push(Head {
            at,
            name: name.to_owned(),
            bold: true,
            ..Head::default()
        });
        for bar in bars {
            ticks.push((at, truncate(11.0, bar.label, NAME, false)));
            most = most.max(draw(&mut marks, at, &bar));
            at += 1.0;
        }
        at += 0.6;
    }
    if ticks.is_empty() {
        return Svg::default();
    }
    let y = Axis {
        grid: false,
        heads,
        ..Axis::new("", Scale::Rows(at - 0.6)).ticks(ticks)
    };
    // The axis leaves room for the number beyond the longest bar.
    let x = Axis::linear("RMSE (°)", (0.0, most * 1.15), 7.0);
    let legend = [
        (Key::Box(Paint::Full(PALETTE[0])), "this run"),
        (
            Key::Box(Paint::Full(PALETTE[4])),
            "mean of the paper's trials",
        ),
        (
            Key::Dot(Shape::Disc, Paint::Full(INK)),
            "each of the paper's trials",
        ),
    ];
    let panel = Panel {
        marks,
        ..Panel::new("", x, y, (at - 0.6) * PITCH)
    };
    Figure {
        description: "RMSE of this run and of the paper".to_owned(),
        legend: legend.map(|(key, name)| (key, name.to_owned())).into(),
        rows: vec![vec![panel]],
        ..Figure::default()
    }
    .svg()
}

fn trial_bars<'a>(trial: &Trial, paper: &'a [PaperRow]) -> Option<Vec<Bar<'a>>> {
    let mut rows = paper
        .iter()
        .filter(|row| row.trial == trial.name)
        .peekable();
    rows.peek()?;
    let printed = rows.filter_map(|row| {
        Some(Bar {
            label: &row.source,
            value: row.mean()?,
            dots: &row.values,
        })
    });
    let mut bars = vec![Bar {
        label: "this run",
        value: metrics_without_lag(trial)?.rmse_deg,
        dots: &[],
    }];
    bars.extend(printed);
    (bars.len() > 1).then_some(bars)
}

/// Adds a bar with its dots and its number to `marks`. Returns the largest value that the bar or a
/// dot shows.
fn draw(marks: &mut Vec<Mark>, at: f64, bar: &Bar) -> f64 {
    let (color, words) = match bar.dots {
        [] => (PALETTE[0], degrees(bar.value)),
        _ => (PALETTE[4], format!("mean {}", degrees(bar.value))),
    };
    let (from, to) = ((0.0, bar.value), (at - 0.33, at + 0.33));
    marks.push(Mark::Area(from, to, Paint::Full(color)));
    for &dot in bar.dots {
        for (radius, color) in [(4.0, HALO), (3.0, EDGE)] {
            marks.push(Mark::Dot(
                (dot, at),
                Shape::Disc,
                radius,
                Paint::Full(color),
            ));
        }
    }
    // The number is placed beyond the last dot, so that it does not cover a dot.
    let end = bar.dots.iter().copied().fold(bar.value, f64::max);
    marks.push(Mark::Beside((end, at), 8.0, words));
    end
}
