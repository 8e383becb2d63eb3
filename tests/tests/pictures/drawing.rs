//! An SVG as a list of what is painted, in order, in CSS pixels.

use super::font;
use super::style::{Sheets, split};
use roxmltree::{Document, Node};

/// A box that stands upright.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Box2 {
    pub left: f64,
    pub top: f64,
    pub right: f64,
    pub bottom: f64,
}

impl Box2 {
    pub fn around(points: &[(f64, f64)]) -> Self {
        let (x, y) = (|| points.iter().map(|p| p.0), || points.iter().map(|p| p.1));
        Box2 {
            left: x().fold(f64::MAX, f64::min),
            top: y().fold(f64::MAX, f64::min),
            right: x().fold(f64::MIN, f64::max),
            bottom: y().fold(f64::MIN, f64::max),
        }
    }

    pub fn middle(&self) -> (f64, f64) {
        let half = |a: f64, b: f64| (a + b) / 2.0;
        (half(self.left, self.right), half(self.top, self.bottom))
    }

    /// Width and height of what two boxes share; not positive where they do not.
    pub fn shared(&self, other: &Box2) -> (f64, f64) {
        (
            self.right.min(other.right) - self.left.max(other.left),
            self.bottom.min(other.bottom) - self.top.max(other.top),
        )
    }
}

/// Red, green, blue, 0…255, and how much of it covers, 0…1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Paint {
    pub rgb: [f64; 3],
    pub cover: f64,
}

/// A paint on a light and on a dark screen.
pub type Paints = [Option<Paint>; 2];

/// Text.
#[derive(Clone, Debug)]
pub struct Words {
    pub text: String,
    pub size: f64,
    pub bold: bool,
    /// Set upwards or downwards.
    pub turned: bool,
    pub anchor: String,
    /// Where it is anchored.
    pub at: (f64, f64),
    pub bounds: Box2,
}

/// What is painted.
#[derive(Clone, Debug)]
pub enum Form {
    Words(Words),
    /// Filled; by its corners.
    Area(Vec<(f64, f64)>),
    /// Stroked, and its width.
    Line(Vec<(f64, f64)>, f64),
}

/// One thing on the canvas.
#[derive(Clone, Debug)]
pub struct Item {
    pub form: Form,
    pub paint: Paints,
}

/// A whole picture.
pub struct Drawing {
    pub width: f64,
    pub height: f64,
    pub items: Vec<Item>,
}

impl Drawing {
    /// # Errors
    /// What is not XML, and what this reader does not know how to place.
    pub fn read(svg: &str) -> Result<Self, String> {
        let document = Document::parse(svg).map_err(|error| error.to_string())?;
        let root = document.root_element();
        let styles = document
            .descendants()
            .filter(|it| it.tag_name().name() == "style");
        let css: String = styles.filter_map(|node| node.text()).collect();
        let (light, dark) = split(&css);
        let view: Vec<f64> = numbers(root.attribute("viewBox").ok_or("no viewBox")?);
        let &[0.0, 0.0, wide, high] = view.as_slice() else {
            return Err(format!("a viewBox of {view:?}"));
        };
        let width = root.attribute("width").map_or(Ok(wide), str::parse);
        let width = width.map_err(|error| format!("width: {error}"))?;
        let scale = width / wide;
        let reader = Reader {
            sheets: Sheets::parse(&light, &dark),
            scale,
            canvas: (wide, high),
        };
        let mut items = Vec::new();
        for node in root.descendants().filter(Node::is_element) {
            let is_hidden = |node: Node| ["defs", "style"].contains(&node.tag_name().name());
            if !node.ancestors().any(is_hidden) {
                reader.element(node, &mut items)?;
            }
        }
        Ok(Drawing {
            width,
            height: high * scale,
            items,
        })
    }

    pub fn words(&self) -> impl Iterator<Item = &Words> {
        self.items.iter().filter_map(|item| match &item.form {
            Form::Words(words) => Some(words),
            _ => None,
        })
    }
}

struct Reader<'a> {
    sheets: Sheets<'a>,
    scale: f64,
    canvas: (f64, f64),
}

impl Reader<'_> {
    fn element(&self, node: Node, items: &mut Vec<Item>) -> Result<(), String> {
        let corners = match node.tag_name().name() {
            "svg" | "g" | "title" | "desc" => return Ok(()),
            "text" => {
                let form = Form::Words(self.words(node)?);
                let paint = self.paints(node, "fill", Some("#000"))?;
                items.push(Item { form, paint });
                return Ok(());
            }
            "rect" => {
                let (x, y) = (self.length(node, "x")?, self.length(node, "y")?);
                let (w, h) = (self.length(node, "width")?, self.length(node, "height")?);
                vec![(x, y), (x + w, y), (x + w, y + h), (x, y + h)]
            }
            "circle" => {
                let [x, y, r] = ["cx", "cy", "r"].map(|name| self.length(node, name));
                let (x, y, r) = (x?, y?, r?);
                let turn = |n: u32| f64::from(n) * std::f64::consts::TAU / 16.0;
                let corner = |n| (x + r * turn(n).cos(), y + r * turn(n).sin());
                (0..16).map(corner).collect()
            }
            "line" => {
                let [x1, y1, x2, y2] = ["x1", "y1", "x2", "y2"].map(|name| self.length(node, name));
                vec![(x1?, y1?), (x2?, y2?)]
            }
            "polyline" | "polygon" => pairs(&numbers(node.attribute("points").unwrap_or(""))),
            "path" => outline(node.attribute("d").unwrap_or(""))?,
            other => return Err(format!("<{other}> is not known to this reader")),
        };
        if node.ancestors().any(|node| node.has_attribute("transform")) {
            return Err("a transform of what is no text".to_owned());
        }
        let scaled = |(x, y): &(f64, f64)| (x * self.scale, y * self.scale);
        let mut corners: Vec<_> = corners.iter().map(scaled).collect();
        let is_stroke = ["line", "polyline"].contains(&node.tag_name().name());
        let fill = self.paints(node, "fill", (!is_stroke).then_some("#000"))?;
        if fill.iter().any(Option::is_some) {
            let form = Form::Area(corners.clone());
            items.push(Item { form, paint: fill });
        }
        let stroke = self.paints(node, "stroke", None)?;
        if stroke.iter().any(Option::is_some) {
            let width = self.sheets.inherited(node, "stroke-width", false);
            let width = width.map_or(Ok(1.0), |w| w.parse::<f64>());
            let width = width.map_err(|_| "a stroke's width")?;
            if !is_stroke && node.tag_name().name() != "path" {
                corners.extend(corners.first().copied());
            }
            let (form, paint) = (Form::Line(corners, width * self.scale), stroke);
            items.push(Item { form, paint });
        }
        Ok(())
    }

    fn length(&self, node: Node, name: &str) -> Result<f64, String> {
        let text = node.attribute(name).unwrap_or("0");
        if let Some(part) = text.strip_suffix('%') {
            let is_across = name.contains('x') || name == "width";
            let whole = if is_across {
                self.canvas.0
            } else {
                self.canvas.1
            };
            let part: f64 = part.parse().map_err(|e| format!("{name} {text:?}: {e}"))?;
            return Ok(part / 100.0 * whole);
        }
        text.parse().map_err(|e| format!("{name} {text:?}: {e}"))
    }

    fn words(&self, node: Node) -> Result<Words, String> {
        let texts = node.descendants().filter(Node::is_text);
        let text: String = texts.filter_map(|n| n.text()).collect();
        let text = text.split_whitespace().collect::<Vec<_>>().join(" ");
        let style = |name: &str| self.sheets.inherited(node, name, false);
        let size = style("font-size").unwrap_or_else(|| "16".to_owned());
        let size = size.trim_end_matches("px").parse::<f64>();
        let size = size.map_err(|why| format!("a size: {why}"))?;
        let weight = style("font-weight").unwrap_or_default();
        let bold = weight == "bold" || weight.parse::<u32>().is_ok_and(|weight| weight >= 600);
        let anchor = style("text-anchor").unwrap_or_else(|| "start".to_owned());
        if style("dominant-baseline").is_some() {
            return Err("a dominant-baseline".to_owned());
        }
        let (x, y) = (self.length(node, "x")?, self.length(node, "y")?);
        let down = match node.attribute("dy") {
            None => 0.0,
            Some(dy) => shift(dy, size).ok_or_else(|| format!("dy {dy:?}"))?,
        };
        let width = font::width(&text, bold)? * size;
        let left = match anchor.as_str() {
            "start" => x,
            "middle" => x - width / 2.0,
            "end" => x - width,
            other => return Err(format!("an anchor of {other:?}")),
        };
        let (above, below) = font::reach(&text);
        let base = y + down;
        let (top, bottom) = (base - above * size, base + below * size);
        let right = left + width;
        let corners = [(left, top), (right, top), (right, bottom), (left, bottom)];
        let angle = turn(node)?;
        let placed = corners.map(|corner| {
            let (px, py) = angle.map_or(corner, |angle| rotated(corner, angle));
            (px * self.scale, py * self.scale)
        });
        Ok(Words {
            text,
            size: size * self.scale,
            bold,
            turned: angle.is_some(),
            anchor,
            at: (x * self.scale, base * self.scale),
            bounds: Box2::around(&placed),
        })
    }

    fn paints(&self, node: Node, name: &str, default: Option<&str>) -> Result<Paints, String> {
        let paint = |dark: bool| -> Result<Option<Paint>, String> {
            let said = self.sheets.inherited(node, name, dark);
            let Some(said) = said.as_deref().or(default) else {
                return Ok(None);
            };
            if said == "none" {
                return Ok(None);
            }
            let rgb = color(said).ok_or_else(|| format!("{name} {said:?}"))?;
            let cover = |name: &str| {
                let said = self.sheets.inherited(node, name, dark);
                let cover = said.map_or(Ok(1.0), |text| text.parse::<f64>());
                cover.map_err(|e| format!("{name}: {e}"))
            };
            let cover = cover("opacity")? * cover(&format!("{name}-opacity"))?;
            Ok(Some(Paint { rgb, cover }))
        };
        Ok([paint(false)?, paint(true)?])
    }
}

/// `rotate(angle, x, y)`, if the text is turned.
fn turn(node: Node) -> Result<Option<(f64, f64, f64)>, String> {
    let mut above = node.ancestors().skip(1);
    let above = above.any(|node| node.has_attribute("transform"));
    match (node.attribute("transform"), above) {
        (_, true) => Err("a transform of a group".to_owned()),
        (None, _) => Ok(None),
        (Some(text), _) => {
            let inner = text.strip_prefix("rotate(");
            let inner = inner.and_then(|t| t.strip_suffix(')'));
            match inner.map(numbers).as_deref() {
                Some(&[angle, x, y]) => Ok(Some((angle, x, y))),
                _ => Err(format!("transform {text:?}")),
            }
        }
    }
}

fn rotated((x, y): (f64, f64), (angle, cx, cy): (f64, f64, f64)) -> (f64, f64) {
    let (sin, cos) = angle.to_radians().sin_cos();
    let (dx, dy) = (x - cx, y - cy);
    (cx + dx * cos - dy * sin, cy + dx * sin + dy * cos)
}

/// A `dy` in the units of the font size; half of DejaVu's x-height is 0.27 em.
fn shift(text: &str, size: f64) -> Option<f64> {
    let (number, unit) = match (text.strip_suffix("em"), text.strip_suffix("ex")) {
        (Some(number), _) => (number, size),
        (_, Some(number)) => (number, size * 0.547),
        _ => (text, 1.0),
    };
    Some(number.parse::<f64>().ok()? * unit)
}

/// Every number of a list apart by spaces and commas.
fn numbers(text: &str) -> Vec<f64> {
    let parts = text.split([' ', ',', '\n']).filter(|part| !part.is_empty());
    parts.filter_map(|part| part.parse().ok()).collect()
}

fn pairs(numbers: &[f64]) -> Vec<(f64, f64)> {
    let pairs = numbers.chunks_exact(2);
    pairs.map(|pair| (pair[0], pair[1])).collect()
}

/// Corners of a path of straight parts (M, L, H, V, z) or of the ends of its curves.
fn outline(data: &str) -> Result<Vec<(f64, f64)>, String> {
    let mut corners: Vec<(f64, f64)> = Vec::new();
    let letters = data.match_indices(char::is_alphabetic);
    let starts: Vec<usize> = letters.map(|(at, _)| at).collect();
    let ends = starts.iter().skip(1).copied().chain([data.len()]);
    for (&start, end) in starts.iter().zip(ends) {
        let (letter, values) = (&data[start..=start], numbers(&data[start + 1..end]));
        let last = corners.last().copied().unwrap_or_default();
        match letter {
            "M" | "L" => corners.extend(pairs(&values)),
            "H" => corners.extend(values.iter().map(|x| (*x, last.1))),
            "V" => corners.extend(values.iter().map(|y| (last.0, *y))),
            "C" | "Q" => {
                let step = if letter == "C" { 6 } else { 4 };
                let curves = values.chunks_exact(step);
                corners.extend(curves.map(|c| (c[step - 2], c[step - 1])));
            }
            "Z" | "z" => corners.extend(corners.first().copied()),
            other => return Err(format!("path command {other}")),
        }
    }
    Ok(corners)
}

/// `#rgb` or `#rrggbb`.
fn color(text: &str) -> Option<[f64; 3]> {
    let hex = text.strip_prefix('#')?;
    let digit = |at: usize, len: usize| {
        let value = u8::from_str_radix(hex.get(at..at + len)?, 16).ok()?;
        Some(f64::from(if len == 1 { value * 17 } else { value }))
    };
    match hex.len() {
        3 => Some([digit(0, 1)?, digit(1, 1)?, digit(2, 1)?]),
        6 => Some([digit(0, 2)?, digit(2, 2)?, digit(4, 2)?]),
        _ => None,
    }
}
