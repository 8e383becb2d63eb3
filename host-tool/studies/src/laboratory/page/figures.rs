//! The figures of an experiment's page.

use super::{Rows, shown};
use crate::laboratory::claims::Share;
use crate::laboratory::measure::{Measure, find_measure};
use crate::laboratory::numbers::along;
use crate::laboratory::result::{Outcome, Row, ShownCondition};
use host_core::plot::ink::{INK, MUTED, PALETTE, stroke};
use host_core::plot::series::{range, shorten};
use host_core::plot::words::truncate;
use host_core::plot::{Axis, Figure, Key, Mark, Paint, Panel, Scale, Shape, Svg};
use host_core::record::{Sample, Trial};
use host_core::report::{Html, figure};
use std::collections::BTreeSet;

/// Height of a row with its spacing, pixels.
const PITCH: f64 = 24.0;
/// Width of the name of a row, pixels.
const NAME: f64 = 330.0;
/// Height of a small plot, pixels.
const MULTIPLE: f64 = 110.0;
/// Largest number of small plots side by side.
const BESIDE: usize = 4;
/// Largest number of points that are plotted in a small plot.
const POINTS: usize = 300;

/// Draws a row for each claim: a bar for its share, the confidence interval, and the paper's
/// statement.
pub(super) fn shares(outcome: &Outcome) -> Svg {
    let shares = &outcome.shares;
    if shares.is_empty() {
        return Svg::default();
    }
    // One row per claim, and one per grid point before its claims.
    let (mut names, mut marks, mut point) = (Vec::new(), Vec::new(), "");
    for share in shares {
        if share.at != point {
            point = &share.at;
            names.push(truncate(11.0, point, NAME, false));
        }
        marks.extend(share_marks(share, names.len() as f64));
        names.push(truncate(11.0, &share.claim, NAME, false));
    }
    let height = names.len() as f64 * PITCH;
    let y = Axis {
        grid: false,
        ..Axis::rows("", names)
    };
    let x = Axis::linear("share of cases (%)", (0.0, 100.0), 5.0);
    let panel = Panel {
        marks,
        ..Panel::new("", x, y, height)
    };
    let legend = [
        (
            Key::Box(Paint::Tint(PALETTE[0])),
            "share of cases in which the claim holds",
        ),
        (Key::Line(stroke(PALETTE[0], 3.0)), "95 % interval"),
        (
            Key::Dot(Shape::Diamond, Paint::Full(PALETTE[1])),
            "the paper's claim",
        ),
    ];
    Figure {
        description: "Share of cases in which each claim holds".to_owned(),
        legend: legend.map(|(key, name)| (key, name.to_owned())).into(),
        rows: vec![vec![panel]],
        ..Figure::default()
    }
    .svg()
}

/// Returns the marks of a claim in row `at`: a bar for the share, its interval, and the paper's
/// statement.
fn share_marks(share: &Share, at: f64) -> Vec<Mark> {
    let part = 100.0 * share.holds as f64 / (share.of as f64).max(1.0);
    let paint = Paint::Tint(PALETTE[0]);
    let mut marks = vec![Mark::Area((0.0, part), (at - 0.3, at + 0.3), paint)];
    if let (Some(low), Some(high)) = (share.low, share.high) {
        let ends = vec![(100.0 * low, at), (100.0 * high, at)];
        marks.push(Mark::Line(ends, stroke(PALETTE[0], 3.0)));
    }
    if let Some(paper) = share.paper {
        let place = (if paper { 100.0 } else { 0.0 }, at);
        let paint = Paint::Full(PALETTE[1]);
        marks.push(Mark::Dot(place, Shape::Diamond, 5.0, paint));
    }
    marks
}

/// Draws one small plot per condition: the angle of its recorded trial over time.
pub(super) fn multiples(rows: &Rows<'_>) -> Html {
    let trials: Vec<&Trial> = shown(rows).map(|(_, trial)| trial).collect();
    let angles = trials
        .iter()
        .flat_map(|trial| trial.samples.iter().filter_map(|s| angle(&s)));
    let Some((low, high)) = range(angles) else {
        return Html::default();
    };
    let last_s = trials
        .iter()
        .map(|trial| trial.duration_s)
        .fold(0.0, f64::max);
    let wide = rows.iter().map(Vec::len).max().unwrap_or(1);
    let panel = |n: usize, (condition, trial): &(&ShownCondition, Option<&Trial>)| {
        let Some(trial) = trial else {
            return empty();
        };
        let x = Axis::linear("time (s)", (0.0, last_s), 4.0);
        // The label that all panels of a row share appears once, at the left.
        let (row, own) = heading(condition);
        let row = match n {
            0 => truncate(12.0, &format!("{row} (°)"), 1.5 * MULTIPLE, false),
            _ => String::new(),
        };
        let y = Axis::linear(row.trim_start(), (low - 2.0, high + 2.0), 4.0);
        let mut panel = Panel::new("", x, y, MULTIPLE);
        panel.title = truncate(13.0, &own, 1000.0 / wide as f64 - 60.0, true);
        draw_course(&mut panel, trial);
        panel
    };
    let row = |row: &Vec<(&ShownCondition, Option<&Trial>)>| -> Vec<Panel> {
        let own = row.iter().enumerate().map(|(n, row)| panel(n, row));
        // Empty panels fill each row to the same number of columns.
        own.chain(std::iter::repeat_with(empty))
            .take(wide)
            .collect()
    };
    let own = "joint angle, without random draws".to_owned();
    let mut legend = vec![(Key::Line(stroke(PALETTE[0], 1.6)), own)];
    legend.push(match trials.iter().any(|trial| trial.wall.is_some()) {
        true => (Key::Box(Paint::Tint(MUTED)), "inside the wall".to_owned()),
        false => (Key::Line(stroke(INK, 1.0)), "reference".to_owned()),
    });
    let drawn = Figure {
        description: "Joint angle over time in each condition".to_owned(),
        legend,
        rows: rows.iter().map(row).collect(),
        ..Figure::default()
    };
    figure(&drawn.svg(), "")
}

/// Returns an empty plot for a condition that has no recorded trial.
fn empty() -> Panel {
    let nothing = || Axis::new("", Scale::Linear(0.0, 1.0));
    Panel::new("", nothing(), nothing(), MULTIPLE)
}

/// Returns the label of the row that contains a condition, and the label of the condition in it.
/// The row has the level of the first factor, the condition the levels of the others. With a single
/// factor, the row has no label.
pub(super) fn heading(condition: &ShownCondition) -> (String, String) {
    match condition.levels.split_first() {
        Some((row, own)) if !own.is_empty() => (row.clone(), own.join(", ")),
        _ => (String::new(), condition.name()),
    }
}

/// Adds the wall or the reference angle, and the angle of the trial, to a plot.
fn draw_course(panel: &mut Panel, trial: &Trial) {
    if let Some(wall) = trial.wall {
        let inside = match wall.stops_flexion {
            true => (wall.at_deg, f64::INFINITY),
            false => (f64::NEG_INFINITY, wall.at_deg),
        };
        let everywhere = (f64::NEG_INFINITY, f64::INFINITY);
        let ground = Mark::Area(everywhere, inside, Paint::Tint(MUTED));
        panel.ground.push(ground);
    }
    let mut line = |quantity: fn(&Sample) -> Option<f64>, color, width| {
        let points = trial
            .samples
            .iter()
            .filter_map(|s| Some((s.t_s, quantity(&s)?)));
        let lines = shorten(points, POINTS).into_iter();
        let lines = lines.map(|points| Mark::Line(points, stroke(color, width)));
        panel.marks.extend(lines);
    };
    if trial.wall.is_none() {
        line(|s| s.target_deg, INK, 1.0);
    }
    line(angle, PALETTE[0], 1.6);
}

fn angle(sample: &Sample) -> Option<f64> {
    sample.true_deg.or(sample.measured_deg)
}

/// Returns the number of small plots side by side: the number of conditions that share the level of
/// the first factor, at most [`BESIDE`].
pub(super) fn beside(conditions: &[ShownCondition]) -> usize {
    let row = |condition: &ShownCondition| heading(condition).0;
    let first = conditions.first().map(row);
    let alike = conditions.iter().map(row);
    match alike
        .take_while(|text| Some(text) == first.as_ref())
        .count()
    {
        some @ 1..=BESIDE => some,
        _ => BESIDE,
    }
}

/// Draws for each measure a plot with the median and the range of the wearers in each condition.
pub(super) fn measures(outcome: &Outcome) -> Html {
    let id = |row: &Row| Some(row.id.rsplit_once('/')?.1.to_owned());
    let mut ids: Vec<String> = outcome.rows.iter().filter_map(id).collect();
    let mut known = BTreeSet::new();
    ids.retain(|id| known.insert(id.clone()));
    let panels = ids.iter().filter_map(|id| panel(id, &outcome.rows));
    let whose = match outcome.declared.draws {
        0 => "median of the rounds",
        _ => "median of the wearers",
    };
    let legend = [
        (Key::Dot(Shape::Disc, Paint::Full(PALETTE[0])), whose),
        (Key::Line(stroke(PALETTE[0], 2.0)), "5th to 95th percentile"),
        (
            Key::Dot(Shape::Diamond, Paint::Full(PALETTE[1])),
            "the paper's value",
        ),
    ];
    // Each measure is a figure of its own: together they would not fit on a sheet of paper.
    let picture = |(nth, panel): (usize, Panel)| {
        let legend = legend.map(|(key, name)| (key, name.to_owned()));
        let drawn = Figure {
            description: format!("In each condition: {}", panel.title),
            legend: legend.into_iter().filter(|_| nth == 0).collect(),
            rows: vec![vec![panel]],
            ..Figure::default()
        };
        figure(&drawn.svg(), "")
    };
    panels.enumerate().map(picture).collect()
}

/// Draws the rows of the measure with this identifier; `None` if they have no values.
fn panel(id: &str, rows: &[Row]) -> Option<Panel> {
    let end = format!("/{id}");
    let own: Vec<&Row> = rows.iter().filter(|row| row.id.ends_with(&end)).collect();
    // Numbers too large to be printed are moved to the end of the axis.
    let place = |row: &Row, number: Option<f64>| number.map(|value| along(&row.quantity, value));
    let numbers = own
        .iter()
        .flat_map(|row| [row.low, row.high, row.paper].map(|value| place(row, value)));
    let (low, high) = range(numbers.flatten())?;
    let room = 0.05 * (high - low).max(1e-9);
    let name = |row: &&Row| row.id.trim_end_matches(&end).to_owned();
    let names = own
        .iter()
        .map(|row| truncate(11.0, &name(row), NAME, false));
    let y = Axis::rows("", names);
    let title = match find_measure(id) {
        None => id.to_owned(),
        Some(Measure {
            quantity, unit: "", ..
        }) => (*quantity).to_owned(),
        Some(Measure { quantity, unit, .. }) => format!("{quantity} ({unit})"),
    };
    let x = Axis::linear("", (low - room, high + room), 6.0);
    let mut panel = Panel::new(&title, x, y, own.len() as f64 * 18.0);
    for (at, row) in own.iter().enumerate() {
        let at = at as f64;
        if let (Some(low), Some(high)) = (place(row, row.low), place(row, row.high)) {
            let line = Mark::Line(vec![(low, at), (high, at)], stroke(PALETTE[0], 2.0));
            panel.marks.push(line);
        }
        let dots = [
            (place(row, row.ours), Shape::Disc, PALETTE[0]),
            (row.paper, Shape::Diamond, PALETTE[1]),
        ];
        for (value, shape, color) in dots {
            let dot = |x| Mark::Dot((x, at), shape, 4.5, Paint::Full(color));
            panel.marks.extend(value.map(dot));
        }
    }
    Some(panel)
}
