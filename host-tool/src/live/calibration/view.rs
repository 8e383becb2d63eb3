//! Draws the calibration's frame for 80 × 24 characters.

use super::ScreenState;
use super::digits::big_number;
use host_core::calibration::{Level, Phase, Step, View};
use ratatui::Frame;
use ratatui::layout::{Alignment, Constraint, Layout, Rect};
use ratatui::style::{Color, Modifier, Style, Stylize};
use ratatui::text::{Line, Span};
use ratatui::widgets::{Block, Gauge, Paragraph, Wrap};

/// Columns and rows that the whole frame needs.
const NEEDED: (u16, u16) = (80, 24);

/// Returns whether `area` is too small for the whole frame.
#[must_use]
pub const fn is_small(area: Rect) -> bool {
    area.width < NEEDED.0 || area.height < NEEDED.1
}

/// Draws the whole screen; if there is no room, only whether stimulation is on and how to end it.
pub fn draw(frame: &mut Frame<'_>, sight: &ScreenState) {
    if is_small(frame.area()) {
        frame.render_widget(small(sight), frame.area());
        return;
    }
    let [title, status, middle, below, done, keys, more] = Layout::vertical([
        Constraint::Length(1),
        Constraint::Length(1),
        Constraint::Min(11),
        Constraint::Length(8),
        Constraint::Length(1),
        Constraint::Length(1),
        Constraint::Length(1),
    ])
    .areas(frame.area());
    let Some(view) = &sight.view else {
        frame.render_widget("waiting for the device", middle);
        return;
    };
    draw_title(frame, title, sight, view);
    frame.render_widget(status_line(view), status);
    draw_step(frame, middle, view, &sight.typed);
    let [left, right] =
        Layout::horizontal([Constraint::Length(26), Constraint::Fill(1)]).areas(below);
    frame.render_widget(results_panel(view), left);
    frame.render_widget(notes(sight), right);
    draw_done(frame, done, view);
    let [first, second] = footer(view);
    frame.render_widget(first, keys);
    frame.render_widget(second, more);
}

fn small(sight: &ScreenState) -> Paragraph<'_> {
    let is_on = (sight.view.as_ref()).is_some_and(|view| view.phase == Phase::On);
    let state = match is_on {
        true => "ON".red().bold(),
        false => "SILENT".bold(),
    };
    let (columns, rows) = NEEDED;
    let lines = vec![
        Line::from(vec![state, "  esc END".into()]),
        Line::from(format!("too small: {columns} x {rows} needed")),
    ];
    Paragraph::new(lines)
}

fn draw_title(frame: &mut Frame<'_>, area: Rect, sight: &ScreenState, view: &View) {
    let right = format!("{}  {:.1} min ", sight.device, view.t_s / 60.0);
    let width = u16::try_from(right.chars().count()).unwrap_or(u16::MAX);
    let [title, time] =
        Layout::horizontal([Constraint::Fill(1), Constraint::Length(width.min(50))]).areas(area);
    let wearer = format!("{} ", sight.wearer);
    let left = Line::from(vec![" flexor calibrate ".bold(), Span::raw(wearer)]);
    frame.render_widget(left, title);
    frame.render_widget(Line::from(right).alignment(Alignment::Right).dim(), time);
}

fn status_line(view: &View) -> Line<'_> {
    let (word, color) = match view.phase {
        Phase::Ready => (" SILENT, READY ".to_owned(), Color::Green),
        Phase::On => (format!(" ON {:.1} s ", view.left_s), Color::Red),
        Phase::Rest => (format!(" SILENT, REST {:.1} s ", view.left_s), Color::Blue),
        Phase::Done => (" DONE ".to_owned(), Color::Gray),
    };
    let style = Style::new().fg(Color::Black).bg(color);
    let badge = Span::styled(word, style.add_modifier(Modifier::BOLD));
    let (electrode, electrodes, channel, place) =
        (view.electrode, view.of, view.channel, &view.place);
    let where_ = format!("  electrode {electrode} of {electrodes}, channel {channel}: {place}");
    let mut line = Line::from(vec![Span::raw(" "), badge]);
    if view.complains {
        line.push_span("  wearer reports: TOO MUCH".red().bold());
    }
    line.push_span(Span::raw(where_));
    line
}

fn step_number(step: Step) -> usize {
    let place = Step::ALL.iter().position(|item| *item == step);
    place.map_or(0, |place| place + 1)
}

fn draw_step(frame: &mut Frame<'_>, area: Rect, view: &View, typed: &str) {
    let title = format!(
        " step {} of {}: {} ",
        step_number(view.step),
        Step::ALL.len(),
        view.step.name()
    );
    let mut lines = vec![Line::from(view.step.task()), Line::from("")];
    let color = if view.phase == Phase::On {
        Color::Red
    } else {
        Color::Reset
    };
    for row in big_number(&view.level.to_string(), view.unit) {
        lines.push(Line::styled(format!("    {row}"), Style::new().fg(color)));
    }
    lines.push(Line::from(""));
    lines.push(prompt_line(view, typed));
    let block = Block::bordered().title(title.bold());
    frame.render_widget(Paragraph::new(lines).block(block), area);
}

/// Returns the question, or the effect of the next key.
fn prompt_line<'a>(view: &View, typed: &'a str) -> Line<'a> {
    let gives = |level: Level| format!("gives {level} {}", view.unit);
    if let Some(question) = view.question {
        return match view.step {
            Step::Points => Line::from(vec![question.yellow().bold(), " ".into(), typed.into()]),
            _ => Line::from(vec![question.yellow().bold(), "  y / n".into()]),
        };
    }
    match (view.phase, view.raise, view.again) {
        (Phase::On, ..) => Line::from(
            "↓ lowers by one step at once; t (too much) turns the output off at once".red(),
        ),
        (Phase::Rest, ..) => Line::from("the muscle rests; no stimulation"),
        (Phase::Done, ..) => Line::from("every electrode is done"),
        (_, _, Some(again)) if view.confirms => {
            Line::from(format!("it moved: a {} once more to confirm", gives(again)).yellow())
        }
        (_, Some(raise), Some(again)) => {
            Line::from(format!("↑ {}, a {} again", gives(raise), gives(again)))
        }
        (_, Some(raise), None) => Line::from(format!("↑ {}", gives(raise))),
        (_, None, Some(again)) => Line::from(format!("a {} (the highest level)", gives(again))),
        (_, None, None) => Line::from("highest level reached: ↓ lowers, x leaves the channel out"),
    }
}

fn results_panel(view: &View) -> Paragraph<'_> {
    let level = |name: &str, level: Option<Level>| {
        let value = level.map_or_else(|| "–".to_owned(), |level| format!("{level} {}", view.unit));
        Line::from(format!("{name:<10} {value}"))
    };
    let found = &view.found;
    let moves = found.moves.as_ref().map(|moves| moves.join(", "));
    let lines = vec![
        level("placement", found.placement),
        level("threshold", found.threshold),
        level("limit", found.limit),
        level("minimum", found.minimum),
        level("maximum", found.maximum),
        Line::from(format!(
            "moves      {}",
            moves.unwrap_or_else(|| "–".into())
        )),
    ];
    let block = Block::bordered().title(" found here ");
    Paragraph::new(lines).block(block.border_style(Style::new().dim()))
}

fn notes(sight: &ScreenState) -> Paragraph<'_> {
    let lines: Vec<Line<'_>> = (sight.notes.iter())
        .map(|(t_s, text, is_bad)| {
            let text = Span::raw(text.as_str());
            let text = if *is_bad { text.red() } else { text };
            Line::from(vec![format!("{t_s:.0} s ").dim(), text])
        })
        .collect();
    let block = Block::bordered().title(" newest first ");
    let block = block.border_style(Style::new().dim());
    Paragraph::new(lines).wrap(Wrap { trim: true }).block(block)
}

/// Draws the finished share of the steps of all electrodes.
fn draw_done(frame: &mut Frame<'_>, area: Rect, view: &View) {
    let steps = Step::ALL.len();
    let before =
        view.electrode.saturating_sub(1) * steps + step_number(view.step).saturating_sub(1);
    let total = (view.of * steps).max(1);
    let part = match view.phase {
        Phase::Done => 1.0,
        _ => before as f64 / total as f64,
    };
    let gauge = Gauge::default().ratio(part.clamp(0.0, 1.0));
    frame.render_widget(gauge.gauge_style(Color::Cyan), area);
}

fn footer(view: &View) -> [Line<'static>; 2] {
    let key = |key: &'static str, action: &'static str, active: bool| {
        let key = Span::styled(format!(" {key} "), Style::new().reversed());
        let label = Span::raw(format!(" {action}  "));
        match active {
            true => [key, label],
            false => [key.dim(), label.dim()],
        }
    };
    let is_asked = view.question.is_some();
    let is_ready = !is_asked && view.phase == Phase::Ready;
    let is_typing = is_asked && view.step == Step::Points;
    let mut first = vec![Span::raw(" ")];
    first.extend(key("↑", "raise", is_ready && view.raise.is_some()));
    first.extend(key("↓", "lower", !is_typing));
    first.extend(key("a", "again", is_ready && view.again.is_some()));
    first.extend(key("y", "yes", is_asked && !is_typing));
    first.extend(key("n", "no", is_asked && !is_typing));
    first.extend(key("enter", "names", is_typing));
    let mut second = vec![Span::raw(" ")];
    second.extend(key("t", "too much", !is_typing));
    second.extend(key("e", "enough", is_ready && view.step == Step::Comfort));
    second.extend(key("x", "leave out", !is_typing));
    second.extend(key("esc", "END: silent at once (space, q)", true));
    [Line::from(first), Line::from(second)]
}
