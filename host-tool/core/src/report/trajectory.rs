//! Reference and measured angle over time, one panel per trial.

use super::tables::{degrees, seconds};
use crate::analysis::{metrics_without_lag, wall_contacts};
use crate::plot::ink::{INK, PALETTE, SHADE};
use crate::plot::series::{range, round_step, shorten_together};
use crate::plot::{At, Axis, Figure, Key, Mark, Paint, Panel, Stroke, Svg, ink::stroke};
use crate::record::{Sample, Samples, Trial, WallPlace};

const HEIGHT: f64 = 130.0;
/// Number of groups of points to which a curve is reduced; each group keeps at most two points.
/// That is finer than a screen can show, and still makes a small page.
const BUCKETS: usize = 600;
/// Largest number of panels that are drawn in one column. More panels are drawn in two columns, so
/// that they fit on the first screen.
const ONE_COLUMN: usize = 3;
const MEASURED: Stroke = stroke(PALETTE[0], 1.8);
const TARGET: Stroke = stroke(INK, 1.0);

/// Function that selects an angle of a sample, degrees, such as the measured one; `None` if it is
/// not known.
pub(super) type Angle = fn(&Sample) -> Option<f64>;

/// Returns the end of the time axis, s: the latest time that any trial has recorded or planned. It
/// is never 0.
pub(super) fn end_s(trials: &[Trial]) -> f64 {
    let last = |trial: &Trial| trial.samples.last().map_or(0.0, |sample| sample.t_s);
    let ends = trials.iter().map(|trial| last(trial).max(trial.duration_s));
    ends.filter(|end| end.is_finite())
        .fold(0.0, f64::max)
        .max(0.01)
}

/// Returns the curves of angles over the time from `from_s` to `to_s`, each as a line for every
/// uninterrupted part. `buckets` limits the number of points of each. Reads the samples twice,
/// however many angles there are.
pub(super) fn curves<const N: usize>(
    samples: &Samples,
    (from_s, to_s): (f64, f64),
    lines: [(Stroke, Angle); N],
    buckets: usize,
) -> impl Iterator<Item = Mark> {
    let angles = |s: &Sample| lines.map(|(_, angle)| Some((s.t_s, angle(s)?)));
    let points = samples.map_each(|sample| {
        let is_shown = (from_s..=to_s).contains(&sample.t_s);
        is_shown.then(|| angles(sample))
    });
    let parts = shorten_together(points.flatten(), buckets);
    let drawn = parts.into_iter().zip(lines);
    drawn.flat_map(|(parts, (stroke, _))| parts.into_iter().map(move |p| Mark::Line(p, stroke)))
}

/// Data of a trial that the figure needs. The samples themselves are not kept.
#[derive(Clone, Debug)]
pub(super) struct TrialTrace {
    /// Name of the trial, above its panel.
    pub name: String,
    result: String,
    joint: bool,
    wall: Option<WallPlace>,
    measure: Option<(f64, f64)>,
    /// Latest time that the trial has recorded or planned, s.
    end_s: f64,
    /// Smallest and largest reference or measured angle, degrees; `None` without angles.
    angles: Option<(f64, f64)>,
    curves: Vec<Mark>,
}

impl TrialTrace {
    /// Extracts the data of a trial that the figure needs.
    pub(super) fn from_trial(trial: &Trial) -> Self {
        let lines: [(Stroke, Angle); 2] = [
            (MEASURED, |s| s.measured_deg),
            // The reference is on top, because a joint that follows well would otherwise hide it.
            (TARGET, |s| s.target_deg),
        ];
        // Without joint or wall no row has an angle, so that the samples need not be read.
        let has_angle = trial.joint || trial.wall.is_some();
        let curves = has_angle.then(|| {
            let always = (f64::NEG_INFINITY, f64::INFINITY);
            curves(&trial.samples, always, lines, BUCKETS)
        });
        let angles = has_angle.then(|| {
            let angles = |s: &Sample| [s.target_deg, s.measured_deg];
            trial.samples.map_each(angles).flatten().flatten()
        });
        Self {
            name: trial.name.clone(),
            result: result(trial),
            joint: trial.joint,
            wall: trial.wall,
            measure: trial.measure,
            end_s: end_s(std::slice::from_ref(trial)),
            angles: range(angles.into_iter().flatten()),
            curves: curves.into_iter().flatten().collect(),
        }
    }

    /// Returns a copy of the data in which the trial has another name.
    pub(super) fn with_name(&self, name: String) -> Self {
        Self {
            name,
            ..self.clone()
        }
    }

    /// Returns whether the figure has a panel for the trial: whether it controlled a joint or
    /// rendered a virtual wall.
    pub(super) const fn has_angle(&self) -> bool {
        self.joint || self.wall.is_some()
    }
}

/// Draws reference and measured angle over time for each trial; an empty figure if no trial
/// controlled a joint or rendered a wall.
pub(super) fn figure(trials: &[Trial]) -> Svg {
    let has_angle = |trial: &Trial| trial.joint || trial.wall.is_some();
    if !trials.is_empty() && !trials.iter().any(has_angle) {
        return Svg::default();
    }
    figure_from_traces(
        &trials
            .iter()
            .map(TrialTrace::from_trial)
            .collect::<Vec<_>>(),
    )
}

/// Draws the same figure as [`figure`], for trials whose samples are no longer in memory.
pub(super) fn figure_from_traces(trials: &[TrialTrace]) -> Svg {
    // All panels share their scales, so that they can be compared at a glance.
    let angles = trials.iter().filter_map(|trial| trial.angles);
    let (low, high) = range(angles.flat_map(|(low, high)| [low, high])).unwrap_or((0.0, 90.0));
    let step = round_step((high - low).max(1.0), 4.0);
    let ends = (
        (low / step).floor() * step,
        ((high / step).floor() + 1.0) * step,
    );
    let end_s = trials.iter().map(|trial| trial.end_s).fold(0.01, f64::max);
    let panel = |n: usize, is_last: bool| {
        let x = Axis {
            grid: false,
            ..Axis::linear("time (s)", (0.0, end_s), 10.0).hide_labels(!is_last)
        };
        panel(&trials[n], x, Axis::linear("angle (°)", ends, 5.0))
    };
    // Panels fill the first column from top to bottom, then the second.
    let columns = if trials.len() > ONE_COLUMN { 2 } else { 1 };
    let rows = trials.len().div_ceil(columns);
    let row = |r: usize| {
        let own = (0..columns).map(|c| c * rows + r);
        let own = own.filter(|n| *n < trials.len());
        own.map(|n| panel(n, (n + 1) % rows == 0 || n + 1 == trials.len()))
            .collect()
    };
    Figure {
        description: "Reference and measured angle over time".to_owned(),
        legend: legend(trials),
        rows: (0..rows).map(row).collect(),
        ..Figure::default()
    }
    .svg()
}

fn legend(trials: &[TrialTrace]) -> Vec<(Key, String)> {
    let walls = || trials.iter().filter_map(|trial| trial.wall);
    let shade = Key::Box(Paint::Full(SHADE));
    let target = match (walls().next(), trials.iter().any(|trial| trial.joint)) {
        (Some(_), true) => "reference or wall",
        (Some(_), false) => "wall",
        (None, _) => "reference",
    };
    let mut keys = vec![
        (Key::Line(TARGET), target),
        (Key::Line(MEASURED), "measured"),
    ];
    if walls().any(|wall| wall.pre_wall_deg > 0.0) {
        keys.push((shade, "pre-wall"));
    }
    if trials.iter().any(|trial| trial.measure.is_some()) {
        keys.push((shade, "not counted in the RMSE"));
    }
    keys.into_iter()
        .map(|(key, name)| (key, name.to_owned()))
        .collect()
}

fn panel(trial: &TrialTrace, x: Axis, y: Axis) -> Panel {
    let full_range = (f64::NEG_INFINITY, f64::INFINITY);
    let mut shaded: Vec<(At, At)> = Vec::new();
    if let Some((from, to)) = trial.measure {
        shaded.extend([
            ((full_range.0, from), full_range),
            ((to, full_range.1), full_range),
        ]);
    }
    if let Some(wall) = trial.wall {
        let front = if wall.stops_flexion { -1.0 } else { 1.0 } * wall.pre_wall_deg;
        shaded.push((full_range, (wall.at_deg + front, wall.at_deg)));
    }
    let area = |(across, up)| Mark::Area(across, up, Paint::Full(SHADE));
    Panel {
        result: trial.result.clone(),
        ground: shaded.into_iter().map(area).collect(),
        marks: trial.curves.clone(),
        ..Panel::new(&trial.name, x, y, HEIGHT)
    }
}

/// Describes the result of a trial in a few words, for the title line of its panel.
fn result(trial: &Trial) -> String {
    match (trial.wall, metrics_without_lag(trial)) {
        (Some(_), _) => deepest_contacts(trial),
        (None, Some(m)) => {
            let (from, to) = (seconds(m.from_s), seconds(m.to_s));
            format!("RMSE {} ({from}–{to} s)", degrees(m.rmse_deg))
        }
        (None, None) if trial.samples.is_empty() => "no samples".to_owned(),
        (None, None) if trial.has_reference() => "not evaluated".to_owned(),
        (None, None) => "open loop".to_owned(),
    }
}

/// Describes the deepest penetration in each hit of a virtual wall.
fn deepest_contacts(trial: &Trial) -> String {
    let depths = wall_contacts(trial)
        .into_iter()
        .map(|hit| degrees(hit.deepest_deg));
    let depths: Vec<String> = depths.collect();
    if depths.is_empty() {
        return "not touched".to_owned();
    }
    format!("deepest {}", depths.join(", "))
}
