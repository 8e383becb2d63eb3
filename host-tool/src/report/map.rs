//! A stability map as a picture: cells coloured by class, theory's boundary as
//! a line over them, a dot where the two disagree.

use super::canvas::{
    Area, Drawn, INK, Key, MUTED, WIDTH, anchored, bold, legend, line, px, standalone, svg, text,
    text_width, turned,
};
use super::map_lines;
use crate::stability::{Cell, Class, Map, Panel};
use plotters::prelude::*;
use plotters::style::text_anchor::HPos;

const GAP: i32 = 28;
const PANEL_TITLE: i32 = 26;
const AXIS: i32 = 40;
/// For the name of the rows, set upwards beside their labels.
const ROW_NAME: i32 = 20;
const LINE: i32 = 19;
const CELL_WIDTH: (i32, i32) = (11, 34);
/// The line and the dots, readable on every cell in light and dark: these two
/// are never exchanged for a dark screen's.
pub(super) const EDGE: RGBColor = RGBColor(0x11, 0x11, 0x11);
pub(super) const HALO: RGBColor = RGBColor(0xFD, 0xFD, 0xFD);

/// First and last colour of the classes of each verdict: what holds is blue,
/// what fails orange, what fails badly dark red.
const RAMPS: [(RGBColor, RGBColor); 3] = [
    (RGBColor(0xCF, 0xE8, 0xF7), RGBColor(0x1B, 0x6C, 0xA0)),
    (RGBColor(0xF6, 0xC8, 0x60), RGBColor(0xD9, 0x7B, 0x00)),
    (RGBColor(0xC2, 0x4A, 0x00), RGBColor(0x7A, 0x22, 0x00)),
];

/// Sizes of one picture, CSS pixels.
struct Layout {
    margin: i32,
    cell: (i32, i32),
    per_row: i32,
    /// Top of the first panel.
    top: i32,
    panel: (i32, i32),
    height: i32,
}

/// The map as a file of its own: as lines where theory gives numbers, else as
/// coloured cells.
pub fn picture(map: &Map) -> String {
    if map.panels.iter().any(|panel| !panel.told.is_empty()) {
        return map_lines::picture(map);
    }
    let keys = key_rows(map);
    let words = caption(map);
    let layout = Layout::of(map, keys.len() as i32, words.len() as i32);
    standalone(&svg(layout.height, map.title, |root| {
        let title = bold(text(15, INK));
        root.draw(&Text::new(map.title, (0, px(14)), title))?;
        for (row, y) in keys.iter().zip((40..).step_by(22)) {
            let entries: Vec<_> = row
                .iter()
                .map(|(c, n)| (Key::Box(c.filled()), &**n))
                .collect();
            legend(root, 0, y, &entries)?;
        }
        for (panel, n) in map.panels.iter().zip(0..) {
            let column = n % layout.per_row;
            let left = layout.margin + column * (layout.panel.0 + GAP);
            let top = layout.top + n / layout.per_row * layout.panel.1;
            draw_panel(root, map, panel, &layout, (left, top))?;
        }
        let below = layout.height - words.len() as i32 * LINE;
        for (words, y) in words.into_iter().zip((below..).step_by(LINE as usize)) {
            root.draw(&Text::new(words, (0, px(y)), text(12, MUTED)))?;
        }
        Ok(())
    }))
}

impl Layout {
    fn of(map: &Map, keys: i32, words: i32) -> Self {
        let columns = map.across.labels.len().max(1) as i32;
        let rows = map.down.labels.len() as i32;
        let widest = map.down.labels.iter().map(|l| text_width(11, l)).max();
        let margin = widest.unwrap_or(0) + 12 + ROW_NAME;
        let smallest = margin + columns * CELL_WIDTH.0 + GAP;
        let panels = map.panels.len().max(1) as i32;
        let per_row = (WIDTH / smallest).clamp(1, panels);
        let width = ((WIDTH + GAP) / per_row - GAP - margin) / columns;
        let cell = (width.clamp(CELL_WIDTH.0, CELL_WIDTH.1), 18);
        let panel = (
            margin + columns * cell.0,
            PANEL_TITLE + rows * cell.1 + AXIS + 12,
        );
        let top = 40 + keys * 22;
        let panel_rows = (panels + per_row - 1) / per_row;
        Self {
            margin,
            cell,
            per_row,
            top,
            panel,
            height: top + panel_rows * panel.1 + 10 + words * LINE,
        }
    }
}

/// The colour of each class.
fn color(map: &Map, class: &Class) -> RGBColor {
    let alike: Vec<_> = map
        .classes
        .iter()
        .filter(|c| c.verdict == class.verdict)
        .collect();
    let place = alike.iter().position(|c| *c == class).unwrap_or(0);
    let part = place as f64 / (alike.len() - 1).max(1) as f64;
    let (from, to) = RAMPS[usize::from(class.verdict.min(2))];
    let mix = |a: u8, b: u8| (f64::from(a) + (f64::from(b) - f64::from(a)) * part).round() as u8;
    RGBColor(mix(from.0, to.0), mix(from.1, to.1), mix(from.2, to.2))
}

/// The classes as legend rows that fit the width.
fn key_rows(map: &Map) -> Vec<Vec<(RGBColor, String)>> {
    let mut rows = vec![Vec::new()];
    let mut used = 0;
    for class in &map.classes {
        let name = match class.verdict {
            0 => class.meaning.to_owned(),
            _ => format!("{} (fails)", class.meaning),
        };
        let width = 28 + text_width(13, &name) + 24;
        if used + width > WIDTH && used > 0 {
            rows.push(Vec::new());
            used = 0;
        }
        used += width;
        rows.last_mut()
            .expect("begins with one")
            .push((color(map, class), name));
    }
    rows
}

/// What stands below the panels, in lines that fit the width.
fn caption(map: &Map) -> Vec<String> {
    let agreement = map.agreement();
    let mut paragraphs = vec![format!("Colour: {}.", map.quantity)];
    paragraphs.push(format!(
        "Line: where theory's verdict changes; {}",
        map.theory
    ));
    paragraphs.push(format!(
        "Dots: {} of {} cells disagree with theory, {} worse and {} better.",
        agreement.worse + agreement.better,
        agreement.predicted,
        agreement.worse,
        agreement.better
    ));
    folded(&paragraphs)
}

/// The paragraphs in lines that fit the width.
pub(super) fn folded(paragraphs: &[String]) -> Vec<String> {
    let mut lines = Vec::new();
    for paragraph in paragraphs {
        let mut line = String::new();
        for word in paragraph.split_whitespace() {
            if text_width(12, &line) + text_width(12, word) > WIDTH - 20 {
                lines.push(std::mem::take(&mut line));
            }
            line.push_str(word);
            line.push(' ');
        }
        lines.push(line);
    }
    lines
}

fn draw_panel(root: &Area<'_>, map: &Map, panel: &Panel, layout: &Layout, at: (i32, i32)) -> Drawn {
    let (left, top) = (at.0, at.1 + PANEL_TITLE);
    let style = bold(text(12, INK));
    let title = Text::new(
        panel.title.clone(),
        (px(left - ROW_NAME), px(at.1 + 12)),
        style,
    );
    root.draw(&title)?;
    let (width, height) = layout.cell;
    let corner = |row: usize, column: usize| {
        (
            px(left + column as i32 * width),
            px(top + row as i32 * height),
        )
    };
    for (r, row) in panel.rows.iter().enumerate() {
        for (c, cell) in row.iter().enumerate() {
            let fill = color(map, &map.classes[cell.class]).filled();
            // A hair of background between cells.
            let (x, y) = corner(r + 1, c + 1);
            root.draw(&Rectangle::new([corner(r, c), (x - 2, y - 2)], fill))?;
        }
    }
    for (color, tenths) in [(HALO, 48), (EDGE, 24)] {
        for (from, to) in boundary(&panel.rows) {
            let path = [corner(from.0, from.1), corner(to.0, to.1)];
            root.draw(&PathElement::new(path, line(color, tenths)))?;
        }
    }
    for (r, row) in panel.rows.iter().enumerate() {
        for (c, cell) in row.iter().enumerate() {
            if cell.predicted.is_some_and(|p| p != map.verdict(cell)) {
                let (x, y) = corner(r, c);
                let middle = (x + px(width) / 2, y + px(height) / 2);
                root.draw(&Circle::new(middle, px(3), HALO.filled()))?;
                root.draw(&Circle::new(middle, px(2), EDGE.filled()))?;
            }
        }
    }
    draw_axes(root, map, layout, (left, top))
}

/// An edge between cells, from one corner to the next; (row, column).
type Edge = ((usize, usize), (usize, usize));

/// The edges between cells of different prediction. Rows of which theory says
/// nothing have none above and below.
fn boundary(rows: &[Vec<Cell>]) -> Vec<Edge> {
    let speaks = |row: &[Cell]| row.iter().any(|cell| cell.predicted.is_some());
    let differ = |a: &Cell, b: &Cell| a.predicted != b.predicted;
    let mut edges = Vec::new();
    for (r, row) in rows.iter().enumerate() {
        for (c, cell) in row.iter().enumerate() {
            if row.get(c + 1).is_some_and(|right| differ(cell, right)) {
                edges.push(((r, c + 1), (r + 1, c + 1)));
            }
            let below = rows.get(r + 1).filter(|below| speaks(below) && speaks(row));
            let below = below.and_then(|row| row.get(c));
            if below.is_some_and(|below| differ(cell, below)) {
                edges.push(((r + 1, c), (r + 1, c + 1)));
            }
        }
    }
    edges
}

fn draw_axes(root: &Area<'_>, map: &Map, layout: &Layout, at: (i32, i32)) -> Drawn {
    let (left, top) = at;
    let (width, height) = layout.cell;
    let right = anchored(text(11, MUTED), HPos::Right);
    for (label, y) in map.down.labels.iter().zip((top..).step_by(height as usize)) {
        let at = (px(left - 5), px(y + height / 2));
        root.draw(&Text::new(label.clone(), at, right.clone()))?;
    }
    let bottom = top + map.down.labels.len() as i32 * height;
    let middle = anchored(text(11, MUTED), HPos::Center);
    let widest = map.across.labels.iter().map(|l| text_width(11, l)).max();
    let every = (widest.unwrap_or(0) + 6 + width - 1) / width;
    for (n, label) in map
        .across
        .labels
        .iter()
        .enumerate()
        .step_by(every.max(1) as usize)
    {
        let at = (px(left + n as i32 * width + width / 2), px(bottom + 10));
        root.draw(&Text::new(label.clone(), at, middle.clone()))?;
    }
    let at = (px(left), px(bottom + 27));
    root.draw(&Text::new(map.across.caption(), at, text(11, INK)))?;
    let at = (px(left - layout.margin + 8), px((top + bottom) / 2));
    root.draw(&Text::new(map.down.caption(), at, turned(text(11, INK))))?;
    Ok(())
}
