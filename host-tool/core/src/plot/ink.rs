//! Colours, strokes and marks, and their replacements on a dark screen.

use std::fmt;

/// Colour on a light screen: its red, green and blue parts, 0 to 255.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Color(pub u8, pub u8, pub u8);

impl fmt::Display for Color {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "#{:02X}{:02X}{:02X}", self.0, self.1, self.2)
    }
}

impl Color {
    /// Mixes this colour with `other`. `part` is the share of `other`, 0 to 1.
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

/// Colour of text, axes and the reference that a controller follows.
pub const INK: Color = Color(0x1F, 0x23, 0x28);
/// Colour of secondary text, such as tick labels and notes.
pub const MUTED: Color = Color(0x59, 0x63, 0x6E);
/// Colour of grid lines.
pub const GRID: Color = Color(0xD8, 0xDE, 0xE4);
/// Background of parts of a plot that are not judged.
pub const SHADE: Color = Color(0xEE, 0xF0, 0xF3);
/// Background of a figure.
pub const PAPER: Color = Color(0xFF, 0xFF, 0xFF);

/// Colour of a mark that must be readable on every background, light or dark; [`HALO`] surrounds
/// it. Both stay the same on a dark screen.
pub const EDGE: Color = Color(0x11, 0x11, 0x11);
/// Colour around a mark in the colour [`EDGE`].
pub const HALO: Color = Color(0xFD, 0xFD, 0xFD);

/// Colours that people with any kind of colour vision can distinguish, after Okabe and Ito (Color
/// Universal Design, 2008). Their yellow and black are left out, because these vanish on white or
/// on dark. Their orange is darkened to a contrast of 3:1 with white (WCAG 1.4.11). Violet replaces
/// their sky blue, which cannot be distinguished from blue on dark.
pub const PALETTE: [Color; 6] = [
    Color(0x00, 0x72, 0xB2),
    Color(0xD5, 0x5E, 0x00),
    Color(0x00, 0x9E, 0x73),
    Color(0xCC, 0x79, 0xA7),
    Color(0xBF, 0x83, 0x00),
    Color(0x66, 0x39, 0xB7),
];
/// Seventh colour, for figures that need more colours than [`PALETTE`] has.
pub const BROWN: Color = Color(0x8C, 0x56, 0x4B);
/// Eighth colour, for figures that need more colours than [`PALETTE`] has.
pub const SKY: Color = Color(0x2B, 0x8F, 0xA8);

/// Colours that are replaced on a dark screen: the colour on a light screen, and its replacement.
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

/// Returns the CSS rules that every figure needs, in a page or in an SVG file.
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

/// Colour and width of a line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stroke {
    /// Colour on a light screen.
    pub color: Color,
    /// Width, CSS pixels.
    pub width: f64,
}

/// How the area inside an outline is painted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Paint {
    /// Filled with this colour.
    Full(Color),
    /// Filled with this colour, almost transparent.
    Tint(Color),
    /// Not filled: only an outline in this colour, with this width in pixels.
    Ring(Color, f64),
}

/// Returns a line style with this colour. `width` is in CSS pixels.
#[must_use]
pub const fn stroke(color: Color, width: f64) -> Stroke {
    Stroke { color, width }
}

/// Shape of a mark that is drawn at a point.
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
    /// Arrowhead that points right, for a bar that continues beyond the plot.
    Beyond,
}

impl Shape {
    /// Shapes for the points of different series in one plot.
    pub const SERIES: [Self; 5] = [
        Self::Disc,
        Self::Square,
        Self::Up,
        Self::Down,
        Self::Diamond,
    ];

    /// Returns the corners of the shape around its centre, for a radius of 1; an empty list for a
    /// disc.
    pub(super) fn corners(self) -> Vec<(f64, f64)> {
        let turned = |count: u32, start: f64, long: f64, short: f64| {
            let corner = |n: u32| {
                let angle = (f64::from(n) / f64::from(count) + start) * std::f64::consts::TAU;
                let radius = if n.is_multiple_of(2) { long } else { short };
                (radius * libm::cos(angle), radius * libm::sin(angle))
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

/// Colour and filling by which a channel is recognized in every figure. The ten channels have ten
/// different marks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChannelMark {
    /// Colour of the channel's lines.
    pub color: Color,
    /// Whether the mark is filled. The marks of the first six channels are filled; those of the
    /// other channels repeat the colours as rings.
    pub filled: bool,
}

/// Returns the mark of the channel with this number, from 1.
#[must_use]
pub fn channel_mark(number: u8) -> ChannelMark {
    let place = usize::from(number.saturating_sub(1));
    ChannelMark {
        color: PALETTE[place % PALETTE.len()],
        filled: place < PALETTE.len(),
    }
}

impl ChannelMark {
    /// Returns the paint of a mark's dot: a filled disc or a ring.
    #[must_use]
    pub fn dot(self) -> Paint {
        if self.filled {
            Paint::Full(self.color)
        } else {
            Paint::Ring(self.color, 3.0)
        }
    }

    /// Returns the paint for the area between a channel's curve and zero; `None` for a channel
    /// whose mark is not filled.
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
