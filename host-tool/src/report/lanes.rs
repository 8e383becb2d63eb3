//! Amplitudes and predicted forces: a grid with a column per trial and a row
//! per channel, so that ten channels stay readable and units never mix.

use super::canvas::{
    Area, ChannelMark, Drawn, GRID, INK, MUTED, WIDTH, anchored, bold, channel_mark, line, px,
    shortened, svg, text,
};
use super::series::{Point, range, round_step, shorten};
use super::tables::seconds;
use super::trajectory::end_s;
use crate::record::{ChannelInfo, Sample, Trial};
use plotters::prelude::*;
use plotters::style::text_anchor::HPos;

const LABELS: i32 = 150;
const TITLE: i32 = 26;
const ROW: i32 = 58;
const AXIS: i32 = 50;
const GUTTER: i32 = 28;
/// Columns side by side; more trials continue below.
const COLUMNS: usize = 3;
/// As many as a third of a screen can show.
const BUCKETS: usize = 200;

/// Picks what a row shows of a sample.
type Value = dyn Fn(&Trial, &Sample) -> Option<f64>;

/// One row of the grid.
struct Lane {
    name: String,
    /// What the row shows, with its unit.
    unit: String,
    /// Top of the scale.
    top: f64,
    /// Drawn as a line, if the row has one.
    limit: Option<f64>,
    mark: ChannelMark,
    value: Box<Value>,
    /// What it should be, if anything says so: a dark line.
    wanted: Option<Box<Value>>,
}

/// Amplitude of every channel over time, or nothing without channels.
pub(super) fn amplitudes(trials: &[Trial]) -> String {
    let lanes = channels(trials).into_iter().map(|channel| {
        let number = channel.number;
        let value = move |trial: &Trial, sample: &Sample| {
            let column = column(trial, number)?;
            // A channel that plays nothing puts out nothing.
            let amplitude = sample.amplitudes.get(column)?;
            Some(amplitude.unwrap_or(0.0))
        };
        Lane {
            name: format!("{number} {}", channel.name),
            unit: format!("amplitude ({})", channel.unit),
            top: largest(trials, &value).max(channel.limit) * 1.08,
            limit: Some(channel.limit),
            mark: channel_mark(number),
            value: Box::new(value),
            wanted: None,
        }
    });
    let lanes: Vec<Lane> = lanes.collect();
    grid(trials, &lanes, "Amplitude of every channel over time")
}

/// Predicted force of every channel with a muscle over time, and the wanted one
/// where it is controlled; nothing without muscles.
pub(super) fn forces(trials: &[Trial]) -> String {
    let force = |n: u8| move |trial: &Trial, sample: &Sample| trial.force_n(sample, n);
    let wanted = |n: u8| move |trial: &Trial, sample: &Sample| trial.wanted_n(sample, n);
    let rows = || channels(trials).into_iter().filter(|c| c.muscle);
    // One scale for all, or small forces would look as large as big ones.
    let tops = rows().flat_map(|c| {
        let predicted = largest(trials, &force(c.number));
        [predicted, largest(trials, &wanted(c.number))]
    });
    let most = tops.fold(0.0, f64::max);
    let step = round_step(most, 2.0);
    let lanes = rows().map(|channel| Lane {
        name: format!("{} {}", channel.number, channel.name),
        unit: "force (N)".to_owned(),
        top: (most / step).ceil() * step * 1.08,
        limit: None,
        mark: channel_mark(channel.number),
        value: Box::new(force(channel.number)),
        wanted: Some(Box::new(wanted(channel.number))),
    });
    let lanes: Vec<Lane> = lanes.collect();
    grid(trials, &lanes, "Predicted force over time")
}

/// Pulse rate of every channel under force control over time, or nothing.
pub(super) fn rates(trials: &[Trial]) -> String {
    let rate = |n: u8| move |trial: &Trial, sample: &Sample| trial.rate_hz(sample, n);
    let rows = || channels(trials).into_iter().filter(|c| c.force);
    let tops = rows().map(|c| largest(trials, &rate(c.number)));
    let most = tops.fold(0.0, f64::max);
    let step = round_step(most, 2.0);
    let lanes = rows().map(|channel| Lane {
        name: format!("{} {}", channel.number, channel.name),
        unit: "rate (Hz)".to_owned(),
        top: (most / step).ceil() * step * 1.08,
        limit: None,
        mark: channel_mark(channel.number),
        value: Box::new(rate(channel.number)),
        wanted: None,
    });
    let lanes: Vec<Lane> = lanes.collect();
    grid(trials, &lanes, "Pulse rate over time")
}

/// The channels of all trials, each once, lowest number first.
fn channels(trials: &[Trial]) -> Vec<&ChannelInfo> {
    let all = trials.iter().flat_map(|trial| &trial.channels);
    let mut channels: Vec<&ChannelInfo> = all.collect();
    channels.sort_by_key(|channel| channel.number);
    channels.dedup_by_key(|channel| channel.number);
    channels
}

/// Where a trial keeps the values of a channel.
fn column(trial: &Trial, number: u8) -> Option<usize> {
    trial.channels.iter().position(|c| c.number == number)
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
    let columns = trials.len().min(COLUMNS) as i32;
    svg(block * blocks.len() as i32, description, |root| {
        for (position, trials) in blocks.iter().enumerate() {
            let top = position as i32 * block;
            let area = root.clone().shrink((0, px(top)), (px(WIDTH), px(block)));
            draw_block(&area, trials, lanes, (end_s, columns))?;
        }
        Ok(())
    })
}

/// `columns` is how many trials the widest block holds: a lone trial below others
/// keeps their scale of time.
fn draw_block(
    area: &Area<'_>,
    trials: &[Trial],
    lanes: &[Lane],
    (end_s, columns): (f64, i32),
) -> Drawn {
    for (row, lane) in lanes.iter().enumerate() {
        row_label(area, lane, TITLE + row as i32 * ROW)?;
    }
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
    let name = shortened(13, &lane.name, LABELS - 46);
    area.draw(&Circle::new(
        (px(6), px(middle - 8)),
        px(5),
        lane.mark.dot(),
    ))?;
    area.draw(&Text::new(name, (px(18), px(middle - 8)), text(13, INK)))?;
    area.draw(&Text::new(
        lane.unit.as_str(),
        (px(18), px(middle + 9)),
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
    let parts = shorten(points, BUCKETS);
    if parts.is_empty() {
        let middle = (px(4), px(ROW / 2 + 4));
        area.draw(&Text::new("not used", middle, text(11, MUTED)))?;
    }
    for part in parts {
        let tint = lane.mark.tint();
        chart.draw_series(tint.map(|tint| Polygon::new(closed(&part), tint)))?;
        chart.draw_series([PathElement::new(part, line(lane.mark.color, 13))])?;
    }
    if let Some(wanted) = &lane.wanted {
        let samples = trial.samples.iter();
        let points = samples.filter_map(|s| Some((s.t_s, wanted(trial, s)?)));
        for part in shorten(points, BUCKETS) {
            // On top, or a force that follows well would hide it.
            chart.draw_series([PathElement::new(part, line(INK, 10))])?;
        }
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
