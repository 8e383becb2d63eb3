//! Elements of an SVG, in CSS pixels from its top left.

use super::At;
use super::ink::{self, Color, Paint, Shape, Stroke};
use crate::number;
use std::fmt::Write;

/// Collects the elements of an SVG figure in the order in which they are drawn.
#[derive(Clone, Debug, Default)]
pub struct Canvas {
    body: String,
}

/// Style of a text. A text is drawn from its position to the right, unless `anchor` says otherwise,
/// with half of its height above the position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Words {
    /// Height of the letters, CSS pixels.
    pub size: f64,
    /// Colour on a light screen.
    pub color: Color,
    /// Whether the letters are bold; by default they are regular.
    pub bold: bool,
    /// Part of the text that is placed at its position: 0 for its left end, 0.5 for its middle, 1
    /// for its right end.
    pub anchor: f64,
    /// Whether the text is rotated by 90° so that it reads from bottom to top.
    pub turned: bool,
}

impl Words {
    /// Returns a regular, horizontal style with the left end of the text at its position. `size` is
    /// the height of the letters, CSS pixels.
    #[must_use]
    pub const fn new(size: f64, color: Color) -> Self {
        Self {
            size,
            color,
            bold: false,
            anchor: 0.0,
            turned: false,
        }
    }

    /// Returns this style with bold letters instead of regular ones, and with all else unchanged.
    #[must_use]
    pub const fn bold(self) -> Self {
        Self { bold: true, ..self }
    }

    /// Returns this style with the middle of the text, instead of its left end, at its position.
    #[must_use]
    pub const fn centred(self) -> Self {
        Self {
            anchor: 0.5,
            ..self
        }
    }

    /// Returns this style with the right end of the text, instead of its left end, at its position.
    #[must_use]
    pub const fn right_aligned(self) -> Self {
        Self {
            anchor: 1.0,
            ..self
        }
    }

    /// Returns this style rotated by 90°, so that the text reads from bottom to top, and with its
    /// middle at its position.
    #[must_use]
    pub const fn rotated(self) -> Self {
        Self {
            turned: true,
            ..self.centred()
        }
    }
}

/// Returns a number rounded to a tenth, so that its text is short.
fn short(value: f64) -> f64 {
    // Adding 0 removes the sign of a negative zero.
    (value * 10.0).round() / 10.0 + 0.0
}

/// Formats points in the syntax of the SVG attribute `points`.
fn path(points: &[At]) -> String {
    let mut bytes = Vec::with_capacity(12 * points.len());
    for (x, y) in points {
        number::push(&mut bytes, short(*x));
        bytes.push(b',');
        number::push(&mut bytes, short(*y));
        bytes.push(b' ');
    }
    bytes.pop(); // the last space
    String::from_utf8(bytes).unwrap_or_default() // numbers are
}

/// A finished figure as SVG markup; empty if nothing is drawn. Only a [`Canvas`] creates it, and a
/// canvas escapes every text.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Svg(String);

impl std::ops::Deref for Svg {
    type Target = str;

    fn deref(&self) -> &str {
        &self.0
    }
}

impl Canvas {
    /// Appends one SVG element. It cannot fail, because it writes to a `String`.
    fn element(&mut self, element: std::fmt::Arguments) {
        let _ = writeln!(self.body, "{element}");
    }

    /// Draws a rectangle between two opposite corners.
    pub fn area(&mut self, from: At, to: At, paint: Paint) {
        let (x, y) = (short(from.0.min(to.0)), short(from.1.min(to.1)));
        let (w, h) = (short((to.0 - from.0).abs()), short((to.1 - from.1).abs()));
        self.element(format_args!(
            "<rect x=\"{x}\" y=\"{y}\" width=\"{w}\" height=\"{h}\" {}/>",
            paint_attributes(paint)
        ));
    }

    /// Draws a line through all points in their order; draws nothing for fewer than two points.
    pub fn line(&mut self, points: &[At], stroke: Stroke) {
        if points.len() < 2 {
            return;
        }
        let Stroke { color, width } = stroke;
        self.element(format_args!(
            "<polyline fill=\"none\" stroke=\"{color}\" stroke-width=\"{width}\" points=\"{}\"/>",
            path(points)
        ));
    }

    /// Draws a polygon with these corners, closed from the last to the first.
    pub fn polygon(&mut self, corners: &[At], paint: Paint) {
        let points = path(corners);
        self.element(format_args!(
            "<polygon {} points=\"{points}\"/>",
            paint_attributes(paint)
        ));
    }

    /// Draws a mark with its centre at a point; `radius` is in pixels.
    pub fn mark(&mut self, (x, y): At, shape: Shape, radius: f64, paint: Paint) {
        if shape != Shape::Disc {
            let corners = shape.corners().into_iter();
            let placed = corners.map(|(dx, dy)| (x + dx * radius, y + dy * radius));
            return self.polygon(&placed.collect::<Vec<_>>(), paint);
        }
        let (x, y, paint) = (short(x), short(y), paint_attributes(paint));
        self.element(format_args!(
            "<circle cx=\"{x}\" cy=\"{y}\" r=\"{radius}\" {paint}/>"
        ));
    }

    /// Draws a text; nothing if it is empty.
    pub fn text(&mut self, (x, y): At, text: &str, style: Words) {
        if text.is_empty() {
            return;
        }
        let (x, y) = (short(x), short(y));
        let anchor = match style.anchor {
            0.0 => "",
            1.0 => " text-anchor=\"end\"",
            _ => " text-anchor=\"middle\"",
        };
        let bold = if style.bold {
            " font-weight=\"bold\""
        } else {
            ""
        };
        let turned = match style.turned {
            true => format!(" transform=\"rotate(270,{x},{y})\""),
            false => String::new(),
        };
        self.element(format_args!(
            "<text x=\"{x}\" y=\"{y}\" dy=\"0.36em\" font-size=\"{}\" fill=\"{}\"{anchor}{bold}{turned}>{}</text>",
            short(style.size),
            style.color,
            escape(text)
        ));
    }

    /// Returns the drawn elements as an SVG of this width and height, which scales with the page
    /// that shows it. Screen readers read `description`.
    #[must_use]
    pub fn svg(&self, (width, height): At, description: &str) -> Svg {
        let (width, height) = (width.ceil(), height.ceil());
        Svg(format!(
            "<svg class=\"figure\" xmlns=\"http://www.w3.org/2000/svg\" role=\"img\" \
             width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\" \
             aria-label=\"{}\">\n{}</svg>\n",
            escape(description),
            self.body
        ))
    }
}

fn paint_attributes(paint: Paint) -> String {
    match paint {
        Paint::Full(color) => format!("fill=\"{color}\""),
        Paint::Tint(color) => format!("fill=\"{color}\" fill-opacity=\"0.22\""),
        Paint::Ring(color, width) => {
            format!("fill=\"none\" stroke=\"{color}\" stroke-width=\"{width}\"")
        }
    }
}

/// Escapes a text for HTML, SVG and XML, also within quotes. Control characters, and characters
/// that an XML document must not contain (XML 1.0, section 2.2), become U+FFFD.
#[must_use]
pub fn escape(text: &str) -> String {
    let mut safe = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => safe.push_str("&amp;"),
            '<' => safe.push_str("&lt;"),
            '>' => safe.push_str("&gt;"),
            '"' => safe.push_str("&quot;"),
            '\t' | '\n' | '\r' => safe.push(c),
            '\u{fffe}' | '\u{ffff}' => safe.push(char::REPLACEMENT_CHARACTER),
            _ if c.is_control() => safe.push(char::REPLACEMENT_CHARACTER),
            _ => safe.push(c),
        }
    }
    safe
}

/// Returns the figure as the content of an SVG file, with style rules and background included.
#[must_use]
pub fn standalone(figure: &Svg) -> String {
    let open = figure.find('>').map_or(0, |end| end + 1);
    let (head, body) = figure.split_at(open);
    let (style, paper) = (ink::style(), ink::PAPER);
    format!(
        "{head}<style>{style}</style><rect width=\"100%\" height=\"100%\" fill=\"{paper}\"/>{body}"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_character_is_escaped_replaced_or_itself() {
        let escaped = escape("<b title=\"ä\">\t1 & 2\u{1}\u{1b}\u{7f}\u{85}\u{fffe}\u{ffff}筋\r\n");
        let meant = "&lt;b title=&quot;ä&quot;&gt;\t1 &amp; 2\u{fffd}\u{fffd}\u{fffd}\u{fffd}\u{fffd}\u{fffd}筋\r\n";
        assert_eq!(escaped, meant);
        for c in '\0'..=char::MAX {
            let is_legal = |c: char| matches!(c, '\t' | '\n' | '\r' | ' '..='\u{d7ff}' | '\u{e000}'..='\u{fffd}' | '\u{10000}'..);
            assert!(escape(&c.to_string()).chars().all(is_legal), "{c:?}");
        }
    }
}
