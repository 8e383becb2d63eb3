//! Amplitudes and predicted forces over time: a panel per trial with a row per channel, so that ten
//! channels stay readable and units never mix.

use super::trajectory::end_s;
use crate::plot::axis::Head;
use crate::plot::ink::{ChannelMark, INK, channel_mark, stroke};
use crate::plot::series::{Point, ShortenedSeries, round_step};
use crate::plot::{Axis, Figure, Mark, Panel, Scale, Svg};
use crate::record::{ChannelInfo, Sample, Trial};

/// Height of the row of a channel, pixels.
const ROW: f64 = 58.0;
/// Distance of the zero line below the middle of a row, as a share of the row's height.
const ZERO: f64 = 0.42;
/// Height of the top of the scale above the zero line, as a share of the row's height.
const REACH: f64 = 0.76;
/// Maximum number of panels side by side; the panels of further trials are drawn below them.
const COLUMNS: usize = 3;
/// Number of groups of points to which a curve is reduced; each group keeps at most two points.
const BUCKETS: usize = 200;

/// Quantity of a channel that a row shows.
#[derive(Clone, Copy)]
enum Value {
    /// Amplitude; 0 while the channel outputs nothing.
    Amplitude,
    /// Force that the muscle model predicts.
    Force,
    /// Force that the setpoint requests.
    Wanted,
    /// Pulse rate that force control sets.
    Rate,
}

/// Where the samples of a trial have a quantity of a channel: the quantity and its index in the
/// sample's list. The index is `None` if the trial does not have the quantity.
struct Source {
    value: Value,
    place: Option<usize>,
}

/// Number and maximum of a quantity's values over a trial.
#[derive(Clone, Copy, Default)]
struct Survey {
    /// Number of samples that have a value of the quantity.
    count: usize,
    largest: Option<f64>,
}

impl Source {
    /// Returns where the samples of `trial` have each of `values` for each of these channels. The
    /// order is by channel, and within a channel by `values`.
    fn for_channels(trial: &Trial, channels: &[u8], values: &[Value]) -> Vec<Self> {
        let source = |value: Value, channel: u8| Self {
            value,
            place: trial.channel_index(
                channel,
                match value {
                    Value::Amplitude => |_| true,
                    Value::Force => |c| c.muscle,
                    Value::Wanted | Value::Rate => |c| c.force,
                },
            ),
        };
        let of_channel = |channel: &u8| {
            let channel = *channel;
            values.iter().map(move |value| source(*value, channel))
        };
        channels.iter().flat_map(of_channel).collect()
    }

    /// Returns the value of the quantity in a sample; `None` if it has none.
    fn value_in(&self, sample: &Sample) -> Option<f64> {
        let known = |values: &[Option<f64>]| values.get(self.place?).copied();
        match self.value {
            Value::Amplitude => Some(known(&sample.amplitudes)?.unwrap_or(0.0)),
            Value::Force => known(&sample.forces_n)?,
            Value::Wanted => known(&sample.wanted_n)?,
            Value::Rate => known(&sample.rates_hz)?,
        }
    }
}

/// Returns for each trial the number and maximum of each quantity, in the order of
/// [`Source::for_channels`]. Reads each trial only once, because its samples must be decompressed.
fn surveys(trials: &[Trial], channels: &[u8], values: &[Value]) -> Vec<Vec<Survey>> {
    let of_trial = |trial: &Trial| {
        let sources = Source::for_channels(trial, channels, values);
        let mut surveys = vec![Survey::default(); sources.len()];
        let mut samples = trial.samples.reader();
        while let Some(sample) = samples.next_sample() {
            if !sample.t_s.is_finite() {
                continue;
            }
            for (survey, source) in surveys.iter_mut().zip(&sources) {
                if let Some(value) = source.value_in(sample).filter(|value| value.is_finite()) {
                    survey.count += 1;
                    let largest = survey.largest.unwrap_or(value);
                    survey.largest = Some(largest.max(value));
                }
            }
        }
        surveys
    };
    trials.iter().map(of_trial).collect()
}

/// Row of a panel, which shows a channel over time.
struct Lane {
    number: u8,
    name: String,
    /// Name of the quantity that the row shows, with its unit.
    unit: String,
    /// Value at the top of the row's scale.
    top: f64,
    /// Value at which the row has a tick, besides the tick at 0.
    scale: f64,
}

/// Draws the amplitude of every channel over time; an empty figure without channels.
pub(super) fn amplitudes(trials: &[Trial]) -> Svg {
    let values = [Value::Amplitude];
    let channels = channels(trials);
    let numbers: Vec<u8> = channels.iter().map(|channel| channel.number).collect();
    let surveys = surveys(trials, &numbers, &values);
    let lane = |(row, channel): (usize, &&ChannelInfo)| {
        let of_row = surveys
            .iter()
            .filter_map(|trial_surveys| trial_surveys.get(row)?.largest);
        let top = of_row.fold(1e-3, f64::max).max(channel.limit);
        let unit = format!("amplitude ({})", channel.unit);
        Lane::new(channel, unit, top, channel.limit)
    };
    let lanes: Vec<Lane> = channels.iter().enumerate().map(lane).collect();
    grid(
        trials,
        &lanes,
        "Amplitude of every channel over time",
        (&values, &surveys),
    )
}

/// Draws the predicted force of every channel with a muscle over time, and the wanted force of
/// channels under force control; an empty figure without muscles.
pub(super) fn forces(trials: &[Trial]) -> Svg {
    let shown = |channel: &ChannelInfo| channel.muscle;
    let titles = ("Predicted force over time", "force (N)");
    common_scale_figure(trials, titles, shown, &[Value::Force, Value::Wanted])
}

/// Draws the pulse rate of every channel under force control over time; an empty figure if there is
/// none.
pub(super) fn rates(trials: &[Trial]) -> Svg {
    let shown = |channel: &ChannelInfo| channel.force;
    common_scale_figure(
        trials,
        ("Pulse rate over time", "rate (Hz)"),
        shown,
        &[Value::Rate],
    )
}

/// Draws rows that all have the same scale, because small values would otherwise look as large as
/// big ones.
fn common_scale_figure(
    trials: &[Trial],
    (what, unit): (&str, &str),
    shown: fn(&ChannelInfo) -> bool,
    values: &[Value],
) -> Svg {
    let mut channels = channels(trials);
    channels.retain(|channel| shown(channel));
    let numbers: Vec<u8> = channels.iter().map(|channel| channel.number).collect();
    let surveys = surveys(trials, &numbers, values);
    let tops = surveys.iter().flatten().filter_map(|survey| survey.largest);
    let most = match channels.is_empty() {
        true => 0.0,
        false => tops.fold(1e-3, f64::max),
    };
    let step = round_step(most, 2.0);
    let top = (most / step).ceil() * step;
    let lane = |channel: &&ChannelInfo| Lane::new(channel, unit.to_owned(), top, top);
    let lanes: Vec<Lane> = channels.iter().map(lane).collect();
    grid(trials, &lanes, what, (values, &surveys))
}

/// Returns the channels that occur in any trial, each once, sorted by number.
fn channels(trials: &[Trial]) -> Vec<&ChannelInfo> {
    let channel_infos = trials.iter().flat_map(|trial| &trial.channels);
    let mut channels: Vec<&ChannelInfo> = channel_infos.collect();
    channels.sort_by_key(|channel| channel.number);
    channels.dedup_by_key(|channel| channel.number);
    channels
}

impl Lane {
    fn new(channel: &ChannelInfo, unit: String, top: f64, scale: f64) -> Self {
        Self {
            number: channel.number,
            name: format!("{} {}", channel.number, channel.name),
            unit,
            top,
            scale,
        }
    }

    /// Returns the vertical position of a value in row number `row`, in the units of the panel's y
    /// axis.
    fn height(&self, row: f64, value: f64) -> f64 {
        row + ZERO - REACH * value / self.top
    }

    /// Returns the objects that draw a row. The first entry of `values` is drawn as filled curves,
    /// and a second entry as lines over them. Each entry has a curve for each uninterrupted part of
    /// a signal.
    fn marks(&self, row: f64, values: Vec<Vec<Vec<Point>>>) -> Vec<Mark> {
        let ChannelMark { color, .. } = channel_mark(self.number);
        let strokes = [stroke(color, 1.3), stroke(INK, 1.0)];
        let mut marks = Vec::new();
        for (n, (parts, line)) in values.into_iter().zip(strokes).enumerate() {
            for part in parts {
                if let (0, Some(tint)) = (n, channel_mark(self.number).tint()) {
                    marks.push(Mark::Outline(
                        filled_outline(&part, self.height(row, 0.0)),
                        tint,
                    ));
                }
                marks.push(Mark::Line(part, line));
            }
        }
        if marks.is_empty() {
            marks.push(Mark::Beside((0.0, row), 4.0, "not used".to_owned()));
        }
        marks
    }
}

/// Returns the objects that draw all rows of a trial. Reads its samples only once.
fn rows(trial: &Trial, lanes: &[Lane], values: &[Value], surveys: &[Survey]) -> Vec<Mark> {
    let numbers: Vec<u8> = lanes.iter().map(|lane| lane.number).collect();
    let sources = Source::for_channels(trial, &numbers, values);
    let begun = |survey: &Survey| ShortenedSeries::new(survey.count, BUCKETS);
    let mut short: Vec<ShortenedSeries> = surveys.iter().map(begun).collect();
    let per_lane = values.len().max(1);
    let mut samples = trial.samples.reader();
    while let Some(sample) = samples.next_sample() {
        let lanes = (0..).map(f64::from).zip(lanes);
        let groups = lanes.zip(short.chunks_mut(per_lane).zip(sources.chunks(per_lane)));
        for ((row, lane), (short, sources)) in groups {
            for (short, source) in short.iter_mut().zip(sources) {
                if let Some(value) = source.value_in(sample) {
                    short.push((sample.t_s, lane.height(row, value)));
                }
            }
        }
    }
    let mut parts = short.into_iter().map(ShortenedSeries::finish);
    let numbered = (0..).map(f64::from).zip(lanes);
    let marks =
        numbered.map(|(row, lane)| lane.marks(row, parts.by_ref().take(per_lane).collect()));
    marks.flatten().collect()
}

fn grid(
    trials: &[Trial],
    lanes: &[Lane],
    description: &str,
    (values, surveys): (&[Value], &[Vec<Survey>]),
) -> Svg {
    if lanes.is_empty() || trials.is_empty() {
        return Svg::default();
    }
    let numbered = || (0..).map(f64::from).zip(lanes);
    let mut y = Axis::new("", Scale::Rows(lanes.len() as f64));
    for (row, lane) in numbered() {
        y.heads.push(Head {
            at: row,
            mark: Some(channel_mark(lane.number)),
            name: lane.name.clone(),
            more: lane.unit.clone(),
            bold: false,
        });
        let tick = |value: f64, words| (lane.height(row, value), words);
        y.ticks.push(tick(0.0, "0".to_owned()));
        y.ticks.push(tick(lane.scale, number(lane.scale)));
    }
    let panel = |(column, (trial, surveys)): (usize, (&Trial, &Vec<Survey>))| {
        let time = Axis {
            grid: false,
            ..Axis::linear("time (s)", (0.0, end_s(trials)), 6.0)
        };
        let title = crate::plot::words::truncate(13.0, &trial.name, 240.0, true);
        let height = lanes.len() as f64 * ROW;
        Panel {
            marks: rows(trial, lanes, values, surveys),
            ..Panel::new(&title, time, y.clone().hide_labels(column > 0), height)
        }
    };
    let lines = trials.chunks(COLUMNS).zip(surveys.chunks(COLUMNS));
    Figure {
        description: description.to_owned(),
        rows: lines
            .map(|(trials, surveys)| trials.iter().zip(surveys).enumerate().map(panel).collect())
            .collect(),
        ..Figure::default()
    }
    .svg()
}

/// Returns the outline of the area between a signal and the zero line at `zero`, to be filled.
fn filled_outline(points: &[Point], zero: f64) -> Vec<Point> {
    let ends = [points.last(), points.first()];
    let feet = ends.into_iter().flatten().map(|(t, _)| (*t, zero));
    points.iter().copied().chain(feet).collect()
}

fn number(value: f64) -> String {
    if value >= 10.0 {
        format!("{value:.0}")
    } else {
        format!("{}", (value * 100.0).round() / 100.0)
    }
}
