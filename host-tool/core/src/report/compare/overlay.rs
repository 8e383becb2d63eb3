//! Amplitudes of several records over time, one panel per channel.

use super::pairs::Group;
use crate::plot::ink::{PALETTE, stroke};
use crate::plot::series::{Point, ShortenedSeries};
use crate::plot::words::truncate;
use crate::plot::{Axis, Figure, Key, Mark, Panel, Stroke, Svg};
use crate::record::Trial;

/// Maximum number of curves in a panel; it is the number of distinguishable colours.
pub(super) const MOST_LINES: usize = PALETTE.len();

const HEIGHT: f64 = 110.0;
/// Number of groups of points to which a curve is reduced; each group keeps at most two points.
const BUCKETS: usize = 300;
/// Largest number of panels that are drawn in one column; more panels are drawn in two columns.
const ONE_COLUMN: usize = 2;

/// The amplitude of a channel over time, reduced to the points that are drawn.
#[derive(Clone, Debug)]
pub(super) struct Course {
    number: u8,
    name: String,
    unit: String,
    parts: Vec<Vec<Point>>,
    end_s: f64,
    peak: f64,
}

impl Course {
    /// Returns the amplitude of each channel of a trial over time. The amplitude is 0 while a
    /// channel outputs nothing.
    pub(super) fn channel_courses(trial: &Trial) -> Vec<Self> {
        let short = || ShortenedSeries::new(trial.samples.len(), BUCKETS);
        let mut lines: Vec<(ShortenedSeries, f64)> =
            trial.channels.iter().map(|_| (short(), 0.0)).collect();
        let mut samples = trial.samples.reader();
        while let Some(sample) = samples.next_sample() {
            for (place, (line, peak)) in lines.iter_mut().enumerate() {
                let amplitude = sample.amplitudes.get(place).copied().flatten();
                let amplitude = amplitude.unwrap_or(0.0);
                *peak = f64::max(*peak, amplitude);
                line.push((sample.t_s, amplitude));
            }
        }
        let end_s = trial.samples.last().map_or(0.0, |sample| sample.t_s);
        let named = trial.channels.iter().zip(lines);
        named
            .map(|(info, (line, peak))| Self {
                number: info.number,
                name: info.name.clone(),
                unit: info.unit.clone(),
                parts: line.finish(),
                end_s: end_s.max(trial.duration_s),
                peak,
            })
            .collect()
    }
}

/// Returns the line style of the record with this index. The line of the first record is the
/// widest, so that it stays visible under the lines that are drawn over it.
fn line(place: usize) -> Stroke {
    let widths = [4.0, 2.6, 1.8, 1.4, 1.2, 1.0];
    stroke(PALETTE[place], widths[place])
}

/// Draws the amplitudes of the first [`MOST_LINES`] trials of a group over each other, with a panel
/// for each channel; an empty figure without channels.
pub(super) fn figure(group: &Group<'_>) -> Svg {
    let drawn = || group.trials.iter().take(MOST_LINES).enumerate();
    let mut channels: Vec<(u8, &str, &str)> = Vec::new();
    for (_, (_, kept)) in drawn() {
        for course in &kept.courses {
            let key = (course.number, course.unit.as_str());
            if !channels
                .iter()
                .any(|(number, unit, _)| (*number, *unit) == key)
            {
                channels.push((course.number, &course.unit, &course.name));
            }
        }
    }
    channels.sort_unstable();
    let courses = || drawn().flat_map(|(_, (_, kept))| &kept.courses);
    let end_s = courses()
        .map(|course| course.end_s)
        .filter(|end| end.is_finite());
    let end_s = end_s.fold(0.01, f64::max);
    if channels.is_empty() {
        return Svg::default();
    }
    let columns = if channels.len() > ONE_COLUMN { 2 } else { 1 };
    let panel = |(number, unit, name): &(u8, &str, &str), is_last: bool| {
        let is_own = |course: &&Course| (course.number, &*course.unit) == (*number, *unit);
        let peaks = courses().filter(is_own).map(|course| course.peak);
        let top = peaks.filter(|peak| peak.is_finite()).fold(0.001, f64::max);
        let lines = drawn().flat_map(|(place, (_, kept))| {
            let own = kept.courses.iter().filter(is_own);
            let parts = own.flat_map(|course| course.parts.iter().cloned());
            parts.map(move |part| Mark::Line(part, line(place)))
        });
        let x = Axis {
            grid: false,
            ..Axis::linear("time (s)", (0.0, end_s), 8.0).hide_labels(!is_last)
        };
        let y = Axis::linear(&format!("amplitude ({unit})"), (0.0, top * 1.05), 5.0);
        let title = truncate(13.0, &format!("{number} {name}"), 300.0, true);
        Panel {
            marks: lines.collect(),
            ..Panel::new(&title, x, y, HEIGHT)
        }
    };
    let rows = channels.chunks(columns).enumerate();
    let rows = rows.map(|(r, row)| {
        let is_last = |c: usize| (r + 1) * columns + c >= channels.len();
        let panels = row.iter().enumerate();
        panels.map(|(c, pair)| panel(pair, is_last(c))).collect()
    });
    let names = drawn().map(|(place, (number, kept))| {
        let name = format!("{number}: {}", kept.row.trial);
        (Key::Line(line(place)), truncate(12.0, &name, 300.0, false))
    });
    Figure {
        description: format!("Amplitude of every channel over time, {}", group.name),
        legend: names.collect(),
        rows: rows.collect(),
        ..Figure::default()
    }
    .svg()
}
