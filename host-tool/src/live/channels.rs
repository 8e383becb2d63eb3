//! Draws amplitudes as bars with the wearer's limits, and predicted forces.

use super::{Channel, Model};
use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::style::{Color, Style, Stylize};
use ratatui::text::{Line, Span};
use ratatui::widgets::{Block, Paragraph};

/// Characters that fill a cell by 0 to 8 eighths.
const EIGHTHS: [char; 9] = [' ', '▏', '▎', '▍', '▌', '▋', '▊', '▉', '█'];

/// Width below which a bar on one line leaves no room for a name, columns.
const NARROW: usize = 40;

/// Draws one bar for each channel, on two lines where there is room.
pub(super) fn draw(frame: &mut Frame<'_>, area: Rect, model: &Model) {
    let title = if model.is_on() {
        " amplitude, limit ┃, force "
    } else {
        " off; limit ┃, force "
    };
    let block = Block::bordered()
        .title(title)
        .border_style(Style::new().dim());
    let inner = block.inner(area);
    let (width, height) = (usize::from(inner.width), usize::from(inner.height));
    let count = model.channels.len();
    let mut lines = Vec::new();
    for (index, channel) in model.channels.iter().enumerate() {
        let value = model.amplitude(index);
        let force = model.force_n(channel);
        let scale = scale(&model.channels, channel.unit);
        if 2 * count <= height {
            lines.push(heading(channel, value, force, width));
            lines.push(Line::from(bar(value, channel.limit, scale, width)));
            if 3 * count <= height {
                lines.push(Line::default());
            }
        } else {
            lines.push(one_line(channel, value, force, scale, width));
        }
    }
    if model.channels.is_empty() {
        lines.push(
            Line::from("no session, so nothing is stimulated; run one with --session FILE").dim(),
        );
    }
    frame.render_widget(Paragraph::new(lines).block(block), area);
}

/// Returns the largest limit among channels of one unit, so that their bars are comparable.
fn scale(channels: &[Channel], unit: &str) -> f64 {
    let same = channels.iter().filter(|c| c.unit == unit);
    same.map(|c| c.limit).fold(0.0, f64::max)
}

fn heading(channel: &Channel, value: f64, force: Option<f64>, width: usize) -> Line<'static> {
    let numbers = format!(
        "{value:.1} of {:.1} {}{}",
        channel.limit,
        channel.unit,
        force_text(force)
    );
    let room = width.saturating_sub(numbers.chars().count() + 1);
    let name = format!("{} {}", channel.number, channel.name);
    Line::from(format!("{:<room$} {numbers}", truncate(&name, room)))
}

fn one_line(
    channel: &Channel,
    value: f64,
    force: Option<f64>,
    scale: f64,
    width: usize,
) -> Line<'static> {
    let name = if width < NARROW {
        format!("{:>2} ", channel.number)
    } else {
        let room = width / 4;
        format!(
            "{:>2} {:<room$} ",
            channel.number,
            truncate(&channel.name, room)
        )
    };
    let numbers = format!("{value:>5.1} {:<2}{}", channel.unit, force_text(force));
    let taken = name.chars().count() + numbers.chars().count() + 1;
    let mut spans = vec![Span::raw(name)];
    spans.extend(bar(
        value,
        channel.limit,
        scale,
        width.saturating_sub(taken),
    ));
    spans.push(Span::raw(format!(" {numbers}")));
    Line::from(spans)
}

fn force_text(force: Option<f64>) -> String {
    force.map_or(String::new(), |n| format!(" {n:>4.1} N"))
}

fn truncate(name: &str, width: usize) -> String {
    name.chars().take(width).collect()
}

/// Draws a bar that is `width` cells wide. One cell marks `limit`; the others stand for 0 to
/// `scale`.
fn bar(value: f64, limit: f64, scale: f64, width: usize) -> Vec<Span<'static>> {
    let cells = width.saturating_sub(1) as f64;
    let place = |x: f64| if scale > 0.0 { x / scale * cells } else { 0.0 };
    let mark = place(limit).round() as usize; // the cast saturates
    let filled = place(value);
    let cell = |index: usize| {
        let eighths = ((filled - index as f64) * 8.0).round().clamp(0.0, 8.0);
        EIGHTHS[eighths as usize] // 0 to 8
    };
    let is_at_limit = value >= limit && value > 0.0;
    let color = if is_at_limit {
        Color::Magenta
    } else {
        Color::Green
    };
    let before: String = (0..mark.min(width)).map(cell).collect();
    let after: String = (mark + 1..width).map(cell).collect();
    let mut spans = vec![before.fg(color)];
    if mark < width {
        spans.push("┃".fg(if is_at_limit {
            Color::Magenta
        } else {
            Color::Reset
        }));
    }
    spans.push(after.red());
    spans
}

#[cfg(test)]
mod tests {
    use super::*;

    fn text(value: f64, limit: f64, scale: f64, width: usize) -> String {
        bar(value, limit, scale, width)
            .iter()
            .map(|s| s.content.as_ref())
            .collect()
    }

    #[test]
    fn bars_reach_their_limit_and_no_farther() {
        assert_eq!(text(0.0, 10.0, 10.0, 6), "     ┃");
        assert_eq!(text(5.0, 10.0, 10.0, 6), "██▌  ┃");
        assert_eq!(text(10.0, 10.0, 10.0, 6), "█████┃");
        assert_eq!(text(4.0, 4.0, 10.0, 6), "██┃   ");
        assert_eq!(text(6.0, 4.0, 10.0, 6), "██┃   ");
        assert_eq!(text(10.0, 4.0, 10.0, 6), "██┃██ ");
        assert_eq!(text(0.0, 0.0, 0.0, 3), "┃  ");
        assert_eq!(text(1.0, 1.0, 1.0, 0), "");
    }
}
