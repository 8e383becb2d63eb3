//! The switch states of one period, one row per channel. Long stretches in which nothing changes
//! are cut out of the time axis.

use crate::plot::axis::Head;
use crate::plot::ink::{GRID, INK, channel_mark, stroke};
use crate::plot::series::round_step;
use crate::plot::{At, Axis, Figure, Key, Mark, Paint, Panel, Scale, Svg};
use crate::record::{Edge, State, Trial};

const ROW: f64 = 54.0;
/// Half of the height of a drawn pulse, as a share of the height of its row.
const LEVEL: f64 = 0.35;
/// Lengths above which a stretch without an edge is cut out of the time axis, µs. The first length
/// that leaves the narrowest phase wide enough to see is used.
const CUTS_US: [u64; 4] = [2500, 1000, 400, 100];
/// Width below which a phase is too thin to see, as a share of the plot.
const THIN: f64 = 10.0 / 840.0;
/// Width of the gap where a stretch is cut out, as a share of the plot.
const CUT: f64 = 20.0 / 840.0;

/// Time during which a channel does not change its state: its start and end, µs since the first
/// edge, and the state.
type Stretch = (u64, u64, State);

/// Draws the switch states of one trial; an empty figure if no edges were recorded. `alike` are
/// trials with the same edges but possibly other amplitudes. Their DAC codes are included in the
/// range that each channel shows.
#[must_use]
pub fn edges_figure(trial: &Trial, alike: &[&Trial]) -> Svg {
    let Some(start) = trial.edges.iter().map(|edge| edge.t_us).min() else {
        return Svg::default();
    };
    let codes = |channel: u8| {
        let pooled_edges = alike.iter().chain([&trial]).flat_map(|trial| &trial.edges);
        let own = pooled_edges.filter(|edge| edge.channel == channel && is_phase(edge.state));
        own.map(|edge| edge.dac_code)
            .fold(None, |range: Option<(u16, u16)>, code| {
                let (low, high) = range.unwrap_or((code, code));
                Some((low.min(code), high.max(code)))
            })
    };
    let mut edges: Vec<Edge> = trial.edges.clone();
    edges.sort_by_key(|edge| edge.t_us);
    edges.iter_mut().for_each(|edge| edge.t_us -= start);
    let known = trial.channels.iter().map(|channel| channel.number);
    let mut channels: Vec<u8> = known.chain(edges.iter().map(|edge| edge.channel)).collect();
    channels.sort_unstable();
    channels.dedup();
    let parts = visible_parts(&edges);
    let mut y = Axis::new("", Scale::Rows(channels.len() as f64));
    let mut marks = Vec::new();
    for (row, channel) in (0..).map(f64::from).zip(&channels) {
        y.heads.push(head(trial, codes(*channel), *channel, row));
        for part in &parts {
            draw(
                &mut marks,
                &stretches(&edges, *channel, *part),
                *channel,
                row,
            );
        }
    }
    let legend = [
        (
            Key::Line(stroke(INK, 1.0)),
            "up: anodic · middle: isolated (disconnected) · down: cathodic",
        ),
        (Key::Box(Paint::Full(GRID)), "grounded"),
    ];
    let panel = Panel {
        marks,
        ..Panel::new("", time(&parts), y, channels.len() as f64 * ROW)
    };
    Figure {
        description: format!("Edges of one period, {}", trial.name),
        legend: legend.map(|(key, name)| (key, name.to_owned())).into(),
        rows: vec![vec![panel]],
        ..Figure::default()
    }
    .svg()
}

/// Returns the time axis for the visible parts of the period, with ticks in each part.
fn time(parts: &[(u64, u64)]) -> Axis {
    let real = parts.iter().map(|(from, to)| (*from as f64, *to as f64));
    let scale = Scale::Parts(real.collect());
    let step = round_step(scale.span(), 16.0).max(1.0) as u64;
    let ticks = parts
        .iter()
        .flat_map(|(from, to)| from.div_ceil(step)..=to / step)
        .map(|n| ((n * step) as f64, (n * step).to_string()));
    Axis::new("time since the first edge (µs)", scale).ticks(ticks.collect())
}

/// Returns the parts of the period that are drawn, as start and end in µs. Uses the first length in
/// [`CUTS_US`] with which the narrowest phase is visible, or else the one with which it is widest.
fn visible_parts(edges: &[Edge]) -> Vec<(u64, u64)> {
    let narrowest = narrowest_phase(edges) as f64;
    let seen = |parts: &Vec<(u64, u64)>| {
        let drawn: u64 = parts.iter().map(|(from, to)| to - from).sum();
        let room = 1.0 - CUT * (parts.len() - 1) as f64;
        narrowest / drawn.max(1) as f64 * room
    };
    let candidates = CUTS_US.map(|longest| cut_gaps(edges, longest));
    let fits = candidates.iter().find(|parts| seen(parts) >= THIN);
    let best = fits.or_else(|| candidates.iter().max_by(|a, b| seen(a).total_cmp(&seen(b))));
    best.cloned().unwrap_or_default()
}

/// Returns the parts of the period that remain, as start and end in µs, if every stretch without an
/// edge that is longer than `longest` µs is cut out.
fn cut_gaps(edges: &[Edge], longest: u64) -> Vec<(u64, u64)> {
    let groups: Vec<(u64, u64)> = edges
        .chunk_by(|a, b| b.t_us - a.t_us <= longest)
        .map(|group| (group[0].t_us, group[group.len() - 1].t_us))
        .collect();
    let widest = groups.iter().map(|(from, to)| to - from).max();
    let pad = (widest.unwrap_or(0) / 20).clamp(20, longest / 3);
    let padded = groups.iter();
    padded
        .map(|(from, to)| (from.saturating_sub(pad), to + pad))
        .collect()
}

/// Returns the length of the shortest anodic or cathodic phase, µs; 100 without any phase.
fn narrowest_phase(edges: &[Edge]) -> u64 {
    let phases = edges.iter().enumerate().filter(|(_, e)| is_phase(e.state));
    let length = |(i, phase): (usize, &Edge)| {
        let next = edges[i + 1..].iter().find(|e| e.channel == phase.channel)?;
        Some(next.t_us - phase.t_us)
    };
    phases.filter_map(length).min().unwrap_or(100)
}

fn is_phase(state: State) -> bool {
    matches!(state, State::Anodic | State::Cathodic)
}

/// Returns the states of a channel, one after the other, within the visible part from `from` to
/// `to`.
fn stretches(edges: &[Edge], channel: u8, (from, to): (u64, u64)) -> Vec<Stretch> {
    let mut stretches: Vec<Stretch> = vec![(from, to, State::Isolated)];
    for edge in edges.iter().filter(|edge| edge.channel == channel) {
        if let Some(last) = stretches.last_mut() {
            last.1 = edge.t_us.clamp(from, to);
        }
        stretches.push((edge.t_us.clamp(from, to), to, edge.state));
    }
    stretches.retain(|(from, to, _)| to > from);
    stretches
}

/// Returns the row name of a channel, with the smallest and the largest DAC code of its phases
/// below it.
fn head(trial: &Trial, codes: Option<(u16, u16)>, channel: u8, at: f64) -> Head {
    let info = trial.channels.iter().find(|info| info.number == channel);
    let name = info.map_or(String::new(), |info| info.name.clone());
    Head {
        at,
        mark: Some(channel_mark(channel)),
        name: format!("{channel} {name}"),
        more: match codes {
            Some((low, high)) if low < high => format!("DAC {low} to {high}"),
            Some((code, _)) => format!("DAC code {code}"),
            None => "no pulse in this period".to_owned(),
        },
        bold: false,
    }
}

fn draw(marks: &mut Vec<Mark>, stretches: &[Stretch], channel: u8, row: f64) {
    let mark = channel_mark(channel);
    let mut path: Vec<At> = Vec::new();
    for &(from, to, state) in stretches {
        let across = (from as f64, to as f64);
        let level = match state {
            State::Anodic => row - LEVEL,
            State::Cathodic => row + LEVEL,
            State::Isolated | State::Grounded => row,
        };
        if state == State::Grounded {
            // The bands lie above and below the line, which would be pale on top of them.
            for band in [(row - 0.13, row - 0.04), (row + 0.04, row + 0.13)] {
                marks.push(Mark::Area(across, band, Paint::Full(GRID)));
            }
        }
        if let (true, Some(tint)) = (is_phase(state), mark.tint()) {
            marks.push(Mark::Area(across, (level, row), tint));
        }
        path.extend([(across.0, level), (across.1, level)]);
    }
    marks.push(Mark::Line(path, stroke(mark.color, 1.6)));
}
