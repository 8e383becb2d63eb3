//! Colours, strokes and marks, and their replacements on a dark screen.

use std::fmt;

/// Red, green and blue of a colour on a light screen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Color(pub u8, pub u8, pub u8);

impl fmt::Display for Color {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "#{:02X}{:02X}{:02X}", self.0, self.1, self.2)
    }
}

impl Color {
    /// Returns the colour at the share `part`, 0 to 1, between this one and another.
    #[must_use]
    pub fn mix(self, other: Self, part: f64) -> Self {
        let mix =
            |a: u8, b: u8| (f64::from(a) + (f64::from(b) - f64::from(a)) * part).round() as u8;
        Self(
            mix(self.0, other.0),
            mix(self.1, other.1),
            mix(self.2, other.2),
        )
    }
}

/// Colour of text, axes and references.
pub const INK: Color = Color(0x1F, 0x23, 0x28);
/// Colour of secondary text.
pub const MUTED: Color = Color(0x59, 0x63, 0x6E);
/// Colour of grid lines.
pub const GRID: Color = Color(0xD8, 0xDE, 0xE4);
/// Background of parts that do not count.
pub const SHADE: Color = Color(0xEE, 0xF0, 0xF3);
/// Background of a picture.
pub const PAPER: Color = Color(0xFF, 0xFF, 0xFF);

/// Colour of a mark that is readable on every colour in light and dark, together with [`HALO`].
/// These two stay the same on a dark screen.
pub const EDGE: Color = Color(0x11, 0x11, 0x11);
/// Colour that surrounds [`EDGE`].
pub const HALO: Color = Color(0xFD, 0xFD, 0xFD);

/// Okabe and Ito's palette for all kinds of colour vision, without its yellow and black, which
/// vanish on white or dark (Color Universal Design, 2008). Its orange is darkened until it stands
/// out from white by 3:1 (WCAG 1.4.11); violet replaces its sky blue, which cannot be distinguished
/// from blue on dark.
pub const PALETTE: [Color; 6] = [
    Color(0x00, 0x72, 0xB2),
    Color(0xD5, 0x5E, 0x00),
    Color(0x00, 0x9E, 0x73),
    Color(0xCC, 0x79, 0xA7),
    Color(0xBF, 0x83, 0x00),
    Color(0x66, 0x39, 0xB7),
];
/// First additional colour, where six do not suffice.
pub const BROWN: Color = Color(0x8C, 0x56, 0x4B);
/// Second additional colour, where six do not suffice.
pub const SKY: Color = Color(0x2B, 0x8F, 0xA8);

/// Replacements of some colours on a dark screen.
const DARK: [(Color, Color); 8] = [
    (INK, Color(0xE6, 0xED, 0xF3)),
    (MUTED, Color(0x9D, 0xA7, 0xB1)),
    (GRID, Color(0x34, 0x3B, 0x43)),
    (SHADE, Color(0x1C, 0x22, 0x29)),
    (PAPER, Color(0x0D, 0x11, 0x17)),
    (PALETTE[0], Color(0x3D, 0x9B, 0xE0)),
    (PALETTE[5], Color(0xC4, 0xA7, 0xFF)),
    (BROWN, Color(0xC0, 0x8A, 0x7E)),
];

/// Returns the style rules that every figure needs, within the page or on its own.
#[must_use]
pub fn style() -> String {
    let dark = DARK.map(|(light, dark)| {
        format!(
            ".figure [fill=\"{light}\"]{{fill:{dark}}}.figure [stroke=\"{light}\"]{{stroke:{dark}}}\n"
        )
    });
    format!(
        "\n.figure text{{font-family:system-ui,-apple-system,\"Segoe UI\",Roboto,\"Helvetica Neue\",\
         Arial,sans-serif;font-variant-numeric:tabular-nums}}\n\
         .figure polyline{{stroke-linejoin:round}}\n\
         @media screen and (prefers-color-scheme:dark){{\n{}}}\n",
        dark.concat()
    )
}

/// Style of a line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stroke {
    /// Colour on a light screen.
    pub color: Color,
    /// Width, CSS pixels.
    pub width: f64,
}

/// Way in which an outline is painted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Paint {
    /// Filled with this colour.
    Full(Color),
    /// Filled so faintly that the background shows through.
    Tint(Color),
    /// Outline only, this many pixels wide.
    Ring(Color, f64),
}

/// Returns a line style of this colour, `width` CSS pixels wide.
#[must_use]
pub const fn stroke(color: Color, width: f64) -> Stroke {
    Stroke { color, width }
}

/// Shape of a mark at a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    /// Filled circle.
    Disc,
    /// Square with horizontal edges.
    Square,
    /// Triangle that points up.
    Up,
    /// Triangle that points down.
    Down,
    /// Square that stands on its corner.
    Diamond,
    /// Star with five points, for the settings with which the device is shipped.
    Star,
    /// Short upright stroke, for the end of a bar.
    End,
    /// Head of an arrow to the right, for a bar that continues.
    Beyond,
}

impl Shape {
    /// Shapes that distinguish series.
    pub const SERIES: [Self; 5] = [
        Self::Disc,
        Self::Square,
        Self::Up,
        Self::Down,
        Self::Diamond,
    ];

    /// Returns the corners around the middle, for a radius of 1; none for a disc.
    pub(super) fn corners(self) -> Vec<(f64, f64)> {
        let turned = |count: u32, start: f64, long: f64, short: f64| {
            let corner = |n: u32| {
                let angle = (f64::from(n) / f64::from(count) + start) * std::f64::consts::TAU;
                let radius = if n.is_multiple_of(2) { long } else { short };
                (radius * angle.cos(), radius * angle.sin())
            };
            // A square ends where it began, so that it is drawn as a mark and not as a box.
            let ends = if count == 4 { 5 } else { count };
            (0..ends).map(corner).collect()
        };
        match self {
            Self::Disc => Vec::new(),
            Self::Square => turned(4, 0.125, 1.2, 1.2),
            Self::Up => turned(3, -0.25, 1.25, 1.25),
            Self::Down => turned(3, 0.25, 1.25, 1.25),
            Self::Diamond => turned(4, 0.0, 1.3, 1.3),
            Self::Star => turned(10, -0.25, 2.2, 0.95),
            Self::End => vec![
                (-0.25, -1.0),
                (0.25, -1.0),
                (0.25, 0.0),
                (0.25, 1.0),
                (-0.25, 1.0),
            ],
            Self::Beyond => vec![(-1.0, -1.2), (0.6, 0.0), (-1.0, 1.2)],
        }
    }
}

/// Appearance of a channel in every figure, beside its number: ten marks that all differ.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChannelMark {
    /// Colour of the channel's lines.
    pub color: Color,
    /// Whether the mark is filled: it is for the first six channels; the others repeat the colours,
    /// hollow.
    pub filled: bool,
}

/// Returns the mark of a channel, from 1.
#[must_use]
pub fn channel_mark(number: u8) -> ChannelMark {
    let place = usize::from(number.saturating_sub(1));
    ChannelMark {
        color: PALETTE[place % PALETTE.len()],
        filled: place < PALETTE.len(),
    }
}

impl ChannelMark {
    /// Returns the paint of a dot: a disc or a ring.
    #[must_use]
    pub fn dot(self) -> Paint {
        if self.filled {
            Paint::Full(self.color)
        } else {
            Paint::Ring(self.color, 3.0)
        }
    }

    /// Returns the paint of the area between a line and zero; `None` if the mark is not filled.
    #[must_use]
    pub fn tint(self) -> Option<Paint> {
        self.filled.then_some(Paint::Tint(self.color))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ten_channels_have_ten_marks() {
        let marks = (1..=10).map(channel_mark).collect::<Vec<_>>();
        for (n, mark) in marks.iter().enumerate() {
            assert!(!marks[..n].contains(mark), "channel {}", n + 1);
        }
    }
}
