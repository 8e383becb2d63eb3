//! SVG pictures as a list of painted items, in order, in CSS pixels.

use super::font;
use super::style::{Sheets, split};
use roxmltree::{Document, Node};

/// Box with sides parallel to the axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Box2 {
    pub left: f64,
    pub top: f64,
    pub right: f64,
    pub bottom: f64,
}

impl Box2 {
    pub fn around(points: &[(f64, f64)]) -> Self {
        let start = Box2 {
            left: f64::MAX,
            top: f64::MAX,
            right: f64::MIN,
            bottom: f64::MIN,
        };
        points.iter().fold(start, |b, (x, y)| Box2 {
            left: b.left.min(*x),
            top: b.top.min(*y),
            right: b.right.max(*x),
            bottom: b.bottom.max(*y),
        })
    }

    pub fn middle(&self) -> (f64, f64) {
        (
            (self.left + self.right) / 2.0,
            (self.top + self.bottom) / 2.0,
        )
    }

    /// Returns width and height of the overlap of two boxes; not positive without overlap.
    pub fn shared(&self, other: &Box2) -> (f64, f64) {
        (
            self.right.min(other.right) - self.left.max(other.left),
            self.bottom.min(other.bottom) - self.top.max(other.top),
        )
    }
}

/// Red, green and blue, 0…255, and opacity, 0…1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Paint {
    pub rgb: [f64; 3],
    pub cover: f64,
}

/// Paint on a light and on a dark screen.
pub type Paints = [Option<Paint>; 2];

/// Text with its size and position.
#[derive(Clone, Debug)]
pub struct Words {
    pub text: String,
    pub size: f64,
    pub bold: bool,
    /// Whether the text runs upwards or downwards.
    pub turned: bool,
    pub anchor: String,
    /// Position of its anchor.
    pub at: (f64, f64),
    pub bounds: Box2,
}

/// Shape of a painted item.
#[derive(Clone, Debug)]
pub enum Form {
    Words(Words),
    /// Filled area, by its corners.
    Area(Vec<(f64, f64)>),
    /// Stroked path, and its width.
    Line(Vec<(f64, f64)>, f64),
}

/// Painted item on the canvas.
#[derive(Clone, Debug)]
pub struct Item {
    pub form: Form,
    pub paint: Paints,
}

/// Complete picture.
pub struct Drawing {
    pub width: f64,
    pub height: f64,
    pub items: Vec<Item>,
}

impl Drawing {
    /// Parses a picture.
    ///
    /// # Errors
    /// Fails for invalid XML, and for elements that this reader cannot place.
    pub fn read(svg: &str) -> Result<Self, String> {
        let document = Document::parse(svg).map_err(|error| error.to_string())?;
        let root = document.root_element();
        let css: String = document
            .descendants()
            .filter(|node| node.has_tag_name("style") || node.tag_name().name() == "style")
            .filter_map(|node| node.text())
            .collect();
        let (light, dark) = split(&css);
        let view: Vec<f64> = numbers(root.attribute("viewBox").ok_or("no viewBox")?);
        let &[0.0, 0.0, wide, high] = view.as_slice() else {
            return Err(format!("a viewBox of {view:?}"));
        };
        let width = root
            .attribute("width")
            .map_or(Ok(wide), str::parse)
            .map_err(|error| format!("width: {error}"))?;
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
                (0..16)
                    .map(|n| (x + r * turn(n).cos(), y + r * turn(n).sin()))
                    .collect()
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
        let corners: Vec<_> = corners
            .iter()
            .map(|(x, y)| (x * self.scale, y * self.scale))
            .collect();
        let is_stroke = ["line", "polyline"].contains(&node.tag_name().name());
        let fill = self.paints(node, "fill", (!is_stroke).then_some("#000"))?;
        if fill.iter().any(Option::is_some) {
            let form = Form::Area(corners.clone());
            items.push(Item { form, paint: fill });
        }
        let stroke = self.paints(node, "stroke", None)?;
        if stroke.iter().any(Option::is_some) {
            let width = self.sheets.inherited(node, "stroke-width", false);
            let width: f64 = width
                .map_or(Ok(1.0), |w| w.parse())
                .map_err(|_| "a stroke's width")?;
            let mut corners = corners;
            if !is_stroke && node.tag_name().name() != "path" {
                corners.extend(corners.first().copied());
            }
            let form = Form::Line(corners, width * self.scale);
            items.push(Item {
                form,
                paint: stroke,
            });
        }
        Ok(())
    }

    fn length(&self, node: Node, name: &str) -> Result<f64, String> {
        let text = node.attribute(name).unwrap_or("0");
        if let Some(part) = text.strip_suffix('%') {
            let extent = if name.contains('x') || name == "width" {
                self.canvas.0
            } else {
                self.canvas.1
            };
            return part
                .parse::<f64>()
                .map(|part| part / 100.0 * extent)
                .map_err(|e| e.to_string());
        }
        text.parse()
            .map_err(|error| format!("{name} {text:?}: {error}"))
    }

    fn words(&self, node: Node) -> Result<Words, String> {
        let text: String = node
            .descendants()
            .filter_map(|n| n.is_text().then(|| n.text()).flatten())
            .collect();
        let text = text.split_whitespace().collect::<Vec<_>>().join(" ");
        let style = |name: &str| self.sheets.inherited(node, name, false);
        let size = style("font-size").unwrap_or_else(|| "16".to_owned());
        let size: f64 = size
            .trim_end_matches("px")
            .parse()
            .map_err(|_| format!("a size of {size:?}"))?;
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
        let corners = [
            (left, top),
            (left + width, top),
            (left + width, bottom),
            (left, bottom),
        ];
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
            let declaration = self.sheets.inherited(node, name, dark);
            let Some(value) = declaration.as_deref().or(default) else {
                return Ok(None);
            };
            if value == "none" {
                return Ok(None);
            }
            let rgb = color(value).ok_or_else(|| format!("{name} {value:?}"))?;
            let cover = |name: &str| {
                let declaration = self.sheets.inherited(node, name, dark);
                declaration.map_or(Ok(1.0), |text| {
                    text.parse::<f64>().map_err(|e| format!("{name}: {e}"))
                })
            };
            let cover = cover("opacity")? * cover(&format!("{name}-opacity"))?;
            Ok(Some(Paint { rgb, cover }))
        };
        Ok([paint(false)?, paint(true)?])
    }
}

/// Returns the parameters of `rotate(angle, x, y)` if the text is turned.
fn turn(node: Node) -> Result<Option<(f64, f64, f64)>, String> {
    let above = node
        .ancestors()
        .skip(1)
        .any(|node| node.has_attribute("transform"));
    match (node.attribute("transform"), above) {
        (_, true) => Err("a transform of a group".to_owned()),
        (None, _) => Ok(None),
        (Some(text), _) => {
            let inner = text
                .strip_prefix("rotate(")
                .and_then(|t| t.strip_suffix(')'));
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

/// Converts a `dy` in units of the font size; half of DejaVu's x-height is 0.27 em.
fn shift(text: &str, size: f64) -> Option<f64> {
    let (number, unit) = match (text.strip_suffix("em"), text.strip_suffix("ex")) {
        (Some(number), _) => (number, size),
        (_, Some(number)) => (number, size * 0.547),
        _ => (text, 1.0),
    };
    Some(number.parse::<f64>().ok()? * unit)
}

/// Returns every number in a list separated by spaces and commas.
fn numbers(text: &str) -> Vec<f64> {
    let parts = text.split([' ', ',', '\n']).filter(|part| !part.is_empty());
    parts.filter_map(|part| part.parse().ok()).collect()
}

fn pairs(numbers: &[f64]) -> Vec<(f64, f64)> {
    numbers
        .chunks_exact(2)
        .map(|pair| (pair[0], pair[1]))
        .collect()
}

/// Returns the corners of a path of straight segments (M, L, H, V, z), or the ends of its curves.
fn outline(data: &str) -> Result<Vec<(f64, f64)>, String> {
    let mut corners: Vec<(f64, f64)> = Vec::new();
    let starts: Vec<usize> = data
        .char_indices()
        .filter(|(_, c)| c.is_alphabetic())
        .map(|(at, _)| at)
        .collect();
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
                corners.extend(
                    values
                        .chunks_exact(step)
                        .map(|c| (c[step - 2], c[step - 1])),
                );
            }
            "Z" | "z" => corners.extend(corners.first().copied()),
            other => return Err(format!("path command {other}")),
        }
    }
    Ok(corners)
}

/// Parses `#rgb` or `#rrggbb`.
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
