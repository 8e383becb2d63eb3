//! A stability map as lines: each row's numbers over the columns, both
//! logarithmic, with what theory gives dashed, and the row's remark beside its key.

use super::canvas::{
    Area, Drawn, GRID, INK, MUTED, PALETTE, WIDTH, anchored, bold, line, px, standalone, svg, text,
    turned,
};
use super::map::folded;
use crate::stability::{Map, Panel};
use plotters::element::DashedPathElement;
use plotters::prelude::*;
use plotters::style::text_anchor::HPos;

const TOP: i32 = 40;
/// A panel with its title and axis, and the plot in it, CSS pixels.
const PANEL: (i32, i32) = (WIDTH / 2, 268);
const PLOT: (i32, i32) = (168, 190);
const MARGIN: i32 = 58;
const PANEL_TITLE: i32 = 26;
/// From a key to the remark beside it: room for the longest name.
const REMARK: i32 = 142;
const ROW: i32 = 20;
const LINE: i32 = 19;
/// Length of a dash and of the gap after it, CSS pixels.
const DASH: (i32, i32) = (6, 4);
/// Tenths of a pixel.
const FOUND: u32 = 18;
const TOLD: u32 = 14;

/// The map as a file of its own. The columns' labels are numbers.
pub(super) fn picture(map: &Map) -> String {
    let words = folded(&[
        format!(
            "Lines: {}; what is fitted to a row stands beside its key. A row without end has no line.",
            map.quantity
        ),
        format!("Dashed: theory; {}", map.theory),
    ]);
    let rows = (map.panels.len() as i32 + 1) / 2;
    let below = TOP + rows * PANEL.1 + 10;
    let height = below + words.len() as i32 * LINE;
    let axes = Axes::of(map);
    standalone(&svg(height, map.title, |root| {
        let title = bold(text(15, INK));
        root.draw(&Text::new(map.title, (0, px(14)), title))?;
        for (panel, n) in map.panels.iter().zip(0..) {
            let at = (n % 2 * PANEL.0, TOP + n / 2 * PANEL.1);
            axes.draw_panel(root, map, panel, at)?;
        }
        for (words, y) in words.into_iter().zip((below..).step_by(LINE as usize)) {
            root.draw(&Text::new(words, (0, px(y)), text(12, MUTED)))?;
        }
        Ok(())
    }))
}

/// The colour of a row; one more than the palette has.
fn color(row: usize) -> RGBColor {
    PALETTE.get(row).copied().unwrap_or(MUTED)
}

/// Columns, and the decades that all finite numbers fall into.
struct Axes {
    columns: Vec<f64>,
    decades: (i32, i32),
}

impl Axes {
    fn of(map: &Map) -> Self {
        let number = |label: &String| label.parse().expect("a label that is a number");
        let found = map.panels.iter().flat_map(|p| p.rows.iter().flatten());
        let told = map.panels.iter().flat_map(|p| p.told.iter().flatten());
        let logs: Vec<f64> = (found.map(|cell| cell.number))
            .chain(told.copied().flatten())
            .filter(|x| x.is_finite() && *x > 0.0)
            .map(f64::log10)
            .collect();
        let low = logs.iter().copied().fold(f64::MAX, f64::min).floor();
        let high = logs.iter().copied().fold(f64::MIN, f64::max).ceil();
        Self {
            columns: map.across.labels.iter().map(number).collect(),
            decades: (low as i32, high as i32),
        }
    }

    /// A place in a plot, CSS pixels right of its left and below its top.
    fn place(&self, x: f64, y: f64) -> (f64, f64) {
        let [first, last] = [self.columns[0], self.columns[self.columns.len() - 1]];
        let across = (x / first).ln() / (last / first).ln();
        let (low, high) = self.decades;
        let up = (y.log10() - f64::from(low)) / f64::from(high - low);
        (across * f64::from(PLOT.0), (1.0 - up) * f64::from(PLOT.1))
    }

    fn draw_panel(&self, root: &Area<'_>, map: &Map, panel: &Panel, at: (i32, i32)) -> Drawn {
        let (left, top) = (at.0 + MARGIN, at.1 + PANEL_TITLE);
        let style = bold(text(12, INK));
        root.draw(&Text::new(
            panel.title.clone(),
            (px(at.0), px(at.1 + 12)),
            style,
        ))?;
        self.draw_axes(root, map, (left, top))?;
        let point = |x: f64, y: f64| {
            let (x, y) = self.place(x, y);
            let unit = f64::from(px(1));
            (px(left) + (x * unit) as i32, px(top) + (y * unit) as i32)
        };
        let path = |numbers: Vec<Option<f64>>| -> Vec<(i32, i32)> {
            let pairs = self.columns.iter().zip(numbers);
            let drawn = |y: &f64| y.is_finite() && *y > 0.0;
            pairs
                .filter_map(|(x, y)| y.filter(drawn).map(|y| point(*x, y)))
                .collect()
        };
        // The first rows are the product's: on top.
        for (r, row) in panel.rows.iter().enumerate().rev() {
            let found = path(row.iter().map(|cell| Some(cell.number)).collect());
            root.draw(&PathElement::new(found, line(color(r), FOUND)))?;
        }
        for told in &panel.told {
            let told = path(told.clone()).into_iter();
            let style = line(INK, TOLD);
            root.draw(&DashedPathElement::new(told, px(DASH.0), px(DASH.1), style))?;
        }
        self.draw_keys(root, map, panel, (left + PLOT.0 + 14, top + 10))
    }

    fn draw_axes(&self, root: &Area<'_>, map: &Map, at: (i32, i32)) -> Drawn {
        let (left, top) = at;
        let right = anchored(text(11, MUTED), HPos::Right);
        for decade in self.decades.0..=self.decades.1 {
            let number = 10f64.powi(decade);
            let y = top + self.place(self.columns[0], number).1.round() as i32;
            let grid = [(px(left), px(y)), (px(left + PLOT.0), px(y))];
            root.draw(&PathElement::new(grid, line(GRID, 10)))?;
            root.draw(&Text::new(
                number.to_string(),
                (px(left - 5), px(y)),
                right.clone(),
            ))?;
        }
        let middle = anchored(text(11, MUTED), HPos::Center);
        let bottom = top + PLOT.1;
        let mut free = i32::MIN;
        for (x, label) in self.columns.iter().zip(&map.across.labels) {
            let at = left + self.place(*x, 1.0).0.round() as i32;
            if at >= free {
                root.draw(&Text::new(
                    label.clone(),
                    (px(at), px(bottom + 10)),
                    middle.clone(),
                ))?;
                free = at + 20;
            }
        }
        let words = map.across.caption();
        let at = (px(left), px(bottom + 27));
        root.draw(&Text::new(words, at, text(11, INK)))?;
        let at = (px(left - MARGIN + 8), px((top + bottom) / 2));
        root.draw(&Text::new(map.quantity, at, turned(text(11, INK))))?;
        Ok(())
    }

    fn draw_keys(&self, root: &Area<'_>, map: &Map, panel: &Panel, at: (i32, i32)) -> Drawn {
        let (left, top) = at;
        for (r, (name, y)) in map
            .down
            .labels
            .iter()
            .zip((top..).step_by(ROW as usize))
            .enumerate()
        {
            let key = [(px(left), px(y)), (px(left + 14), px(y))];
            root.draw(&PathElement::new(key, line(color(r), 30)))?;
            root.draw(&Text::new(
                name.clone(),
                (px(left + 19), px(y)),
                text(11, INK),
            ))?;
            let remark = panel.remarks.get(r).cloned().unwrap_or_default();
            root.draw(&Text::new(
                remark,
                (px(left + REMARK), px(y)),
                text(11, MUTED),
            ))?;
        }
        Ok(())
    }
}
