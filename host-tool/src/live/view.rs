//! Lays out the dashboard's frame.

use super::line::{allowance_text, state_word};
use super::{Hands, Model, Note, channels, chart};
use firmware::safety::State;
use ratatui::Frame;
use ratatui::layout::{Alignment, Constraint, Layout, Rect};
use ratatui::style::{Color, Modifier, Style, Stylize};
use ratatui::text::{Line, Span};
use ratatui::widgets::{Block, Paragraph, Wrap};

/// Time without a message after which the device is marked as silent, s.
const SILENT_S: f64 = 0.5;

/// Height from which the notes get more room, rows.
const TALL: u16 = 32;

/// Width below which the counters make room for the notes, columns.
const NARROW: u16 = 70;

/// Draws the whole `model`. Meant for 80×24 and more; a smaller terminal shows less.
pub fn draw(frame: &mut Frame<'_>, model: &Model) {
    let area = frame.area();
    let notes = if area.height < TALL { 5 } else { 9 };
    let [title, status, middle, below, keys] = Layout::vertical([
        Constraint::Length(1),
        Constraint::Length(1),
        Constraint::Min(5),
        Constraint::Length(notes),
        Constraint::Length(1),
    ])
    .areas(area);
    draw_title(frame, title, model);
    frame.render_widget(status_line(model), status);
    if model.has_joint {
        let [left, right] =
            Layout::horizontal([Constraint::Percentage(55), Constraint::Fill(1)]).areas(middle);
        chart::draw(frame, left, model);
        channels::draw(frame, right, model);
    } else {
        channels::draw(frame, middle, model);
    }
    // No status is requested while the keyboard controls the session.
    let has_counters = area.width >= NARROW && model.hands.is_none();
    let counters_width = if has_counters { 33 } else { 0 };
    let [left, right] =
        Layout::horizontal([Constraint::Fill(1), Constraint::Length(counters_width)]).areas(below);
    draw_notes(frame, left, model);
    frame.render_widget(counters(model), right);
    frame.render_widget(footer(model), keys);
}

fn draw_title(frame: &mut Frame<'_>, area: Rect, model: &Model) {
    let device = match model.kind {
        Some((kind, [major, minor, patch])) => {
            let device = kind.format_with_name(&model.device);
            format!("{device} {major}.{minor}.{patch} ")
        }
        None => format!("{}, connecting ", model.device),
    };
    let width = u16::try_from(device.chars().count()).unwrap_or(u16::MAX);
    // A long port name leaves half of the line to the title.
    let width = width.min(area.width / 2);
    let [left, right] =
        Layout::horizontal([Constraint::Fill(1), Constraint::Length(width)]).areas(area);
    let title = Line::from(vec![" flexor ".bold(), Span::raw(model.title.as_str())]);
    frame.render_widget(title, left);
    frame.render_widget(Line::from(device).alignment(Alignment::Right).dim(), right);
}

fn status_line(model: &Model) -> Line<'_> {
    let color = match model.state {
        State::Boot => Color::Gray,
        State::Idle => Color::Blue,
        State::Armed | State::Stopping => Color::Yellow,
        State::Stimulating => Color::Green,
        State::Fault => Color::Red,
    };
    let badge = label(&state_word(model.state).to_uppercase(), color);
    let mut line = Line::from(vec![Span::raw(" "), badge, Span::raw("  ")]);
    let t_s = model.t_s;
    line.push_span(match model.duration_s {
        Some(end) => format!("{t_s:.1} s of {end:.1} s"),
        None => format!("{t_s:.1} s"),
    });
    if model.is_limiting() {
        line.push_span("  ");
        line.push_span(label("LIMITING", Color::Magenta));
    }
    if let Some(hands) = &model.hands {
        if hands.is_paused {
            line.push_span("  ");
            line.push_span(label("PAUSED", Color::Yellow));
        }
        line.push_span("  ");
        line.push_span(selection_text(hands));
    }
    if model.is_ending {
        line.push_span("  stopping on request".bold());
    }
    if model.silent_s > SILENT_S {
        line.push_span("  ");
        line.push_span(label("NO DATA", Color::Red));
        line.push_span(format!(" for {:.1} s", model.silent_s));
    }
    if let Some(record) = model.fault {
        let text = format!("fault {}: {:?}", record.fault.number(), record.fault);
        line.push_span("  ");
        line.push_span(if model.state == State::Fault {
            text.red().bold()
        } else {
            format!("last {text}").dim()
        });
    }
    line
}

/// Returns the selected channel and its intensity.
fn selection_text(hands: &Hands) -> String {
    let intensity = hands.intensities.get(hands.selected);
    match (hands.channel(), intensity) {
        (Some(channel), Some(percent)) => format!("channel {channel} at {percent} %"),
        _ => String::new(),
    }
}

fn label(text: &str, color: Color) -> Span<'static> {
    let style = Style::new().fg(Color::Black).bg(color);
    Span::styled(format!(" {text} "), style.add_modifier(Modifier::BOLD))
}

fn draw_notes(frame: &mut Frame<'_>, area: Rect, model: &Model) {
    let lines: Vec<Line<'_>> = model.notes.iter().rev().map(note_line).collect();
    let block = Block::bordered()
        .title(" events, newest first ")
        .border_style(Style::new().dim());
    let notes = Paragraph::new(lines).wrap(Wrap { trim: true }).block(block);
    frame.render_widget(notes, area);
}

fn note_line(note: &Note) -> Line<'_> {
    let text = Span::raw(note.text.as_str());
    let text = if note.is_bad { text.red() } else { text };
    Line::from(vec![format!("{:.2} s ", note.t_s).dim(), text])
}

fn counters(model: &Model) -> Paragraph<'_> {
    let count = &model.counters;
    let pair = |a: &str, av: u32, b: &str, bv: u32| {
        let bad = if bv == 0 {
            Style::new()
        } else {
            Style::new().yellow()
        };
        Line::from(vec![
            Span::raw(format!("{a:<7}{av:>8}  ")),
            Span::styled(format!("{b:<7}{bv:>7}"), bad),
        ])
    };
    let mut block = Block::bordered()
        .title(" device counters ")
        .border_style(Style::new().dim());
    if let Some(left) = &model.left {
        block = block.title_bottom(format!(" {} ", allowance_text(left)));
    }
    Paragraph::new(vec![
        pair("frames", count.frames, "lost", count.lost_frames),
        pair("setpts", count.setpoints, "bad", count.bad_frames),
        pair("pulses", count.pulses, "refused", count.refused),
    ])
    .block(block)
}

fn footer(model: &Model) -> Line<'static> {
    let key = |key: &'static str, action: &'static str, active: bool| {
        let key = Span::styled(format!(" {key} "), Style::new().reversed());
        let label = Span::raw(format!(" {action}   "));
        if active {
            [key, label]
        } else {
            [key.dim(), label.dim()]
        }
    };
    let mut spans = vec![Span::raw(" ")];
    if let Some(hands) = &model.hands {
        if let Some(text) = &hands.typing {
            spans.push("marker: ".bold());
            spans.push(Span::raw(format!("{text}▏")));
            spans.push("  enter: keep, esc: discard".dim());
            return Line::from(spans);
        }
        let verb = ["pause", "resume"][usize::from(hands.is_paused)];
        spans.extend(key("space", verb, true));
        spans.extend(key("←→", "channel", hands.channels.len() > 1));
        spans.extend(key("↑↓", "intensity ±5 %", true));
        spans.extend(key("m", "marker", true));
        spans.extend(key("q", "stop", true));
        return Line::from(spans);
    }
    spans.extend(key(
        "space",
        "stop now",
        model.is_on() || model.state == State::Armed,
    ));
    spans.extend(key("a", "acknowledge fault", model.state == State::Fault));
    spans.extend(key("q", "stop and quit", true));
    Line::from(spans)
}
