//! Target and measured angle over time, one panel a trial.

use super::canvas::{
    Area, Drawn, GRID, INK, Key, MUTED, PALETTE, SHADE, WIDTH, anchored, bold, legend, line, px,
    svg, text,
};
use super::series::{range, round_step, shorten};
use super::tables::{degrees, seconds};
use crate::analysis::{hits, metrics};
use crate::record::{Sample, Trial};
use plotters::prelude::*;
use plotters::style::text_anchor::HPos;

const LEGEND: i32 = 30;
const TITLE: i32 = 24;
const PANEL: i32 = 138;
const AXIS: i32 = 42;
const LEFT: i32 = 58;
/// Keeps rotated text inside the figure.
const EDGE: i32 = 6;
/// Between a panel and the title of the next.
const GAP: i32 = 8;
/// More than a screen shows, few enough for a small page.
const BUCKETS: usize = 600;

/// Picks an angle of a sample, degrees, if it is known.
type Angle = fn(&Sample) -> Option<f64>;

/// Ranges shared by all panels, so that they compare at a glance.
struct Axes {
    end_s: f64,
    low_deg: f64,
    high_deg: f64,
}

impl Axes {
    fn of(trials: &[Trial]) -> Self {
        let samples = || trials.iter().flat_map(|trial| &trial.samples);
        let angles = samples().flat_map(|s| [s.target_deg, s.measured_deg]);
        let (low, high) = range(angles.flatten()).unwrap_or((0.0, 90.0));
        let step = round_step((high - low).max(1.0), 4.0);
        Axes {
            end_s: end_s(trials),
            low_deg: (low / step).floor() * step,
            high_deg: ((high / step).floor() + 1.0) * step,
        }
    }
}

/// The last recorded or planned moment of any trial, s; never zero.
pub(super) fn end_s(trials: &[Trial]) -> f64 {
    let last = |trial: &Trial| trial.samples.last().map_or(0.0, |sample| sample.t_s);
    let ends = trials.iter().map(|trial| last(trial).max(trial.duration_s));
    ends.filter(|end| end.is_finite())
        .fold(0.0, f64::max)
        .max(0.01)
}

/// Panels beyond this number are set in two columns, or the first screen would not hold them.
const ONE_COLUMN: usize = 3;

/// The main figure; nothing where no angle matters.
pub(super) fn figure(trials: &[Trial]) -> String {
    let has_angle = |trial: &Trial| trial.joint || trial.wall.is_some();
    if !trials.is_empty() && !trials.iter().any(has_angle) {
        return String::new();
    }
    let columns = if trials.len() > ONE_COLUMN { 2 } else { 1 };
    let rows = trials.len().div_ceil(columns).max(1);
    let axes = Axes::of(trials);
    let height = LEGEND + rows as i32 * (TITLE + PANEL) + AXIS;
    svg(height, "Target and measured angle over time", |root| {
        let is_wall = trials.iter().any(|trial| trial.wall.is_some());
        let target = if is_wall { "wall" } else { "target" };
        let mut keys = vec![
            (Key::Line(line(INK, 10)), target),
            (Key::Line(line(PALETTE[0], 18)), "measured"),
        ];
        if trials
            .iter()
            .filter_map(|t| t.wall)
            .any(|w| w.pre_wall_deg > 0.0)
        {
            keys.push((Key::Box(SHADE.filled()), "pre-wall"));
        }
        if trials.iter().any(|trial| trial.measure.is_some()) {
            keys.push((Key::Box(SHADE.filled()), "not counted in the RMSE"));
        }
        legend(root, LEFT, 12, &keys)?;
        // Down the first column, then down the second.
        for (column, trials) in trials.chunks(rows).enumerate() {
            let width = WIDTH / columns as i32;
            let left = column as i32 * width;
            for (row, trial) in trials.iter().enumerate() {
                let top = LEGEND + row as i32 * (TITLE + PANEL);
                let is_last = row + 1 == trials.len();
                let height = TITLE + PANEL + if is_last { AXIS } else { 0 };
                let area = root
                    .clone()
                    .shrink((px(left), px(top)), (px(width), px(height)));
                heading(&area, trial, width)?;
                panel(&area, trial, &axes, is_last)?;
            }
        }
        Ok(())
    })
}

/// Name at the left, RMSE at the right.
fn heading(area: &Area<'_>, trial: &Trial, width: i32) -> Drawn {
    let middle = px(TITLE / 2 + 1);
    let name = Text::new(trial.name.as_str(), (px(LEFT), middle), bold(text(14, INK)));
    area.draw(&name)?;
    let judged = match (trial.wall, metrics(trial)) {
        (Some(_), _) => deepest(trial),
        (None, Some(m)) => {
            let (from, to) = (seconds(m.from_s), seconds(m.to_s));
            format!("RMSE {} ({from}–{to} s)", degrees(m.rmse_deg))
        }
        (None, None) if trial.samples.is_empty() => "no samples".to_owned(),
        (None, None) => "open loop".to_owned(),
    };
    let right = anchored(bold(text(14, PALETTE[0])), HPos::Right);
    area.draw(&Text::new(judged, (px(width - 12), middle), right))?;
    Ok(())
}

/// The deepest penetration of each hit of a wall.
fn deepest(trial: &Trial) -> String {
    let depths = hits(trial).into_iter().map(|hit| degrees(hit.deepest_deg));
    let depths: Vec<String> = depths.collect();
    if depths.is_empty() {
        return "not touched".to_owned();
    }
    format!("deepest {}", depths.join(", "))
}

fn panel(area: &Area<'_>, trial: &Trial, axes: &Axes, is_last: bool) -> Drawn {
    let below = if is_last { AXIS } else { 0 };
    let mut chart = ChartBuilder::on(area)
        .margin_top(px(TITLE))
        .margin_left(px(EDGE))
        .margin_right(px(12))
        .margin_bottom(px(GAP))
        .set_label_area_size(LabelAreaPosition::Left, px(LEFT - EDGE))
        .set_label_area_size(LabelAreaPosition::Bottom, px(below))
        .build_cartesian_2d(0.0..axes.end_s, axes.low_deg..axes.high_deg)?;
    for (from, to) in uncounted(trial, axes.end_s) {
        let corners = [(from, axes.low_deg), (to, axes.high_deg)];
        chart.draw_series([Rectangle::new(corners, SHADE.filled())])?;
    }
    if let Some(wall) = trial.wall {
        let front = if wall.stops_flexion { -1.0 } else { 1.0 } * wall.pre_wall_deg;
        let corners = [(0.0, wall.at_deg + front), (axes.end_s, wall.at_deg)];
        chart.draw_series([Rectangle::new(corners, SHADE.filled())])?;
    }
    let mut mesh = chart.configure_mesh();
    mesh.disable_x_mesh()
        .light_line_style(TRANSPARENT)
        .bold_line_style(line(GRID, 8))
        .axis_style(line(GRID, 10))
        // Below the 0 of the other axis.
        .set_tick_mark_size(LabelAreaPosition::Bottom, px(5))
        .x_labels(10)
        .y_labels(5)
        .x_label_formatter(&|t| seconds(*t))
        .y_label_formatter(&|angle| format!("{angle:.0}"))
        .label_style(text(12, MUTED))
        .axis_desc_style(text(12, INK))
        .y_desc("angle (°)");
    if is_last {
        mesh.x_desc("time (s)");
    }
    mesh.draw()?;
    let curves: [(Angle, ShapeStyle); 2] = [
        (|s| s.measured_deg, line(PALETTE[0], 18)),
        // On top, or a joint that follows well would hide its target.
        (|s| s.target_deg, line(INK, 10)),
    ];
    for (angle, style) in curves {
        let samples = trial.samples.iter();
        let points = samples.filter_map(|s| Some((s.t_s, angle(s)?)));
        for part in shorten(points, BUCKETS) {
            chart.draw_series([PathElement::new(part, style)])?;
        }
    }
    Ok(())
}

/// The parts of a trial outside its measured window.
fn uncounted(trial: &Trial, end_s: f64) -> Vec<(f64, f64)> {
    let Some((from, to)) = trial.measure else {
        return Vec::new();
    };
    let parts = [(0.0, from.min(end_s)), (to.max(0.0), end_s)];
    parts.into_iter().filter(|(from, to)| to > from).collect()
}
