//! Amplitudes and predicted forces: a panel per trial with a row per channel, so
//! that ten channels stay readable and units never mix.

use super::trajectory::end_s;
use crate::plot::axis::Head;
use crate::plot::ink::{ChannelMark, INK, channel_mark, stroke};
use crate::plot::series::{Point, range, round_step, shorten};
use crate::plot::{Axis, Figure, Mark, Panel, Scale, Svg};
use crate::record::{ChannelInfo, Sample, Trial};

/// Height of a row, pixels.
const ROW: f64 = 58.0;
/// Of it: where 0 lies below the row's middle, and how far its scale reaches up.
const ZERO: f64 = 0.42;
const REACH: f64 = 0.76;
/// Columns side by side; more trials continue below.
const COLUMNS: usize = 3;
/// As many as a third of a screen can show.
const BUCKETS: usize = 200;

/// What a row shows of a channel.
#[derive(Clone, Copy)]
enum Value {
    /// Amplitude; a channel that plays nothing puts out nothing.
    Amplitude,
    /// Predicted force.
    Force,
    /// Wanted force.
    Wanted,
    /// Pulse rate.
    Rate,
}

impl Value {
    /// What a trial knows of it over time.
    fn course(self, trial: &Trial, channel: u8) -> impl Iterator<Item = Point> + Clone {
        let place = trial.place(
            channel,
            match self {
                Self::Amplitude => |_| true,
                Self::Force => |c| c.muscle,
                Self::Wanted | Self::Rate => |c| c.force,
            },
        );
        let value = move |sample: &Sample| {
            let known = |values: &[Option<f64>]| values.get(place?).copied();
            match self {
                Self::Amplitude => Some(known(&sample.amplitudes)?.unwrap_or(0.0)),
                Self::Force => known(&sample.forces_n)?,
                Self::Wanted => known(&sample.wanted_n)?,
                Self::Rate => known(&sample.rates_hz)?,
            }
        };
        let samples = trial.samples.iter();
        samples.filter_map(move |sample| Some((sample.t_s, value(&sample)?)))
    }
}

/// One row.
struct Lane {
    number: u8,
    name: String,
    /// What the row shows, with its unit.
    unit: String,
    /// Top of the scale, and what of it is named.
    top: f64,
    scale: f64,
}

/// Amplitude of every channel over time, or nothing without channels.
pub(super) fn amplitudes(trials: &[Trial]) -> Svg {
    let value = Value::Amplitude;
    let lane = |channel: &ChannelInfo| {
        let top = largest(trials, value, channel.number).max(channel.limit);
        let unit = format!("amplitude ({})", channel.unit);
        Lane::of(channel, unit, top, channel.limit)
    };
    let lanes: Vec<Lane> = channels(trials).into_iter().map(lane).collect();
    grid(
        trials,
        &lanes,
        "Amplitude of every channel over time",
        &[value],
    )
}

/// Predicted force of every channel with a muscle over time, and the wanted one
/// where it is controlled; nothing without muscles.
pub(super) fn forces(trials: &[Trial]) -> Svg {
    let shown = |channel: &ChannelInfo| channel.muscle;
    let what = ("Predicted force over time", "force (N)");
    alike(trials, what, shown, &[Value::Force, Value::Wanted])
}

/// Pulse rate of every channel under force control over time, or nothing.
pub(super) fn rates(trials: &[Trial]) -> Svg {
    let shown = |channel: &ChannelInfo| channel.force;
    alike(
        trials,
        ("Pulse rate over time", "rate (Hz)"),
        shown,
        &[Value::Rate],
    )
}

/// Rows of one scale, or small values would look as large as big ones.
fn alike(
    trials: &[Trial],
    (what, unit): (&str, &str),
    shown: fn(&ChannelInfo) -> bool,
    values: &[Value],
) -> Svg {
    let rows = || channels(trials).into_iter().filter(|c| shown(c));
    let tops = rows().flat_map(|c| values.iter().map(|value| largest(trials, *value, c.number)));
    let most = tops.fold(0.0, f64::max);
    let step = round_step(most, 2.0);
    let top = (most / step).ceil() * step;
    let lanes: Vec<Lane> = rows()
        .map(|c| Lane::of(c, unit.to_owned(), top, top))
        .collect();
    grid(trials, &lanes, what, values)
}

/// The channels of all trials, each once, lowest number first.
fn channels(trials: &[Trial]) -> Vec<&ChannelInfo> {
    let all = trials.iter().flat_map(|trial| &trial.channels);
    let mut channels: Vec<&ChannelInfo> = all.collect();
    channels.sort_by_key(|channel| channel.number);
    channels.dedup_by_key(|channel| channel.number);
    channels
}

fn largest(trials: &[Trial], value: Value, n: u8) -> f64 {
    let of_trial = |trial: &Trial| range(value.course(trial, n).map(|(_, value)| value));
    let tops = trials.iter().filter_map(of_trial).map(|(_, high)| high);
    tops.fold(1e-3, f64::max)
}

impl Lane {
    fn of(channel: &ChannelInfo, unit: String, top: f64, scale: f64) -> Self {
        Self {
            number: channel.number,
            name: format!("{} {}", channel.number, channel.name),
            unit,
            top,
            scale,
        }
    }

    /// The height of a value in this row.
    fn height(&self, row: f64, value: f64) -> f64 {
        row + ZERO - REACH * value / self.top
    }

    /// The first value as a filled line, the second, if any, over it.
    fn marks(&self, trial: &Trial, row: f64, values: &[Value]) -> Vec<Mark> {
        let ChannelMark { color, .. } = channel_mark(self.number);
        let strokes = [stroke(color, 1.3), stroke(INK, 1.0)];
        let mut marks = Vec::new();
        for (n, (value, line)) in values.iter().zip(strokes).enumerate() {
            let known = value.course(trial, self.number);
            let points = known.map(|(t_s, value)| (t_s, self.height(row, value)));
            for part in shorten(points, BUCKETS) {
                if let (0, Some(tint)) = (n, channel_mark(self.number).tint()) {
                    marks.push(Mark::Outline(closed(&part, self.height(row, 0.0)), tint));
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

fn grid(trials: &[Trial], lanes: &[Lane], description: &str, values: &[Value]) -> Svg {
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
    let panel = |(column, trial): (usize, &Trial)| {
        let time = Axis {
            grid: false,
            ..Axis::linear("time (s)", (0.0, end_s(trials)), 6.0)
        };
        let title = crate::plot::words::shortened(13.0, &trial.name, 240.0, true);
        let height = lanes.len() as f64 * ROW;
        Panel {
            marks: numbered()
                .flat_map(|(row, lane)| lane.marks(trial, row, values))
                .collect(),
            ..Panel::new(&title, time, y.clone().silent(column > 0), height)
        }
    };
    let rows = trials.chunks(COLUMNS);
    Figure {
        description: description.to_owned(),
        rows: rows
            .map(|row| row.iter().enumerate().map(panel).collect())
            .collect(),
        ..Figure::default()
    }
    .svg()
}

/// The signal closed along zero, to be filled.
fn closed(points: &[Point], zero: f64) -> Vec<Point> {
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
