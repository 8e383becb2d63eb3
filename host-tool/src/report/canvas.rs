//! A plotters area that becomes a crisp SVG: colours, text sizes, legends.
//!
//! plotters rounds to whole units, so everything is drawn `SCALE` times larger
//! than shown. Colours of text, grid and shade have a second value for dark
//! screens, chosen by the style sheet through the colour itself.

use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

/// Units per CSS pixel.
const SCALE: u32 = 4;
/// Width of every figure, CSS pixels.
pub(super) const WIDTH: i32 = 1000;

/// A region of a figure.
pub(super) type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
/// Drawing into a string fails only where a figure contradicts itself.
pub(super) type Drawn = Result<(), Box<dyn std::error::Error>>;

/// Text, axes and targets.
pub(super) const INK: RGBColor = RGBColor(0x1F, 0x23, 0x28);
/// Secondary text.
pub(super) const MUTED: RGBColor = RGBColor(0x59, 0x63, 0x6E);
/// Grid lines.
pub(super) const GRID: RGBColor = RGBColor(0xD8, 0xDE, 0xE4);
/// Background of what does not count.
pub(super) const SHADE: RGBColor = RGBColor(0xEE, 0xF0, 0xF3);

/// Okabe and Ito's palette for all kinds of colour vision, without its yellow
/// and black, which vanish on white or dark (Color Universal Design, 2008). Its
/// orange and sky blue are darkened until they stand out from white by 3:1
/// (WCAG 1.4.11).
pub(super) const PALETTE: [RGBColor; 6] = [
    RGBColor(0x00, 0x72, 0xB2),
    RGBColor(0xD5, 0x5E, 0x00),
    RGBColor(0x00, 0x9E, 0x73),
    RGBColor(0xCC, 0x79, 0xA7),
    RGBColor(0xBF, 0x83, 0x00),
    RGBColor(0x4A, 0x99, 0xD4),
];

/// How a channel is drawn in every figure, beside its number: ten marks, no two
/// alike.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ChannelMark {
    /// Of its lines.
    pub color: RGBColor,
    /// The first six colours are filled; the others come again, hollow.
    pub filled: bool,
}

/// The mark of a channel, 1-based.
pub(super) fn channel_mark(number: u8) -> ChannelMark {
    let place = usize::from(number.saturating_sub(1));
    ChannelMark {
        color: PALETTE[place % PALETTE.len()],
        filled: place < PALETTE.len(),
    }
}

impl ChannelMark {
    /// For a dot: a disc or a ring.
    pub(super) fn dot(self) -> ShapeStyle {
        if self.filled {
            self.color.filled()
        } else {
            line(self.color, 30)
        }
    }

    /// For what lies between a line and its zero, if that is filled.
    pub(super) fn tint(self) -> Option<ShapeStyle> {
        self.filled.then(|| self.color.mix(0.22).filled())
    }
}

/// Rules every figure needs, inside the page or on its own.
pub(super) const STYLE: &str = r##"
.figure text{font-family:system-ui,-apple-system,"Segoe UI",Roboto,"Helvetica Neue",Arial,sans-serif;font-variant-numeric:tabular-nums}
.figure polyline{stroke-linejoin:round}
@media screen and (prefers-color-scheme:dark){
.figure [fill="#1F2328"]{fill:#E6EDF3}.figure [stroke="#1F2328"]{stroke:#E6EDF3}
.figure [fill="#59636E"]{fill:#9DA7B1}.figure [stroke="#59636E"]{stroke:#9DA7B1}
.figure [fill="#D8DEE4"]{fill:#343B43}.figure [stroke="#D8DEE4"]{stroke:#343B43}
.figure [fill="#FFFFFF"]{fill:#0D1117}
.figure [fill="#EEF0F3"]{fill:#1C2229}
.figure [fill="#0072B2"]{fill:#3D9BE0}.figure [stroke="#0072B2"]{stroke:#3D9BE0}
}
"##;

/// CSS pixels to drawing units.
pub(super) fn px(pixels: i32) -> i32 {
    pixels * SCALE as i32
}

/// A line this many tenths of a pixel wide.
pub(super) fn line(color: impl Color, tenths: u32) -> ShapeStyle {
    color.stroke_width(tenths * SCALE / 10)
}

/// Text `size` pixels high, anchored at its left, vertically centred.
pub(super) fn text(size: i32, color: RGBColor) -> TextStyle<'static> {
    // plotters-svg divides every size by 1.24.
    let size = f64::from(px(size)) * 1.24;
    let style = TextStyle::from(("sans-serif", size).into_font());
    TextStyle {
        color: color.to_backend_color(),
        pos: Pos::new(HPos::Left, VPos::Center),
        ..style
    }
}

/// The same text anchored elsewhere.
pub(super) fn anchored(style: TextStyle<'static>, h: HPos) -> TextStyle<'static> {
    style.pos(Pos::new(h, VPos::Center))
}

/// The same text centred and set upwards: the name of an axis, beside it.
pub(super) fn turned(style: TextStyle<'static>) -> TextStyle<'static> {
    anchored(style, HPos::Center).transform(FontTransform::Rotate270)
}

/// The same text in bold.
pub(super) fn bold(style: TextStyle<'static>) -> TextStyle<'static> {
    let font = style.font.style(FontStyle::Bold);
    TextStyle { font, ..style }
}

/// Draws an SVG `WIDTH` × `height` pixels that scales with the page.
/// `description` is what a screen reader says.
pub(super) fn svg(height: i32, description: &str, draw: impl FnOnce(&Area<'_>) -> Drawn) -> String {
    svg_wide((WIDTH, height), description, draw)
}

/// The same of another width.
pub(super) fn svg_wide(
    (width, height): (i32, i32),
    description: &str,
    draw: impl FnOnce(&Area<'_>) -> Drawn,
) -> String {
    let mut out = String::new();
    let size = (px(width) as u32, px(height) as u32);
    let root = SVGBackend::with_string(&mut out, size).into_drawing_area();
    // A string takes every byte, and the figures keep their ranges non-empty.
    draw(&root).expect("a figure draws into a string");
    root.present().expect("a string is always presented");
    drop(root);
    let body = out.find('>').map_or("", |end| &out[end + 1..]);
    format!(
        "<svg class=\"figure\" xmlns=\"http://www.w3.org/2000/svg\" role=\"img\" \
         width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {} {}\" aria-label=\"{}\">{body}",
        size.0,
        size.1,
        super::tables::escape(description)
    )
}

/// The figure with its style and background, so that it is a file of its own.
pub(super) fn standalone(figure: &str) -> String {
    let open = figure.find('>').map_or(0, |end| end + 1);
    let (head, body) = figure.split_at(open);
    let back = "<rect width=\"100%\" height=\"100%\" fill=\"#FFFFFF\"/>";
    format!("{head}<style>{STYLE}</style>{back}{body}")
}

/// Rough width of text, pixels: no font is at hand, and none is needed to keep
/// neighbours apart.
pub(super) fn text_width(size: i32, text: &str) -> i32 {
    text.chars().count() as i32 * size * 56 / 100
}

/// The text, cut to about `width` pixels with an ellipsis.
pub(super) fn shortened(size: i32, text: &str, width: i32) -> String {
    if text_width(size, text) <= width {
        return text.to_owned();
    }
    let letters = (width * 100 / (size * 56)).max(1) as usize - 1;
    text.chars().take(letters).chain(['…']).collect()
}

/// How a legend entry is drawn.
pub(super) enum Key {
    /// As a line.
    Line(ShapeStyle),
    /// As a filled box.
    Box(ShapeStyle),
    /// As a dot.
    Dot(ShapeStyle),
}

/// Draws a row of legend entries whose centre is `y` pixels from the top,
/// beginning `x` pixels from the left.
pub(super) fn legend(area: &Area<'_>, x: i32, y: i32, entries: &[(Key, &str)]) -> Drawn {
    legend_of(13, area, (x, y), entries)
}

/// The same with letters of another size.
pub(super) fn legend_of(
    size: i32,
    area: &Area<'_>,
    (mut x, y): (i32, i32),
    entries: &[(Key, &str)],
) -> Drawn {
    for (key, name) in entries {
        let (left, right) = (px(x), px(x + 22));
        match key {
            Key::Line(style) => {
                area.draw(&PathElement::new([(left, px(y)), (right, px(y))], *style))?;
            }
            Key::Box(style) => {
                let corners = [(left, px(y - 6)), (right, px(y + 6))];
                area.draw(&Rectangle::new(corners, *style))?;
            }
            Key::Dot(style) => area.draw(&Circle::new((px(x + 11), px(y)), px(4), *style))?,
        }
        area.draw(&Text::new(*name, (px(x + 28), px(y)), text(size, INK)))?;
        x += 28 + text_width(size, name) + 24;
    }
    Ok(())
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
