//! Renders tables and figures in the layout of a paper's own.

use super::tables::table;
use crate::laboratory::sheet::{
    Band, Bar, Curve, Matrix, Plot, Plots, Sheet, SheetAxis, SheetContent,
};
use host_core::html;
use host_core::plot::ink::{Color, GRID, INK, MUTED, PALETTE, stroke};
use host_core::plot::{Axis, Canvas, Figure, Key, Mark, Paint, Panel, Scale, Shape, Svg, Words};
use host_core::report::{Html, figure};

/// Height of a plot that is alone in its row, pixels.
const ALONE: f64 = 260.0;
/// Height of a plot beside others, pixels.
const MULTIPLE: f64 = 170.0;

/// Renders every sheet in its order, each with heading and caption.
pub(super) fn sheets(items: &[Sheet]) -> Html {
    items.iter().map(sheet).collect()
}

fn sheet(item: &Sheet) -> Html {
    let heading = html!("<h3>{}: {}</h3>\n", item.number, item.title);
    let body = match &item.shows {
        SheetContent::Table(grid) => {
            let row = |row: &Vec<String>| {
                let cells = row.iter().enumerate().map(|(place, cell)| match place {
                    0 => html!("<th scope=\"row\">{}</th>", no_break_percent(cell)),
                    _ => html!("<td>{}</td>", no_break_percent(cell)),
                });
                html!("<tr>{}</tr>\n", cells.collect::<Html>())
            };
            let heads: Vec<String> = grid
                .heads
                .iter()
                .map(|head| no_break_percent(head))
                .collect();
            let heads: Vec<&str> = heads.iter().map(String::as_str).collect();
            table(&heads, grid.rows.iter().map(row).collect())
        }
        SheetContent::Plots(plots) => figure(&draw_plots(plots, &item.title), ""),
        SheetContent::Matrix(matrix) => figure(&shaded(matrix, &item.title), ""),
    };
    // The caption stays outside the figure, which scrolls on a narrow screen.
    heading + body + html!("<p class=\"note\">{}</p>\n", item.caption)
}

/// Width of the row names of a matrix, pixels.
const NAMES: f64 = 200.0;
/// Width and height of a cell of a matrix, pixels.
const CELL: (f64, f64) = (30.0, 24.0);
/// Height of the column heads of a matrix, pixels.
const HEADS: f64 = 24.0;

/// Draws a matrix: each number in a cell that is darker the larger the number. Rounding never
/// yields `-0`.
fn shaded(matrix: &Matrix, description: &str) -> Svg {
    let mut canvas = Canvas::default();
    let values = matrix.rows.iter().flat_map(|(_, cells)| cells);
    let largest = values
        .fold(0.0_f64, |most, value| most.max(*value))
        .max(1e-9);
    let place = |column: usize, row: usize| {
        let left = NAMES + CELL.0 * column as f64;
        (left, HEADS + CELL.1 * row as f64)
    };
    for (column, head) in matrix.heads.iter().enumerate() {
        let (left, _) = place(column, 0);
        canvas.text((left + 4.0, 0.5 * HEADS), head, Words::new(11.0, MUTED));
    }
    for (row, (name, cells)) in matrix.rows.iter().enumerate() {
        let (_, top) = place(0, row);
        canvas.text((4.0, top + 0.5 * CELL.1), name, Words::new(12.0, INK));
        for (column, value) in cells.iter().enumerate() {
            let (left, top) = place(column, row);
            let part = 0.75 * (value / largest).clamp(0.0, 1.0);
            let paint = Paint::Full(GRID.mix(PALETTE[0], part));
            let (right, bottom) = (left + CELL.0 - 1.0, top + CELL.1 - 1.0);
            canvas.area((left, top), (right, bottom), paint);
            let middle = (left + 4.0, top + 0.5 * CELL.1);
            canvas.text(
                middle,
                &format!("{:.0}", value.round() + 0.0),
                Words::new(11.0, INK),
            );
        }
    }
    let (right, bottom) = place(matrix.heads.len(), matrix.rows.len());
    let unit = &matrix.unit;
    canvas.text((4.0, bottom + 0.5 * HEADS), unit, Words::new(11.0, MUTED));
    canvas.svg((right, bottom + HEADS), description)
}

/// Replaces the space before a per cent sign by a no-break space, so that number and sign stay on
/// one line.
fn no_break_percent(cell: &str) -> String {
    cell.replace(" %", "\u{a0}%")
}

fn draw_plots(plots: &Plots, description: &str) -> Svg {
    if plots.plots.is_empty() {
        return Svg::default();
    }
    let beside = plots.beside.max(1);
    let height = match beside {
        1 => ALONE,
        _ => MULTIPLE,
    };
    let is_bar = plots.plots.iter().any(|plot| !plot.bars.is_empty());
    let keys = plots.series.iter().enumerate();
    let mut legend: Vec<(Key, String)> = keys
        .map(|(series, name)| {
            let key = match is_bar {
                true => Key::Box(Paint::Tint(color(series))),
                false => Key::Line(stroke(color(series), 2.0)),
            };
            (key, name.clone())
        })
        .collect();
    if plots.plots.iter().any(|plot| !plot.paper.is_empty()) {
        let key = Key::Dot(Shape::Diamond, Paint::Full(INK));
        legend.push((key, "the paper's value".to_owned()));
    }
    let panels = plots.plots.iter().enumerate();
    let panels: Vec<Panel> = panels
        .map(|(place, plot)| panel(plot, height, place % beside == 0))
        .collect();
    let mut rows: Vec<Vec<Panel>> = panels.chunks(beside).map(<[Panel]>::to_vec).collect();
    for row in &mut rows {
        row.resize_with(beside, || empty(height));
    }
    Figure {
        description: description.to_owned(),
        legend,
        rows,
        ..Figure::default()
    }
    .svg()
}

/// Returns an empty plot for a position of the last row without a plot.
fn empty(height: f64) -> Panel {
    let nothing = || Axis::new("", Scale::Linear(0.0, 1.0));
    Panel::new("", nothing(), nothing(), height)
}

fn color(series: usize) -> Color {
    PALETTE[series % PALETTE.len()]
}

fn axis(along: &SheetAxis) -> Axis {
    let [low, high] = along.ends;
    let grid = along.ticks.is_empty() || along.logarithmic;
    let axis = match (along.logarithmic, along.ticks.is_empty()) {
        (true, _) => Axis::new(&along.name, Scale::Log(low, high)),
        (false, true) => Axis::linear(&along.name, (low, high), 5.0),
        (false, false) => Axis::new(&along.name, Scale::Linear(low, high)),
    };
    match along.ticks.is_empty() {
        true => axis,
        false => Axis {
            grid,
            ..axis.ticks(along.ticks.clone())
        },
    }
}

fn panel(plot: &Plot, height: f64, is_first: bool) -> Panel {
    let mut y = axis(&plot.y);
    if !is_first {
        // The label that all plots of a row share appears only at the left.
        y.name.clear();
    }
    let mut panel = Panel::new(&plot.title, axis(&plot.x), y, height);
    if let Some([from, to]) = plot.aside {
        let full_height = (f64::NEG_INFINITY, f64::INFINITY);
        let ground = Mark::Area((from, to), full_height, Paint::Tint(MUTED));
        panel.ground.push(ground);
    }
    panel.ground.extend(plot.bands.iter().map(band));
    let [left, right] = plot.x.ends;
    for band in &plot.bands {
        let across = vec![(left, band.middle), (right, band.middle)];
        panel
            .marks
            .push(Mark::Line(across, stroke(color(band.series), 1.6)));
    }
    panel.marks.extend(plot.bars.iter().flat_map(bar));
    let curves = plot.curves.iter().zip(widths(plot.curves.len()));
    panel
        .marks
        .extend(curves.flat_map(|(item, width)| curve(item, width)));
    let dot = |&[x, y]: &[f64; 2]| Mark::Dot((x, y), Shape::Diamond, 4.5, Paint::Full(INK));
    panel.marks.extend(plot.paper.iter().map(dot));
    panel
}

fn band(item: &Band) -> Mark {
    let everywhere = (f64::NEG_INFINITY, f64::INFINITY);
    Mark::Area(
        everywhere,
        (item.low, item.high),
        Paint::Tint(color(item.series)),
    )
}

/// Returns the marks of a bar: its box, the line at its value, and its interval.
fn bar(item: &Bar) -> Vec<Mark> {
    let ([left, right], color) = (item.x, color(item.series));
    let middle = 0.5 * (left + right);
    let area = Mark::Area((left, right), (0.0, item.value), Paint::Tint(color));
    let ends = vec![(left, item.value), (right, item.value)];
    let end = Mark::Line(ends, stroke(color, 2.0));
    let range = item.range.map(|ends| interval(middle, ends, color));
    [Some(area), Some(end), range]
        .into_iter()
        .flatten()
        .collect()
}

fn interval(at: f64, [low, high]: [f64; 2], color: Color) -> Mark {
    Mark::Line(vec![(at, low), (at, high)], stroke(color, 1.6))
}

/// Returns the widths of `count` lines, pixels. Lines that are drawn earlier are wider, so that a
/// line behind another stays visible.
fn widths(count: usize) -> impl Iterator<Item = f64> {
    let step = (2.0 / (count as f64 - 1.0).max(1.0)).min(1.0);
    (0..count).rev().map(move |above| 1.4 + step * above as f64)
}

fn curve(item: &Curve, width: f64) -> Vec<Mark> {
    let color = color(item.series);
    let points: Vec<(f64, f64)> = item.points.iter().map(|&[x, y]| (x, y)).collect();
    let dots = points.iter().filter(|_| item.marked);
    let dots: Vec<Mark> = dots
        .map(|&at| Mark::Dot(at, Shape::Disc, 3.5, Paint::Full(color)))
        .collect();
    let ranges = item.points.iter().zip(&item.ranges);
    let ranges: Vec<Mark> = ranges
        .map(|([x, _], ends)| interval(*x, *ends, color))
        .collect();
    let line = Mark::Line(points, stroke(color, width));
    [ranges, vec![line], dots].concat()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::laboratory::sheet::Grid;

    #[test]
    fn a_table_stands_under_its_number() {
        let row = |cells: [&str; 2]| cells.map(str::to_owned).to_vec();
        let grid = Grid {
            heads: row(["", "95 %"]),
            rows: vec![row(["P < Q", "8.4"])],
        };
        let sheet = Sheet::table("Table 8", "RMSE", "Simulated.".to_owned(), grid);
        let page = sheets(&[sheet]);
        for part in [
            "<h3>Table 8: RMSE</h3>",
            "<th scope=\"col\">95\u{a0}%</th>",
            "<th scope=\"row\">P &lt; Q</th><td>8.4</td>",
            "<p class=\"note\">Simulated.</p>",
        ] {
            assert!(page.as_str().contains(part), "{part}: {page:?}");
        }
    }

    /// Two plots and an empty panel fill each row of three; the legend contains the paper's value.
    #[test]
    fn plots_have_what_they_are_given() {
        let bar = Bar {
            series: 1,
            x: [-0.4, 0.4],
            value: 0.5,
            range: Some([0.4, 0.6]),
        };
        let plot = Plot {
            title: "P (2 draws)".to_owned(),
            x: SheetAxis::categorical("pattern", ["0".to_owned()]),
            y: SheetAxis::linear("torque", [0.0, 1.0]),
            bars: vec![bar],
            paper: vec![[0.0, 0.28]],
            ..Plot::default()
        };
        let plots = Plots {
            beside: 3,
            series: vec!["conducted".to_owned(), "isolated".to_owned()],
            plots: vec![plot.clone(), plot],
        };
        let svg = draw_plots(&plots, "torque by pattern");
        assert_eq!(svg.matches("P (2 draws)").count(), 2);
        // The axis label appears once, at the left of the row.
        assert_eq!(svg.matches(">torque<").count(), 1);
        assert!(svg.contains("the paper") && svg.contains("isolated"));
        assert!(draw_plots(&Plots::default(), "").is_empty());
    }
}
