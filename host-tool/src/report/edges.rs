//! The switch states of one period, a row per channel. Long stretches in which
//! nothing changes are cut out of the time axis.

use super::canvas::{
    Area, ChannelMark, Drawn, GRID, INK, Key, MUTED, WIDTH, anchored, channel_mark, legend, line,
    px, shortened, svg, text, text_width,
};
use super::series::round_step;
use crate::record::{Edge, State, Trial};
use plotters::prelude::*;
use plotters::style::text_anchor::HPos;

const LEGEND: i32 = 30;
const LABELS: i32 = 150;
const ROW: i32 = 54;
const AXIS: i32 = 44;
const BREAK: i32 = 20;
/// Half the height of a pulse.
const LEVEL: i32 = 19;
/// A stretch without an edge longer than this is cut, µs; the shorter ones are
/// tried when the narrowest phase would otherwise be too thin to see.
const CUTS_US: [u64; 4] = [2500, 1000, 400, 100];
/// Too thin to see, pixels.
const THIN: f64 = 10.0;

/// Parts of the period that are drawn, and where.
struct Axis {
    /// From, to (µs since the first edge) and left end (pixels).
    parts: Vec<(u64, u64, f64)>,
    px_per_us: f64,
}

/// One channel's states: from, to (µs since the first edge), state.
type Stretch = (u64, u64, State);

/// Edges of one trial, or nothing if none were recorded.
pub(super) fn figure(trial: &Trial) -> String {
    let Some(start) = trial.edges.iter().map(|edge| edge.t_us).min() else {
        return String::new();
    };
    let mut edges: Vec<Edge> = trial.edges.clone();
    edges.sort_by_key(|edge| edge.t_us);
    edges.iter_mut().for_each(|edge| edge.t_us -= start);
    let mut channels: Vec<u8> = trial
        .channels
        .iter()
        .map(|channel| channel.number)
        .collect();
    channels.extend(edges.iter().map(|edge| edge.channel));
    channels.sort_unstable();
    channels.dedup();
    let axis = Axis::of(&edges);
    let height = LEGEND + channels.len() as i32 * ROW + AXIS;
    svg(
        height,
        &format!("Edges of one period, {}", trial.name),
        |root| {
            let keys = [
                (
                    Key::Line(line(INK, 10)),
                    "up: anodic · middle: isolated · down: cathodic",
                ),
                (Key::Box(GRID.filled()), "grounded"),
            ];
            legend(root, LABELS, 12, &keys)?;
            for (row, &channel) in channels.iter().enumerate() {
                let middle = LEGEND + row as i32 * ROW + ROW / 2;
                label(root, trial, &edges, channel, middle)?;
                let stretches = stretches(&edges, channel, axis.end());
                let mark = channel_mark(channel);
                root.draw(&Circle::new((px(6), px(middle - 8)), px(5), mark.dot()))?;
                draw_row(root, &axis, &stretches, mark, middle)?;
            }
            draw_axis(root, &axis, LEGEND + channels.len() as i32 * ROW)
        },
    )
}

impl Axis {
    fn of(edges: &[Edge]) -> Self {
        let axes = CUTS_US.map(|cut| Self::cut(edges, cut));
        let narrowest = narrowest_phase(edges) as f64;
        let fits = |axis: &&Axis| narrowest * axis.px_per_us >= THIN;
        let widest = |a: &&Axis, b: &&Axis| a.px_per_us.total_cmp(&b.px_per_us);
        let chosen = axes.iter().find(fits).or(axes.iter().max_by(widest));
        chosen.map_or_else(
            || Self::cut(edges, CUTS_US[0]),
            |axis| Axis {
                parts: axis.parts.clone(),
                px_per_us: axis.px_per_us,
            },
        )
    }

    /// Parts of the period with no stretch without an edge longer than `cut` µs.
    fn cut(edges: &[Edge], cut: u64) -> Self {
        let groups: Vec<(u64, u64)> = edges
            .chunk_by(|a, b| b.t_us - a.t_us <= cut)
            .map(|group| (group[0].t_us, group[group.len() - 1].t_us))
            .collect();
        let longest = groups.iter().map(|(from, to)| to - from).max();
        let pad = (longest.unwrap_or(0) / 20).clamp(20, cut / 3);
        let padded = groups
            .iter()
            .map(|(from, to)| (from.saturating_sub(pad), to + pad));
        let parts: Vec<(u64, u64)> = padded.collect();
        let drawn: u64 = parts.iter().map(|(from, to)| to - from).sum();
        let room = WIDTH - LABELS - 12 - BREAK * (parts.len() as i32 - 1);
        let px_per_us = f64::from(room) / drawn.max(1) as f64;
        let mut left = f64::from(LABELS);
        let placed = parts.into_iter().map(|(from, to)| {
            let part = (from, to, left);
            left += (to - from) as f64 * px_per_us + f64::from(BREAK);
            part
        });
        Axis {
            parts: placed.collect(),
            px_per_us,
        }
    }

    fn end(&self) -> u64 {
        self.parts.last().map_or(0, |(_, to, _)| *to)
    }
}

/// The shortest anodic or cathodic stretch, µs.
fn narrowest_phase(edges: &[Edge]) -> u64 {
    let is_phase = |state| matches!(state, State::Anodic | State::Cathodic);
    let phases = edges.iter().enumerate().filter(|(_, e)| is_phase(e.state));
    let length = |(i, phase): (usize, &Edge)| {
        let next = edges[i + 1..].iter().find(|e| e.channel == phase.channel)?;
        Some(next.t_us - phase.t_us)
    };
    phases.filter_map(length).min().unwrap_or(100)
}

fn stretches(edges: &[Edge], channel: u8, end: u64) -> Vec<Stretch> {
    let own = edges.iter().filter(|edge| edge.channel == channel);
    let mut stretches: Vec<Stretch> = vec![(0, end, State::Isolated)];
    for edge in own {
        if let Some(last) = stretches.last_mut() {
            last.1 = edge.t_us;
        }
        stretches.push((edge.t_us, end, edge.state));
    }
    stretches.retain(|(from, to, _)| to > from);
    stretches
}

/// Channel name, and its DAC code where a phase was emitted.
fn label(root: &Area<'_>, trial: &Trial, edges: &[Edge], channel: u8, middle: i32) -> Drawn {
    let info = trial.channels.iter().find(|info| info.number == channel);
    let name = info.map_or(String::new(), |info| info.name.clone());
    let name = shortened(13, &format!("{channel} {name}"), LABELS - 26);
    root.draw(&Text::new(name, (px(18), px(middle - 8)), text(13, INK)))?;
    let codes = edges
        .iter()
        .filter(|e| e.channel == channel && matches!(e.state, State::Anodic | State::Cathodic));
    let code = match codes.map(|edge| edge.dac_code).max() {
        Some(code) => format!("DAC code {code}"),
        None => "no pulse".to_owned(),
    };
    root.draw(&Text::new(code, (px(18), px(middle + 9)), text(11, MUTED)))?;
    Ok(())
}

fn draw_row(
    root: &Area<'_>,
    axis: &Axis,
    stretches: &[Stretch],
    mark: ChannelMark,
    middle: i32,
) -> Drawn {
    for &(part_from, part_to, left) in &axis.parts {
        let x = |t: u64| px(0) + ((left + (t - part_from) as f64 * axis.px_per_us) * 4.0) as i32;
        let mut path = Vec::new();
        for &(from, to, state) in stretches {
            let (from, to) = (from.max(part_from), to.min(part_to));
            if to <= from {
                continue;
            }
            let level = match state {
                State::Anodic => middle - LEVEL,
                State::Cathodic => middle + LEVEL,
                State::Isolated | State::Grounded => middle,
            };
            let ends = [(x(from), px(level)), (x(to), px(level))];
            if state == State::Grounded {
                // Above and below the line, which would be pale on it.
                for (top, bottom) in [(middle - 7, middle - 2), (middle + 2, middle + 7)] {
                    let band = [(x(from), px(top)), (x(to), px(bottom))];
                    root.draw(&Rectangle::new(band, GRID.filled()))?;
                }
            } else if level != middle {
                let body = [ends[0], (x(to), px(middle))];
                if let Some(tint) = mark.tint() {
                    root.draw(&Rectangle::new(body, tint))?;
                }
            }
            path.extend(ends);
        }
        root.draw(&PathElement::new(path, line(mark.color, 16)))?;
    }
    Ok(())
}

/// Ticks under every part; a slanted pair of strokes where time was cut out.
fn draw_axis(root: &Area<'_>, axis: &Axis, top: i32) -> Drawn {
    let total: f64 = axis
        .parts
        .iter()
        .map(|(from, to, _)| (to - from) as f64)
        .sum();
    let digits = text_width(11, &axis.end().to_string());
    let room = f64::from(WIDTH - LABELS) / f64::from(digits + 24);
    let step = round_step(total, room).max(1.0) as u64;
    let mut free_from = 0.0;
    for (position, &(from, to, left)) in axis.parts.iter().enumerate() {
        let x = |t: u64| left + (t - from) as f64 * axis.px_per_us;
        let unit = |pixels: f64| (pixels * 4.0) as i32;
        let ends = [(unit(left), px(top)), (unit(x(to)), px(top))];
        root.draw(&PathElement::new(ends, line(MUTED, 10)))?;
        if position > 0 {
            for offset in [-4.0, 2.0] {
                let at = left - f64::from(BREAK) / 2.0 + offset;
                let stroke = [(unit(at - 2.0), px(top + 5)), (unit(at + 4.0), px(top - 5))];
                root.draw(&PathElement::new(stroke, line(MUTED, 10)))?;
            }
        }
        let ticks = (from.div_ceil(step)..=to / step).map(|tick| tick * step);
        for t in ticks {
            let mark = [(unit(x(t)), px(top)), (unit(x(t)), px(top + 5))];
            root.draw(&PathElement::new(mark, line(MUTED, 10)))?;
            let half = f64::from(text_width(11, &t.to_string())) / 2.0;
            // Wider fonts need a little more than is estimated.
            if x(t) - half >= free_from && x(t) + half + 3.0 <= f64::from(WIDTH) {
                let style = anchored(text(11, MUTED), HPos::Center);
                root.draw(&Text::new(t.to_string(), (unit(x(t)), px(top + 14)), style))?;
                free_from = x(t) + half + 6.0;
            }
        }
    }
    let middle = (px((LABELS + WIDTH) / 2), px(top + 33));
    let style = anchored(text(12, INK), HPos::Center);
    root.draw(&Text::new("time since the first edge (µs)", middle, style))?;
    Ok(())
}
