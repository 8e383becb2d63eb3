//! Charts the reference and the measured angle over the last seconds.

use super::Model;
use host_core::record::Sample;
use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::style::{Color, Style, Stylize};
use ratatui::symbols::Marker;
use ratatui::text::{Line, Span};
use ratatui::widgets::{Axis, Block, Chart, Dataset, GraphType};

/// Width from which the chart shows twice as much time, columns.
const WIDE: u16 = 60;

/// Smallest range of the angle axis, degrees: a finger's range.
const LEAST_DEG: (f64, f64) = (0.0, 90.0);

/// Distance between marks of the angle axis, degrees.
const MARK_DEG: f64 = 30.0;

/// Draws the chart, with the present values in its title.
pub(super) fn draw(frame: &mut Frame<'_>, area: Rect, model: &Model) {
    let span_s = if area.width < WIDE { 10.0 } else { 20.0 };
    let end = model.samples.back().map_or(0.0, |s| s.t_s).max(span_s);
    let begin = end - span_s;
    let course = |value: fn(&Sample) -> Option<f64>| -> Vec<(f64, f64)> {
        let recent = model.samples.iter().filter(|s| s.t_s >= begin);
        recent.filter_map(|s| Some((s.t_s, value(s)?))).collect()
    };
    let (target, measured) = (course(|s| s.target_deg), course(|s| s.measured_deg));
    let (low, high) = range(model.samples.iter());
    let marks = ((high - low) / MARK_DEG).round() as usize; // only a few marks
    let degrees = (0..=marks).map(|i| format!("{:.0}°", low + i as f64 * MARK_DEG));
    let times = [begin, begin + span_s / 2.0, end].map(|t| format!("{t:.1} s"));
    let line = |data, marker, color| {
        let set = Dataset::default().graph_type(GraphType::Line).data(data);
        set.marker(marker).style(Style::new().fg(color))
    };
    let sets = vec![
        line(&target, Marker::Dot, Color::DarkGray),
        line(&measured, Marker::Braille, Color::Cyan),
    ];
    let axis = |bounds, labels: Vec<String>| {
        let axis = Axis::default().bounds(bounds).labels(labels);
        axis.style(Style::new().dim())
    };
    let block = Block::bordered()
        .title(legend(model))
        .border_style(Style::new().dim());
    let chart = Chart::new(sets)
        .block(block)
        .x_axis(axis([begin, end], times.to_vec()))
        .y_axis(axis([low, high], degrees.collect()));
    frame.render_widget(chart, area);
}

/// Returns the range of all kept angles, extended to whole marks so that the axis rarely moves.
fn range<'a>(samples: impl Iterator<Item = &'a Sample>) -> (f64, f64) {
    let angles = samples.flat_map(|s| [s.target_deg, s.measured_deg]);
    let (low, high) = angles
        .flatten()
        .fold(LEAST_DEG, |(low, high), deg| (low.min(deg), high.max(deg)));
    let bound = |deg: f64, round: fn(f64) -> f64| round(deg / MARK_DEG) * MARK_DEG;
    (bound(low, f64::floor), bound(high, f64::ceil))
}

fn legend(model: &Model) -> Line<'static> {
    let Some(sample) = model.samples.back() else {
        return Line::from(" joint angle ");
    };
    let degrees = |angle: Option<f64>| angle.map_or("–".to_owned(), |deg| format!("{deg:.1}°"));
    let error = match (sample.measured_deg, sample.target_deg) {
        (Some(measured), Some(target)) => format!("  {:+.1}° ", measured - target),
        _ => " ".to_owned(),
    };
    Line::from(vec![
        Span::raw(" "),
        format!("• target {}", degrees(sample.target_deg)).gray(),
        Span::raw("  "),
        format!("⣿ measured {}", degrees(sample.measured_deg)).cyan(),
        Span::raw(error),
    ])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_axis_holds_all_angles_in_whole_marks() {
        let at = |target_deg, measured_deg| Sample {
            target_deg: Some(target_deg),
            measured_deg: Some(measured_deg),
            ..Sample::default()
        };
        assert_eq!(range([].iter()), (0.0, 90.0));
        assert_eq!(
            range([at(-2.0, 30.0), at(45.0, 95.0)].iter()),
            (-30.0, 120.0)
        );
    }
}
