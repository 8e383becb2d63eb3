//! A whole figure: its title, its legend, its panels, and notes below them.

use super::canvas::{Canvas, Svg, Words, standalone};
use super::ink::{EDGE, HALO, INK, MUTED, Paint, Shape, Stroke, stroke};
use super::panel::{LetterScale, Margins, Panel};
use super::words::{width, wrap_text};

/// Width of every figure, CSS pixels; a page may scale it.
pub const WIDTH: f64 = 1000.0;
/// Height of one row of the legend, pixels.
const LEGEND: f64 = 22.0;
/// Height of one line of the subtitle or of the notes, pixels.
const NOTE: f64 = 18.0;

/// Symbol of a legend entry.
#[derive(Clone, Copy, Debug)]
pub enum Key {
    /// Line in this style.
    Line(Stroke),
    /// Filled box.
    Box(Paint),
    /// Single mark.
    Dot(Shape, Paint),
    /// Line with a mark on it.
    Marked(Stroke, Shape),
}

/// Content of a figure with titles, legend, panels and notes, from which its SVG is drawn.
#[derive(Clone, Debug, Default)]
pub struct Figure {
    /// Title above everything else, in bold; may be empty.
    pub title: String,
    /// Subtitle below the title; may be empty.
    pub subtitle: String,
    /// Description of the figure for screen readers.
    pub description: String,
    /// Legend: symbols with their meanings. It takes as many rows as it needs.
    pub legend: Vec<(Key, String)>,
    /// Rows of panels; the panels of one column are aligned.
    pub rows: Vec<Vec<Panel>>,
    /// Paragraphs below the panels.
    pub notes: Vec<String>,
}

impl Figure {
    /// Draws the figure for a page. The page must include the rules of [`super::ink::style`].
    #[must_use]
    pub fn svg(&self) -> Svg {
        let mut canvas = Canvas::default();
        let mut y = self.draw_head(&mut canvas);
        y = draw_legend(&mut canvas, LetterScale(1.0), (0.0, y), &self.legend, WIDTH);
        y = self.draw_panels(&mut canvas, y);
        if !self.notes.is_empty() {
            y += NOTE / 2.0;
        }
        for line in self
            .notes
            .iter()
            .flat_map(|note| wrap_text(12.0, note, WIDTH))
        {
            canvas.text((0.0, y + NOTE / 2.0), &line, Words::new(12.0, MUTED));
            y += NOTE;
        }
        canvas.svg((WIDTH, y), &self.description)
    }

    /// Draws the figure for a separate SVG file, which includes its own style rules.
    #[must_use]
    pub fn file(&self) -> String {
        standalone(&self.svg())
    }

    fn draw_head(&self, canvas: &mut Canvas) -> f64 {
        let mut y = 0.0;
        if !self.title.is_empty() {
            canvas.text((0.0, 14.0), &self.title, Words::new(15.0, INK).bold());
            y = 28.0;
        }
        let lines = wrap_text(12.0, &self.subtitle, WIDTH).into_iter();
        for line in lines.filter(|line| !line.is_empty()) {
            canvas.text((0.0, y + NOTE / 2.0), &line, Words::new(12.0, INK));
            y += NOTE;
        }
        y
    }

    fn draw_panels(&self, canvas: &mut Canvas, top: f64) -> f64 {
        let letters = LetterScale(1.0);
        let columns = self.rows.iter().map(Vec::len).max().unwrap_or(0);
        let column = |n: usize| self.rows.iter().filter_map(move |row| row.get(n));
        let largest_margin = |n: usize, part: fn(&Margins) -> f64| {
            let margins = column(n).map(|panel| part(&panel.margins(letters, WIDTH)));
            margins.fold(0.0, f64::max)
        };
        let lefts: Vec<f64> = (0..columns)
            .map(|n| largest_margin(n, |m| m.left))
            .collect();
        let rights: Vec<f64> = (0..columns)
            .map(|n| largest_margin(n, |m| m.right))
            .collect();
        let share = |n: usize| column(n).map(|panel| panel.share).fold(0.0, f64::max);
        let shares: Vec<f64> = (0..columns).map(share).collect();
        let room = WIDTH - lefts.iter().sum::<f64>() - rights.iter().sum::<f64>();
        let unit = room / shares.iter().sum::<f64>();
        let mut y = top;
        for (n, row) in self.rows.iter().enumerate() {
            let margins = |c: usize| row[c].margins(letters, unit * shares[c]);
            // A panel with nothing below it in its column needs no space for its axis.
            let counts = |c: &usize| self.rows.get(n + 1).is_none_or(|below| *c < below.len());
            let above = (0..row.len()).map(|c| margins(c).top).fold(0.0, f64::max);
            let high = row.iter().map(|panel| panel.height).fold(0.0, f64::max);
            let below = (0..row.len())
                .filter(counts)
                .map(|c| margins(c).bottom)
                .fold(0.0, f64::max);
            let mut x = 0.0;
            for (c, panel) in row.iter().enumerate() {
                let from = (x + lefts[c], y + above);
                let to = (from.0 + unit * shares[c], from.1 + panel.height);
                panel.draw(canvas, letters, above, (from, to));
                x = to.0 + rights[c];
            }
            y += above + high + below + 8.0;
        }
        y
    }
}

/// Draws legend entries from the position (`left`, `top`) on, in as many rows as needed. No entry
/// extends beyond `right`. Returns the vertical position below the last row.
pub fn draw_legend(
    canvas: &mut Canvas,
    letters: LetterScale,
    (left, top): super::At,
    entries: &[(Key, String)],
    right: f64,
) -> f64 {
    let style = letters.name();
    let key = 22.0 * letters.0;
    let (mut x, mut y) = (left, top + LEGEND * letters.0 / 2.0);
    for (sign, name) in entries {
        let wide = key + 6.0 + width(style.size, name, false);
        if x + wide > right && x > left {
            (x, y) = (left, y + LEGEND * letters.0);
        }
        let (line, middle) = ([(x, y), (x + key, y)], (x + key / 2.0, y));
        // Colours that stay the same on a dark screen get a halo in the legend too.
        match sign {
            Key::Line(own) if own.color == EDGE => canvas.line(&line, stroke(HALO, 4.8)),
            Key::Dot(_, Paint::Full(EDGE)) => {
                canvas.mark(middle, Shape::Disc, 5.5, Paint::Full(HALO));
            }
            _ => {}
        }
        match sign {
            Key::Line(stroke) => canvas.line(&line, *stroke),
            Key::Box(paint) => canvas.area((x, y - 6.0), (x + key, y + 6.0), *paint),
            Key::Dot(shape, paint) => canvas.mark(middle, *shape, 4.0, *paint),
            Key::Marked(stroke, shape) => {
                canvas.line(&line, *stroke);
                canvas.mark(middle, *shape, 4.0, Paint::Full(stroke.color));
            }
        }
        canvas.text((x + key + 6.0, y), name, style);
        x += wide + 22.0;
    }
    if entries.is_empty() {
        return top;
    }
    y + LEGEND * letters.0 / 2.0 + 4.0
}
