//! Amplitudes and predicted forces: a grid with a column per trial and a row
//! per channel, so that ten channels stay readable and units never mix.

use super::canvas::{
    Area, Drawn, GRID, INK, MUTED, PALETTE, WIDTH, anchored, bold, line, px, svg, text,
};
use super::series::{Point, range, round_step, shorten};
use super::tables::seconds;
use super::trajectory::end_s;
use crate::record::{Sample, Trial};
use plotters::prelude::*;
use plotters::style::text_anchor::HPos;

const LABELS: i32 = 150;
const TITLE: i32 = 26;
const ROW: i32 = 58;
const AXIS: i32 = 42;
const GUTTER: i32 = 16;
/// Columns side by side; more trials continue below.
const COLUMNS: usize = 3;

/// One row of the grid.
struct Lane {
    name: String,
    unit: String,
    /// Top of the scale.
    top: f64,
    /// Drawn as a line, if the row has one.
    limit: Option<f64>,
    color: RGBColor,
    value: Box<dyn Fn(&Trial, &Sample) -> Option<f64>>,
}

/// Amplitude of every channel over time, or nothing without channels.
pub(super) fn amplitudes(trials: &[Trial]) -> String {
    let mut lanes: Vec<Lane> = Vec::new();
    for channel in trials.iter().flat_map(|trial| &trial.channels) {
        if lanes
            .iter()
            .any(|lane| lane.name.starts_with(&format!("{} ", channel.number)))
        {
            continue;
        }
        let number = channel.number;
        let value = move |trial: &Trial, sample: &Sample| {
            let column = trial.channels.iter().position(|c| c.number == number)?;
            sample.amplitudes.get(column).copied()
        };
        let most = largest(trials, &value).max(channel.limit);
        lanes.push(Lane {
            name: format!("{number} {}", channel.name),
            unit: channel.unit.clone(),
            top: most * 1.08,
            limit: Some(channel.limit),
            color: PALETTE[lanes.len() % PALETTE.len()],
            value: Box::new(value),
        });
    }
    grid(trials, &lanes, "Amplitude of every channel over time")
}

/// Every predicted force over time, or nothing without any.
pub(super) fn forces(trials: &[Trial]) -> String {
    let samples = trials.iter().flat_map(|trial| &trial.samples);
    let count = samples.map(|s| s.forces_n.len()).max().unwrap_or(0);
    let value = |column: usize| move |_: &Trial, s: &Sample| s.forces_n.get(column).copied();
    // One scale for all, or small forces would look as large as big ones.
    let most = (0..count).map(|column| largest(trials, &value(column)));
    let most = most.fold(0.0, f64::max);
    let step = round_step(most, 2.0);
    let lanes: Vec<Lane> = (0..count)
        .map(|column| Lane {
            name: force_name(trials, column, count),
            unit: "N".to_owned(),
            top: (most / step).ceil() * step * 1.08,
            limit: None,
            color: PALETTE[column % PALETTE.len()],
            value: Box::new(value(column)),
        })
        .collect();
    grid(trials, &lanes, "Predicted force over time")
}

/// The channel's name where every channel has a force, else a plain count.
fn force_name(trials: &[Trial], column: usize, count: usize) -> String {
    let trial = trials.iter().find(|trial| trial.channels.len() == count);
    let channel = trial.and_then(|trial| trial.channels.get(column));
    channel.map_or(format!("muscle {}", column + 1), |c| {
        format!("{} {}", c.number, c.name)
    })
}

fn largest(trials: &[Trial], value: &impl Fn(&Trial, &Sample) -> Option<f64>) -> f64 {
    let of_trial = |trial: &Trial| range(trial.samples.iter().filter_map(|s| value(trial, s)));
    let tops = trials.iter().filter_map(of_trial).map(|(_, high)| high);
    tops.fold(1e-3, f64::max)
}

fn grid(trials: &[Trial], lanes: &[Lane], description: &str) -> String {
    let blocks: Vec<&[Trial]> = trials.chunks(COLUMNS).collect();
    if lanes.is_empty() || blocks.is_empty() {
        return String::new();
    }
    let block = TITLE + lanes.len() as i32 * ROW + AXIS;
    let end_s = end_s(trials);
    svg(block * blocks.len() as i32, description, |root| {
        for (position, trials) in blocks.iter().enumerate() {
            let top = position as i32 * block;
            let area = root.clone().shrink((0, px(top)), (px(WIDTH), px(block)));
            draw_block(&area, trials, lanes, end_s)?;
        }
        Ok(())
    })
}

fn draw_block(area: &Area<'_>, trials: &[Trial], lanes: &[Lane], end_s: f64) -> Drawn {
    for (row, lane) in lanes.iter().enumerate() {
        row_label(area, lane, TITLE + row as i32 * ROW)?;
    }
    let columns = trials.len() as i32;
    let width = (WIDTH - LABELS - 12 - GUTTER * (columns - 1)) / columns;
    for (column, trial) in trials.iter().enumerate() {
        let left = LABELS + column as i32 * (width + GUTTER);
        let title = (px(left), px(TITLE / 2 - 2));
        area.draw(&Text::new(trial.name.as_str(), title, bold(text(13, INK))))?;
        for (row, lane) in lanes.iter().enumerate() {
            let is_last = row + 1 == lanes.len();
            let height = ROW + if is_last { AXIS } else { 0 };
            let at = (px(left), px(TITLE + row as i32 * ROW));
            let cell = area.clone().shrink(at, (px(width), px(height)));
            draw_cell(&cell, trial, lane, end_s, is_last)?;
        }
    }
    Ok(())
}

/// Name and unit at the left, 0 and the top of the scale beside the first column.
fn row_label(area: &Area<'_>, lane: &Lane, top: i32) -> Drawn {
    let middle = top + ROW / 2;
    let name: String = lane.name.chars().take(17).collect();
    area.draw(&Text::new(name, (px(0), px(middle - 8)), text(13, INK)))?;
    area.draw(&Text::new(
        lane.unit.as_str(),
        (px(0), px(middle + 9)),
        text(12, MUTED),
    ))?;
    let tick = anchored(text(11, MUTED), HPos::Right);
    let scale = lane.limit.unwrap_or(lane.top / 1.08);
    let height = f64::from(ROW - 8);
    let at = top + ROW - (height * scale / lane.top) as i32;
    area.draw(&Text::new(
        "0",
        (px(LABELS - 5), px(top + ROW - 4)),
        tick.clone(),
    ))?;
    area.draw(&Text::new(number(scale), (px(LABELS - 5), px(at)), tick))?;
    Ok(())
}

fn draw_cell(area: &Area<'_>, trial: &Trial, lane: &Lane, end_s: f64, is_last: bool) -> Drawn {
    let mut chart = ChartBuilder::on(area)
        .margin_top(px(8))
        .set_label_area_size(
            LabelAreaPosition::Bottom,
            px(if is_last { AXIS } else { 0 }),
        )
        .build_cartesian_2d(0.0..end_s, 0.0..lane.top)?;
    let scale = lane.limit.unwrap_or(lane.top / 1.08);
    for level in [0.0, scale] {
        let ends = [(0.0, level), (end_s, level)];
        chart.draw_series([PathElement::new(ends, line(GRID, 10))])?;
    }
    let values = trial.samples.iter();
    let points = values.filter_map(|s| Some((s.t_s, (lane.value)(trial, s)?)));
    for part in shorten(points, 200) {
        chart.draw_series([Polygon::new(closed(&part), lane.color.mix(0.22).filled())])?;
        chart.draw_series([PathElement::new(part, line(lane.color, 13))])?;
    }
    if is_last {
        let mut mesh = chart.configure_mesh();
        mesh.disable_mesh()
            .disable_y_axis()
            .axis_style(line(GRID, 10))
            .x_labels(6)
            .x_label_formatter(&|t| seconds(*t))
            .label_style(text(11, MUTED))
            .axis_desc_style(text(12, INK))
            .x_desc("time (s)");
        mesh.draw()?;
    }
    Ok(())
}

/// The signal closed along zero, to be filled.
fn closed(points: &[Point]) -> Vec<Point> {
    let foot = |point: Option<&Point>| point.map(|(t, _)| (*t, 0.0));
    let corners = foot(points.last()).into_iter().chain(foot(points.first()));
    points.iter().copied().chain(corners).collect()
}

fn number(value: f64) -> String {
    if value >= 10.0 {
        format!("{value:.0}")
    } else {
        format!("{}", (value * 100.0).round() / 100.0)
    }
}
