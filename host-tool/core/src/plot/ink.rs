//! Colours, strokes and marks, and what a dark screen shows instead.

use std::fmt;

/// Red, green, blue on a light screen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Color(pub u8, pub u8, pub u8);

impl fmt::Display for Color {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "#{:02X}{:02X}{:02X}", self.0, self.1, self.2)
    }
}

impl Color {
    /// The colour `part` of the way to another, 0 to 1.
    #[must_use]
    pub fn towards(self, other: Self, part: f64) -> Self {
        let mix =
            |a: u8, b: u8| (f64::from(a) + (f64::from(b) - f64::from(a)) * part).round() as u8;
        Self(
            mix(self.0, other.0),
            mix(self.1, other.1),
            mix(self.2, other.2),
        )
    }
}

/// Text, axes and targets.
pub const INK: Color = Color(0x1F, 0x23, 0x28);
/// Secondary text.
pub const MUTED: Color = Color(0x59, 0x63, 0x6E);
/// Grid lines.
pub const GRID: Color = Color(0xD8, 0xDE, 0xE4);
/// Background of what does not count.
pub const SHADE: Color = Color(0xEE, 0xF0, 0xF3);
/// A picture's own background.
pub const PAPER: Color = Color(0xFF, 0xFF, 0xFF);

/// A mark and what sets it off, readable on every colour in light and dark: these
/// two are never exchanged for a dark screen's.
pub const EDGE: Color = Color(0x11, 0x11, 0x11);
/// What sets [`EDGE`] off.
pub const HALO: Color = Color(0xFD, 0xFD, 0xFD);

/// Okabe and Ito's palette for all kinds of colour vision, without its yellow and
/// black, which vanish on white or dark (Color Universal Design, 2008). Its orange
/// is darkened until it stands out from white by 3:1 (WCAG 1.4.11); violet stands
/// for its sky blue, which in dark cannot be told from blue.
pub const PALETTE: [Color; 6] = [
    Color(0x00, 0x72, 0xB2),
    Color(0xD5, 0x5E, 0x00),
    Color(0x00, 0x9E, 0x73),
    Color(0xCC, 0x79, 0xA7),
    Color(0xBF, 0x83, 0x00),
    Color(0x66, 0x39, 0xB7),
];
/// Two more, where six do not suffice.
pub const BROWN: Color = Color(0x8C, 0x56, 0x4B);
/// The other.
pub const SKY: Color = Color(0x2B, 0x8F, 0xA8);

/// What a dark screen shows instead of some colours.
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

/// Rules every figure needs, inside the page or on its own.
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

/// A line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stroke {
    /// On a light screen.
    pub color: Color,
    /// CSS pixels.
    pub width: f64,
}

/// How an outline is painted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Paint {
    /// Filled.
    Full(Color),
    /// Filled so faintly that the ground shows through.
    Tint(Color),
    /// Its outline alone, this many pixels wide.
    Ring(Color, f64),
}

/// A line of this colour, `width` CSS pixels wide.
#[must_use]
pub const fn stroke(color: Color, width: f64) -> Stroke {
    Stroke { color, width }
}

/// What marks a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    /// A disc.
    Disc,
    /// A square.
    Square,
    /// A triangle on its foot.
    Up,
    /// A triangle on its tip.
    Down,
    /// A square on its corner.
    Diamond,
    /// Five points: what is shipped.
    Star,
    /// A short upright stroke: the end of a bar.
    End,
    /// The head of an arrow to the right: the bar goes on.
    Beyond,
}

impl Shape {
    /// Those that mark series.
    pub const SERIES: [Self; 5] = [
        Self::Disc,
        Self::Square,
        Self::Up,
        Self::Down,
        Self::Diamond,
    ];

    /// Corners around its middle, for a radius of 1; none for a disc.
    pub(super) fn corners(self) -> Vec<(f64, f64)> {
        let turned = |count: u32, start: f64, long: f64, short: f64| {
            let corner = |n: u32| {
                let angle = (f64::from(n) / f64::from(count) + start) * std::f64::consts::TAU;
                let radius = if n.is_multiple_of(2) { long } else { short };
                (radius * angle.cos(), radius * angle.sin())
            };
            // A square ends where it began: a mark is no box.
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

/// How a channel is drawn in every figure, beside its number: ten marks, no two
/// alike.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChannelMark {
    /// Of its lines.
    pub color: Color,
    /// The first six colours are filled; the others come again, hollow.
    pub filled: bool,
}

/// The mark of a channel, 1-based.
#[must_use]
pub fn channel_mark(number: u8) -> ChannelMark {
    let place = usize::from(number.saturating_sub(1));
    ChannelMark {
        color: PALETTE[place % PALETTE.len()],
        filled: place < PALETTE.len(),
    }
}

impl ChannelMark {
    /// For a dot: a disc or a ring.
    #[must_use]
    pub fn dot(self) -> Paint {
        if self.filled {
            Paint::Full(self.color)
        } else {
            Paint::Ring(self.color, 3.0)
        }
    }

    /// For what lies between a line and its zero, if that is filled.
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
