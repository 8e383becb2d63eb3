//! A plot between two axes.

use super::At;
use super::axis::{Axis, Scale, spread_apart};
use super::canvas::{Canvas, Words};
use super::ink::{Color, GRID, INK, MUTED, PALETTE, Paint, Shape, Stroke, stroke};
use super::labels::OccupiedSpace;
use super::words::{truncate, width};

/// Maximum width of the row names at a panel's left edge, pixels.
const HEADS: f64 = 150.0;
/// Space to the right of a bold row name, for the tick label of the same row, pixels.
const OWN_TICK: f64 = 70.0;
/// Distance between a text and the object that it labels, pixels.
const NEAR: f64 = 6.0;

/// Object that is drawn in a plot; its positions are in the units of the axes.
#[derive(Clone, Debug)]
pub enum Mark {
    /// Line through these points.
    Line(Vec<At>, Stroke),
    /// Closed outline with these corners.
    Outline(Vec<At>, Paint),
    /// Rectangle with a horizontal range and then a vertical range, such as a bar, a band or a
    /// cell. An infinite end reaches the edge of the plot.
    Area(At, At, Paint),
    /// Mark at a point; the number is its radius in pixels.
    Dot(At, Shape, f64, Paint),
    /// Text near a point, placed where it overlaps as little as possible.
    Label(At, String, Color),
    /// Text to the right of a point; the number is the distance in pixels.
    Beside(At, f64, String),
}

/// A plot between two axes, with its titles and the objects in it.
#[derive(Clone, Debug)]
pub struct Panel {
    /// Title above the left end of the plot, in bold.
    pub title: String,
    /// Main result, above the right end of the plot, in bold and blue.
    pub result: String,
    /// Horizontal axis.
    pub x: Axis,
    /// Vertical axis: values increase upwards, but rows are counted from the top.
    pub y: Axis,
    /// Height of the plot without its margins, pixels.
    pub height: f64,
    /// Width of the panel relative to other panels in the same row; 1 by default.
    pub share: f64,
    /// Objects that are drawn under the grid lines.
    pub ground: Vec<Mark>,
    /// Objects that are drawn over the grid lines, the first at the bottom.
    pub marks: Vec<Mark>,
}

/// Margins to the left, above, to the right and below a plot, pixels.
#[derive(Clone, Copy, Debug, Default)]
pub struct Margins {
    /// Space for row names, tick labels and the name of the y axis.
    pub left: f64,
    /// Space for the titles, and for the texts at the far side of the x axis.
    pub top: f64,
    /// Space for the texts at the far side of the y axis.
    pub right: f64,
    /// Space for tick labels and the name of the x axis.
    pub bottom: f64,
}

/// Factor for the size of all letters; 1 is the usual size.
#[derive(Clone, Copy, Debug)]
pub struct LetterScale(pub f64);

impl LetterScale {
    fn tick(self) -> Words {
        Words::new(11.0 * self.0, MUTED)
    }

    pub(super) fn name(self) -> Words {
        Words::new(12.0 * self.0, INK)
    }

    pub(super) fn title(self) -> Words {
        Words::new(13.0 * self.0, INK).bold()
    }

    /// Returns the height of one line of tick labels, pixels.
    fn line(self) -> f64 {
        15.0 * self.0
    }
}

impl Panel {
    /// Returns a panel without objects. `height` is the height of the plot, pixels.
    #[must_use]
    pub fn new(title: &str, x: Axis, y: Axis, height: f64) -> Self {
        Self {
            title: title.to_owned(),
            result: String::new(),
            x,
            y,
            height,
            share: 1.0,
            ground: Vec::new(),
            marks: Vec::new(),
        }
    }

    /// Returns the margins that the panel needs around a plot that is `wide` pixels wide.
    #[must_use]
    pub fn margins(&self, letters: LetterScale, wide: f64) -> Margins {
        let ticks = self.y.widest(letters.tick().size);
        let name = if self.y.name.is_empty() {
            0.0
        } else {
            letters.line() + 3.0
        };
        let heads = self.heads_width(letters);
        let far = |words: &str| width(letters.tick().size, words, false);
        let beyond = self.y.far.iter().map(|f| far(&f.words) + 14.0);
        let title = !self.title.is_empty() || !self.result.is_empty();
        let bottom = match (self.x.has_labels(), self.x.name.is_empty()) {
            (false, _) => 0.0,
            (true, unnamed) => {
                let lines = self.label_layout(letters, wide).1 + if unnamed { 0.0 } else { 1.3 };
                3.0 + lines * letters.line()
            }
        };
        Margins {
            left: (heads + name + ticks + NEAR).max(12.0),
            top: if title { 23.0 * letters.0 } else { 8.0 }
                + if self.x.far.is_empty() {
                    0.0
                } else {
                    letters.line()
                },
            right: beyond.fold(16.0, f64::max),
            bottom,
        }
    }

    fn heads_width(&self, letters: LetterScale) -> f64 {
        let head = |h: &super::axis::Head| {
            let name = width(letters.title().size, &h.name, false);
            let more = width(letters.tick().size, &h.more, false);
            name.max(more) + if h.mark.is_some() { 20.0 } else { 0.0 } + 12.0
        };
        // A bold name shares the space of the ticks, where its own tick label is short.
        let beside = self.y.heads.iter().filter(|head| !head.bold);
        let widest = beside.map(head).fold(0.0, f64::max);
        widest.min(HEADS * letters.0)
    }

    /// Returns the layout of the labels of columns: 1 if every column has a label, n if only every
    /// n-th one has, and the number of lines of labels.
    fn label_layout(&self, letters: LetterScale, wide: f64) -> (usize, f64) {
        let Scale::Rows(count) = self.x.scale else {
            return (1, 1.0);
        };
        let columns = (self.x.widest(letters.tick().size) + 4.0) / (wide / count);
        if columns <= 1.0 {
            (1, 1.0)
        } else {
            ((columns / 2.0).ceil() as usize, 2.0)
        }
    }

    /// Draws the panel. `from` and `to` are the top left and bottom right corners of its plot; the
    /// title is `above` pixels over the plot.
    pub fn draw(
        &self,
        canvas: &mut Canvas,
        letters: LetterScale,
        above: f64,
        (from, to): (At, At),
    ) {
        let drawn = PlacedPanel {
            panel: self,
            letters,
            above,
            from,
            to,
        };
        let mut taken = OccupiedSpace::default();
        drawn.marks(canvas, &self.ground, &mut taken);
        drawn.grid(canvas);
        drawn.marks(canvas, &self.marks, &mut taken);
        drawn.draw_texts(canvas);
        drawn.labels(canvas, &mut taken);
    }
}

/// A panel with the position of its plot on a canvas, while it is drawn.
struct PlacedPanel<'a> {
    panel: &'a Panel,
    letters: LetterScale,
    above: f64,
    from: At,
    to: At,
}

impl PlacedPanel<'_> {
    fn x(&self, value: f64) -> f64 {
        self.panel.x.scale.position(value, self.from.0, self.to.0)
    }

    fn y(&self, value: f64) -> f64 {
        match self.panel.y.scale {
            Scale::Rows(_) => self.panel.y.scale.position(value, self.from.1, self.to.1),
            _ => self.panel.y.scale.position(value, self.to.1, self.from.1),
        }
    }

    fn canvas_point(&self, (x, y): At) -> At {
        (self.x(x), self.y(y))
    }

    fn path(&self, points: &[At]) -> Vec<At> {
        points
            .iter()
            .map(|point| self.canvas_point(*point))
            .collect()
    }

    /// Draws the grid lines at the ticks, the lines across the plot that have a name, and the signs
    /// for parts that are cut out of the x axis.
    fn grid(&self, canvas: &mut Canvas) {
        let across = |x: f64| [(x, self.from.1), (x, self.to.1)];
        let up = |y: f64| [(self.from.0, y), (self.to.0, y)];
        for (value, _) in self.panel.x.ticks.iter().filter(|_| self.panel.x.grid) {
            canvas.line(&across(self.x(*value)), stroke(GRID, 1.0));
        }
        for (value, _) in self.panel.y.ticks.iter().filter(|_| self.panel.y.grid) {
            canvas.line(&up(self.y(*value)), stroke(GRID, 1.0));
        }
        for far in &self.panel.x.far {
            if let Some(color) = far.rule {
                canvas.line(&across(self.x(far.at)), stroke(color, 1.4));
            }
        }
        for far in &self.panel.y.far {
            if let Some(color) = far.rule {
                canvas.line(&up(self.y(far.at)), stroke(color, 1.4));
            }
        }
        for cut in self.panel.x.scale.cuts(self.from.0, self.to.0) {
            for at in [cut - 3.0, cut + 3.0] {
                let slant = [(at - 3.0, self.to.1 + 5.0), (at + 3.0, self.to.1 - 5.0)];
                canvas.line(&slant, stroke(MUTED, 1.0));
            }
        }
    }

    fn marks(&self, canvas: &mut Canvas, marks: &[Mark], taken: &mut OccupiedSpace) {
        for mark in marks {
            match mark {
                Mark::Line(points, stroke) => {
                    let path = self.path(points);
                    taken.add_line(&path);
                    canvas.line(&path, *stroke);
                }
                Mark::Outline(points, paint) => canvas.polygon(&self.path(points), *paint),
                Mark::Area((x, to_x), (y, to_y), paint) => {
                    let (from, to) = (
                        self.canvas_point((*x, *y)),
                        self.canvas_point((*to_x, *to_y)),
                    );
                    canvas.area(from, to, *paint);
                }
                Mark::Dot(at, shape, radius, paint) => {
                    taken.add_mark(self.canvas_point(*at), *radius + 1.0);
                    canvas.mark(self.canvas_point(*at), *shape, *radius, *paint);
                }
                Mark::Beside(at, distance, words) => {
                    let ((x, y), style) = (self.canvas_point(*at), self.letters.tick());
                    let wide = width(style.size, words, false);
                    taken.add_label([x, y - 7.0, x + distance + wide, y + 7.0]);
                    canvas.text((x + distance, y), words, style);
                }
                Mark::Label(..) => {}
            }
        }
    }

    /// Draws the texts of [`Mark::Label`]. They are drawn last, so that they avoid the other
    /// objects where possible.
    fn labels(&self, canvas: &mut Canvas, taken: &mut OccupiedSpace) {
        let bounds = [self.from.0, self.from.1, self.to.0, self.to.1];
        for mark in &self.panel.marks {
            let Mark::Label(at, words, color) = mark else {
                continue;
            };
            let style = Words::new(self.letters.tick().size, *color);
            let size = (width(style.size, words, false), style.size * 1.2);
            let (x, y) = self.canvas_point(*at);
            let (left, middle) = taken.place_label((x, y), size, bounds);
            // A label further away gets a lead to its point.
            let near = (x.clamp(left, left + size.0), middle);
            if libm::hypot(near.0 - x, near.1 - y) > 16.0 {
                let end = (near.0, middle + (y - middle).signum() * size.1 / 2.0);
                canvas.line(&[(x, y), end], stroke(*color, 0.8));
            }
            canvas.text((left, middle), words, style);
        }
    }

    /// Draws titles, row names, tick labels, axis names and the texts at the far side.
    fn draw_texts(&self, canvas: &mut Canvas) {
        let (panel, letters) = (self.panel, self.letters);
        let over = self.from.1 - self.above + 11.0 * letters.0;
        canvas.text((self.from.0, over), &panel.title, letters.title());
        let result = Words {
            color: PALETTE[0],
            ..letters.title().right_aligned()
        };
        canvas.text((self.to.0, over), &panel.result, result);
        self.draw_x_axis(canvas);
        self.draw_y_axis(canvas);
        self.draw_far_labels(canvas);
    }

    fn draw_x_axis(&self, canvas: &mut Canvas) {
        let (axis, letters) = (&self.panel.x, self.letters);
        if !axis.has_labels() {
            return;
        }
        let style = letters.tick().centred();
        let (every, lines) = self.panel.label_layout(letters, self.to.0 - self.from.0);
        let mut free = f64::MIN;
        for (n, (value, words)) in axis.ticks.iter().enumerate().step_by(every) {
            let x = self.x(*value);
            let half = width(style.size, words, false) / 2.0;
            let below = if lines > 1.0 {
                (n / every % 2) as f64
            } else {
                0.0
            };
            if lines > 1.0 || x - half >= free {
                let y = self.to.1 + 4.0 + letters.line() * (0.5 + below);
                canvas.text((x, y), words, style);
                free = x + half + 5.0;
            }
        }
        let middle = (self.from.0 + self.to.0) / 2.0;
        let y = self.to.1 + 3.0 + letters.line() * (lines + 0.65);
        canvas.text((middle, y), &axis.name, letters.name().centred());
    }

    fn draw_y_axis(&self, canvas: &mut Canvas) {
        let (axis, letters) = (&self.panel.y, self.letters);
        let style = letters.tick().right_aligned();
        let mut free = f64::NEG_INFINITY;
        let mut ticks: Vec<_> = axis.ticks.iter().map(|(v, w)| (self.y(*v), w)).collect();
        ticks.sort_by(|a, b| a.0.total_cmp(&b.0));
        for (y, words) in ticks.iter().filter(|(_, words)| !words.is_empty()) {
            if *y - free >= style.size * 1.05 {
                canvas.text((self.from.0 - NEAR, *y), words, style);
                free = *y;
            }
        }
        let wide = self.from.0 - NEAR - axis.widest(style.size);
        let middle = (self.from.1 + self.to.1) / 2.0;
        let at = (wide - letters.line() * 0.6, middle);
        canvas.text(at, &axis.name, letters.name().rotated());
        let name = if axis.name.is_empty() {
            0.0
        } else {
            letters.line() + 3.0
        };
        let left = wide - name - self.panel.heads_width(letters);
        for head in &axis.heads {
            let right = if head.bold {
                self.from.0 - OWN_TICK
            } else {
                wide - NEAR
            };
            self.head(canvas, head, left, right);
        }
    }

    fn head(&self, canvas: &mut Canvas, head: &super::axis::Head, mut left: f64, right: f64) {
        let letters = self.letters;
        let y = self.y(head.at);
        let (up, down) = if head.more.is_empty() {
            (0.0, 0.0)
        } else {
            (8.0, 9.0)
        };
        if let Some(mark) = head.mark {
            canvas.mark((left + 8.0, y - up), Shape::Disc, 5.0, mark.dot());
            left += 20.0;
        }
        let style = Words {
            bold: head.bold,
            ..Words::new(13.0 * letters.0, INK)
        };
        let name = truncate(style.size, &head.name, right - left, head.bold);
        canvas.text((left, y - up), &name, style);
        canvas.text((left, y + down), &head.more, letters.tick());
    }

    fn draw_far_labels(&self, canvas: &mut Canvas) {
        let letters = self.letters;
        let style = |color: Color| Words {
            color,
            ..letters.tick()
        };
        let size = letters.tick().size;
        let far = &self.panel.y.far;
        let places: Vec<f64> = far.iter().map(|f| self.y(f.at)).collect();
        let gaps = vec![size * 1.25; far.len()];
        let at = spread_apart(&places, &gaps, self.from.1 - 8.0, self.to.1 + 8.0);
        for ((far, y), place) in far.iter().zip(at).zip(places) {
            let lead = [(self.to.0 + 1.0, place), (self.to.0 + 8.0, y)];
            if far.rule.is_none() && far.color != INK || (y - place).abs() > 1.0 {
                canvas.line(&lead, stroke(far.rule.unwrap_or(far.color), 1.0));
            }
            let text = (self.to.0 + 11.0, y);
            let color = if far.rule.is_some() { MUTED } else { INK };
            canvas.text(text, &far.words, style(color));
        }
        let far = &self.panel.x.far;
        let places: Vec<f64> = far.iter().map(|f| self.x(f.at)).collect();
        let gaps: Vec<f64> = far
            .iter()
            .map(|f| width(size, &f.words, false) + 8.0)
            .collect();
        let at = spread_apart(&places, &gaps, self.from.0 - 20.0, self.to.0 + 40.0);
        for ((far, x), place) in far.iter().zip(at).zip(places) {
            let y = self.from.1 - letters.line() * 0.7;
            let lead = [(place, self.from.1), (x, y + size * 0.6)];
            canvas.line(&lead, stroke(far.rule.unwrap_or(MUTED), 1.0));
            canvas.text((x, y), &far.words, style(MUTED).centred());
        }
    }
}
