//! Figure of a stability map: cells coloured by class, theory's boundary as a line, a dot where
//! theory and result disagree. Maps whose theory gives numbers are drawn as lines.

use crate::stability::{Cell, Class, Layout, Map, Panel as Found};
use host_core::plot::ink::{EDGE, GRID, HALO, MUTED, PALETTE, stroke};
use host_core::plot::series::range;
use host_core::plot::{At, Axis, Color, Figure, Key, Mark, Paint, Panel, Scale, Shape};

/// First and last colour for the classes of each verdict: blue if the method holds, orange if it
/// fails, dark red if it fails badly.
const RAMPS: [(Color, Color); 3] = [
    (Color(0xCF, 0xE8, 0xF7), Color(0x1B, 0x6C, 0xA0)),
    (Color(0xF6, 0xC8, 0x60), Color(0xD9, 0x7B, 0x00)),
    (Color(0xC2, 0x4A, 0x00), Color(0x7A, 0x22, 0x00)),
];
/// Height of a cell, pixels.
const CELL: f64 = 18.0;
/// Strokes of theory's boundary: first a light halo, then the line, each with its width in pixels.
const BOUNDARY: [(Color, f64); 2] = [(HALO, 4.8), (EDGE, 2.4)];
/// Discs that mark a cell in which theory and result disagree: first a light halo, then the dot,
/// each with its radius in pixels.
const DISAGREES: [(Color, f64); 2] = [(HALO, 3.0), (EDGE, 2.0)];

/// Draws the map as an SVG file and returns its text. It is drawn as lines if theory predicts
/// numbers, otherwise as coloured cells.
pub fn picture(map: &Map) -> String {
    let is_lines = matches!(map.layout, Layout::Lines(_));
    let (legend, subtitle) = match is_lines {
        true => (lines_legend(map), lines_subtitle(map)),
        false => (cells_legend(map), cells_subtitle(map)),
    };
    let panel = |n: usize| match is_lines {
        true => lines(map, &map.panels[n]),
        false => cells(map, &map.panels[n]),
    };
    let count = map.panels.len();
    let (Layout::Beside(beside) | Layout::Down(beside) | Layout::Lines(beside)) = map.layout;
    let columns = beside.min(count);
    let rows = count.div_ceil(columns);
    let place = |r: usize, c: usize| match map.layout {
        Layout::Down(_) => c * rows + r,
        _ => r * columns + c,
    };
    let row = |r| {
        let own = (0..columns).map(|c| place(r, c));
        own.filter(|n| *n < count).map(panel).collect()
    };
    Figure {
        title: format!("{} (simulated)", map.title),
        subtitle,
        description: map.title.to_owned(),
        legend,
        rows: (0..rows).map(row).collect(),
        notes: vec![format!("Theory: {}", map.theory)],
    }
    .file()
}

/// Returns the colour of a class, between the two colours of its verdict.
fn color(map: &Map, class: &Class) -> Color {
    let alike = || map.classes.iter().filter(|c| c.verdict == class.verdict);
    let place = alike().position(|c| c == class).unwrap_or(0);
    let part = place as f64 / (alike().count() - 1).max(1) as f64;
    let (from, to) = RAMPS[usize::from(class.verdict.min(2))];
    from.mix(to, part)
}

fn cells_subtitle(map: &Map) -> String {
    let agreement = map.agreement();
    format!(
        "Colour: {}. {} of {} cells disagree with theory, {} worse and {} better.",
        map.quantity,
        agreement.worse + agreement.better,
        agreement.predicted,
        agreement.worse,
        agreement.better
    )
}

fn cells_legend(map: &Map) -> Vec<(Key, String)> {
    let class = |class: &Class| {
        let name = match class.verdict {
            0 => class.meaning.to_owned(),
            _ => format!("{} (fails)", class.meaning),
        };
        (Key::Box(Paint::Full(color(map, class))), name)
    };
    let theory = [
        (Key::Line(stroke(EDGE, 2.4)), "theory's verdict changes"),
        (
            Key::Dot(Shape::Disc, Paint::Full(EDGE)),
            "disagrees with theory",
        ),
    ];
    let theory = theory.map(|(key, name)| (key, name.to_owned()));
    map.classes.iter().map(class).chain(theory).collect()
}

fn cells(map: &Map, found: &Found) -> Panel {
    let labels = |axis: &crate::stability::Axis| axis.labels.clone();
    let x = Axis::rows(&map.across.caption(), labels(&map.across));
    let mut down = labels(&map.down);
    // Numbers increase upwards.
    let grows = down
        .last()
        .is_some_and(|label| label.parse::<f64>().is_ok());
    let row = |r: usize| if grows { found.rows.len() - 1 - r } else { r };
    if grows {
        down.reverse();
    }
    let y = Axis::rows(&map.down.caption(), down);
    let mut panel = Panel::new(&found.title, x, y, found.rows.len() as f64 * CELL);
    let numbered = || {
        let rows = found.rows.iter().enumerate();
        rows.flat_map(|(r, row)| row.iter().enumerate().map(move |(c, cell)| (r, c, cell)))
    };
    for (r, c, cell) in numbered() {
        let (x, y) = (c as f64, row(r) as f64);
        let fill = Paint::Full(color(map, &map.classes[cell.class]));
        // A narrow gap between cells.
        let (across, up) = ((x - 0.5, x + 0.47), (y - 0.5, y + 0.47));
        panel.marks.push(Mark::Area(across, up, fill));
    }
    let edges = boundary(&found.rows);
    for (color, width) in BOUNDARY {
        let corner = |(r, c): (usize, usize)| {
            let y = if grows { found.rows.len() - r } else { r };
            (c as f64 - 0.5, y as f64 - 0.5)
        };
        let line =
            |&(from, to): &Edge| Mark::Line(vec![corner(from), corner(to)], stroke(color, width));
        panel.marks.extend(edges.iter().map(line));
    }
    for (r, c, cell) in numbered() {
        if cell.predicted.is_some_and(|p| p != map.verdict(cell)) {
            let at = (c as f64, row(r) as f64);
            let dot = |(color, radius)| Mark::Dot(at, Shape::Disc, radius, Paint::Full(color));
            panel.marks.extend(DISAGREES.map(dot));
        }
    }
    panel
}

/// Edge between two cells: the grid corners at both ends, each as row and column.
type Edge = ((usize, usize), (usize, usize));

/// Returns the edges between neighbouring cells with different predictions. No edge is drawn
/// between two rows if one of them has no predictions.
fn boundary(rows: &[Vec<Cell>]) -> Vec<Edge> {
    let speaks = |row: &[Cell]| row.iter().any(|cell| cell.predicted.is_some());
    let differ = |a: &Cell, b: &Cell| a.predicted != b.predicted;
    let mut edges = Vec::new();
    for (r, row) in rows.iter().enumerate() {
        for (c, cell) in row.iter().enumerate() {
            if row.get(c + 1).is_some_and(|right| differ(cell, right)) {
                edges.push(((r, c + 1), (r + 1, c + 1)));
            }
            let below = rows.get(r + 1).filter(|below| speaks(below) && speaks(row));
            let below = below.and_then(|row| row.get(c));
            if below.is_some_and(|below| differ(cell, below)) {
                edges.push(((r + 1, c), (r + 1, c + 1)));
            }
        }
    }
    edges
}

/// Returns colour and mark of a row that is drawn as a line. Rows beyond the colours of the palette
/// are grey.
fn series(row: usize) -> (Color, Shape) {
    let color = PALETTE.get(row).copied().unwrap_or(MUTED);
    (color, Shape::SERIES[row % Shape::SERIES.len()])
}

fn lines_subtitle(map: &Map) -> String {
    format!(
        "Lines: {}; beside each are its name and the fit. A row that diverges has no line.",
        map.quantity
    )
}

fn lines_legend(map: &Map) -> Vec<(Key, String)> {
    let rows = map.down.labels.iter().enumerate();
    let named = rows.map(|(row, name)| {
        let (color, shape) = series(row);
        (Key::Marked(stroke(color, 1.8), shape), name.clone())
    });
    named
        .chain([(Key::Line(TOLD), "theory".to_owned())])
        .collect()
}

/// Stroke of theory's prediction: a broad, pale line below the measured ones.
const TOLD: host_core::plot::Stroke = stroke(GRID, 9.0);

/// Draws the numbers of each row over the columns of the map, both axes logarithmic. The labels of
/// the columns must be numbers.
fn lines(map: &Map, found: &Found) -> Panel {
    let columns: Vec<f64> = map.across.labels.iter().flat_map(|l| l.parse()).collect();
    let drawn = |y: &f64| y.is_finite() && *y > 0.0;
    let numbers = map.panels.iter().flat_map(|panel| {
        let values = panel.cells().map(|cell| [Some(cell.number), cell.told]);
        values.flatten().flatten()
    });
    let (low, high) = range(numbers.filter(drawn).map(libm::log10)).unwrap_or((0.0, 1.0));
    let ends = (columns[0] * 0.9, columns[columns.len() - 1] * 1.1);
    let ticks = columns
        .iter()
        .copied()
        .zip(map.across.labels.iter().cloned());
    let x = Axis::new(&map.across.caption(), Scale::Log(ends.0, ends.1)).ticks(ticks.collect());
    let mut y = Axis::decades(map.quantity, (low.floor() as i32, high.ceil() as i32));
    let path = |row: &[Cell], number: fn(&Cell) -> Option<f64>| -> Vec<At> {
        let pairs = columns.iter().zip(row);
        pairs
            .filter_map(|(x, cell)| Some((*x, number(cell).filter(drawn)?)))
            .collect()
    };
    let mut marks = Vec::new();
    for row in &found.rows {
        marks.push(Mark::Line(path(row, |cell| cell.told), TOLD));
    }
    for (r, row) in found.rows.iter().enumerate().rev() {
        let (path, (color, shape)) = (path(row, |cell| Some(cell.number)), series(r));
        // The marks of different rows are shifted, so that overlapping lines can be distinguished.
        let every = path.iter().skip(r % 4).step_by(4);
        let dots: Vec<Mark> = every
            .map(|at| Mark::Dot(*at, shape, 3.5, Paint::Full(color)))
            .collect();
        let remark = found.remarks.get(r).map_or("", String::as_str);
        let words = format!("{} {remark}", map.down.labels[r]);
        match path.last() {
            Some((_, end)) => y = y.add_far_label(*end, &words, None, color),
            None => y = y.add_far_label(libm::pow(10f64, high.ceil()), &words, None, MUTED),
        }
        marks.push(Mark::Line(path, stroke(color, 1.8)));
        marks.extend(dots);
    }
    Panel {
        marks,
        ..Panel::new(&found.title, x, y, 190.0)
    }
}
