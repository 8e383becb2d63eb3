//! A map of classes over two axes, with panels for a third, and its text.
//!
//! Every cell holds the result and, where there is a theory, its prediction. Both are verdicts of
//! the same kind, so that their boundaries can be compared and their disagreements counted.

use rayon::prelude::*;

/// Largest width of a line in the map's text, characters.
const COLUMNS: usize = 80;

/// An axis of a map, with a label for each row or column.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    /// Name of the quantity that varies.
    pub name: &'static str,
    /// Unit of the quantity; empty for names and pure numbers.
    pub unit: &'static str,
    /// One label for each row or column.
    pub labels: Vec<String>,
}

/// A class of cells, with its mark in the text and its verdict.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Class {
    /// Character that stands for a cell of this class in the text.
    pub mark: char,
    /// Largest number of a cell in this class; a larger number belongs to a later class.
    pub up_to: f64,
    /// Description of the class for the legend.
    pub meaning: &'static str,
    /// Verdict on the method in these cells: 0 if it holds, 1 if it fails, 2 if it fails badly.
    pub verdict: u8,
}

/// A cell of a map: result and prediction for one value of each axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cell {
    /// Index of the cell's class in [`Map::classes`].
    pub class: usize,
    /// Measured value of the quantity that [`Map::quantity`] names.
    pub number: f64,
    /// Verdict that theory predicts, as in [`Class::verdict`]; `None` where theory makes no
    /// prediction.
    pub predicted: Option<u8>,
    /// Number that theory predicts for `number`; `None` if theory predicts no number.
    pub told: Option<f64>,
}

/// All cells for one value of the third quantity, which distinguishes the panels.
#[derive(Clone, Debug, PartialEq)]
pub struct Panel {
    /// Value of the third quantity, in words.
    pub title: String,
    /// Cells, row by row: as many rows and columns as the axes have labels.
    pub rows: Vec<Vec<Cell>>,
    /// Text that follows each row; the list may be empty.
    pub remarks: Vec<String>,
}

/// How the figure of a map shows its panels. Each variant contains the number of panels side by
/// side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Layout {
    /// As coloured cells, panels following each other along the rows.
    Beside(usize),
    /// As coloured cells, panels following each other down the columns.
    Down(usize),
    /// As lines of measured and predicted numbers, panels following each other along the rows.
    Lines(usize),
}

/// A map of where a method holds and where it fails, with predictions of theory.
#[derive(Clone, Debug, PartialEq)]
pub struct Map {
    /// Name of the map's files in docs/maps, without extension.
    pub name: &'static str,
    /// Title of the map, a single line.
    pub title: &'static str,
    /// Axis along which the columns lie.
    pub across: Axis,
    /// Axis along which the rows lie.
    pub down: Axis,
    /// Quantity of the numbers in the cells, with its unit.
    pub quantity: &'static str,
    /// Classes of cells, from the best to the worst.
    pub classes: &'static [Class],
    pub panels: Vec<Panel>,
    /// Formula by which theory predicts numbers or verdicts, with its source.
    pub theory: &'static str,
    pub layout: Layout,
    /// Notes for the reader: method, fixed numbers, assumptions.
    pub notes: Vec<String>,
}

impl Axis {
    /// Creates an axis for these values; `label` formats each value.
    pub fn new<T>(
        name: &'static str,
        unit: &'static str,
        values: &[T],
        label: impl Fn(&T) -> String,
    ) -> Self {
        Self {
            name,
            unit,
            labels: values.iter().map(label).collect(),
        }
    }

    /// Returns the name with the unit in parentheses.
    pub fn caption(&self) -> String {
        match self.unit {
            "" => self.name.to_owned(),
            unit => format!("{} ({unit})", self.name),
        }
    }
}

impl Class {
    pub const fn new(mark: char, up_to: f64, meaning: &'static str, verdict: u8) -> Self {
        Self {
            mark,
            up_to,
            meaning,
            verdict,
        }
    }
}

/// Returns the index of the class to which a number belongs. A number that exceeds a limit only by
/// a rounding error belongs to the class below it.
pub fn class_of(classes: &[Class], number: f64) -> usize {
    let above = |class: &&Class| number > class.up_to * (1.0 + 1e-9);
    classes.iter().take_while(above).count()
}

impl Cell {
    /// Creates a cell from a measured number and the number that theory predicts, if it predicts
    /// one.
    pub fn with_prediction(classes: &[Class], number: f64, told: Option<f64>) -> Self {
        Self {
            class: class_of(classes, number),
            number,
            predicted: told.map(|told| classes[class_of(classes, told)].verdict),
            told,
        }
    }

    /// Creates a cell from a measured number and the verdict that theory predicts, if it predicts
    /// one.
    pub fn with_verdict(classes: &[Class], number: f64, predicted: Option<u8>) -> Self {
        Self {
            predicted,
            ..Self::with_prediction(classes, number, None)
        }
    }
}

impl Panel {
    /// Creates a panel without cells.
    pub fn blank(title: impl Into<String>) -> Self {
        Self {
            title: title.into(),
            rows: Vec::new(),
            remarks: Vec::new(),
        }
    }

    /// Returns the cells row by row.
    pub fn cells(&self) -> impl Iterator<Item = &Cell> {
        self.rows.iter().flatten()
    }
}

/// Builds the panels of a map one after the other; the cells of a row are computed on all cores.
pub struct Panels<'a> {
    /// Number of panels that the map will have.
    count: usize,
    /// Function that receives the finished part of the map, 0 to 1.
    progress: &'a mut dyn FnMut(f64),
    /// Panels that are finished.
    pub made: Vec<Panel>,
}

impl<'a> Panels<'a> {
    /// Starts without a panel. `count` panels must be added; `progress` receives the finished part,
    /// 0 to 1.
    pub fn new(count: usize, progress: &'a mut dyn FnMut(f64)) -> Self {
        Self {
            count,
            progress,
            made: Vec::new(),
        }
    }

    /// Computes a panel by calling `cell` for each pair of a row and a column, and adds it.
    pub fn add<R: Sync, C: Sync>(
        &mut self,
        title: String,
        rows: &[R],
        columns: &[C],
        cell: impl Fn(&R, &C) -> Cell + Sync,
    ) {
        let mut panel = Panel::blank(title);
        for row in rows {
            let cells = columns.par_iter().map(|column| cell(row, column));
            panel.rows.push(cells.collect());
            let part = panel.rows.len() as f64 / rows.len() as f64;
            (self.progress)((self.made.len() as f64 + part) / self.count as f64);
        }
        self.made.push(panel);
    }
}

/// Returns the smallest and the largest of the ratios of prediction to measurement.
pub fn extremes(ratios: impl Iterator<Item = f64>) -> (f64, f64) {
    ratios.fold((f64::MAX, 0.0), |(low, high), x| (low.min(x), high.max(x)))
}

/// How well predicted verdicts agree with measured ones, over all cells of a map.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Agreement {
    /// Number of cells for which theory predicts a verdict.
    pub predicted: usize,
    /// Number of cells whose measured verdict is worse than the predicted one.
    pub worse: usize,
    /// Number of cells whose measured verdict is better than the predicted one.
    pub better: usize,
}

impl Map {
    /// Returns the measured verdict of a cell, which is that of its class.
    pub fn verdict(&self, cell: &Cell) -> u8 {
        self.classes[cell.class].verdict
    }

    /// Compares measured and predicted verdicts, and counts the differences.
    pub fn agreement(&self) -> Agreement {
        let mut all = Agreement::default();
        for cell in self.panels.iter().flat_map(Panel::cells) {
            let Some(predicted) = cell.predicted else {
                continue;
            };
            let found = self.verdict(cell);
            all.predicted += 1;
            all.worse += usize::from(found > predicted);
            all.better += usize::from(found < predicted);
        }
        all
    }

    /// Returns the map as text of at most 80 columns, with one mark for each cell and `|` between
    /// cells where the predicted verdict changes.
    pub fn text(&self) -> String {
        let mut out = String::new();
        self.write(&mut out);
        out
    }

    fn write(&self, out: &mut String) {
        out.push_str(&format!("{}\n\n", self.title));
        out.push_str(&format!("across: {}\n", self.across.caption()));
        out.push_str(&format!("down:   {}\n", self.down.caption()));
        out.push_str(&format!("marks:  {}\n", self.quantity));
        for class in self.classes {
            let verdict = ["", "  fails", "  fails badly"][usize::from(class.verdict.min(2))];
            out.push_str(&format!(
                "   {}    {}{verdict}\n",
                class.mark, class.meaning
            ));
        }
        wrapped(out, "   |    theory's verdict changes here: ", self.theory);
        out.push('\n');
        for panel in &self.panels {
            self.write_panel(out, panel);
        }
        for note in &self.notes {
            wrapped(out, "", note);
        }
        let Agreement {
            predicted,
            worse,
            better,
        } = self.agreement();
        out.push_str(&format!(
            "{} of {predicted} cells disagree with theory: {worse} worse, {better} better.\n",
            worse + better
        ));
    }

    fn write_panel(&self, out: &mut String, panel: &Panel) {
        let margin = self.down.labels.iter().map(|l| l.chars().count()).max();
        let margin = margin.unwrap_or(0);
        if !panel.title.is_empty() {
            out.push_str(&format!("{}\n", panel.title));
        }
        // Column labels stand upright, read from the top.
        let tall = self.across.labels.iter().map(|l| l.chars().count()).max();
        for line in 0..tall.unwrap_or(0) {
            let letters = self.across.labels.iter().map(|label| {
                let skip = tall.unwrap_or(0) - label.chars().count();
                let letter = line.checked_sub(skip).and_then(|n| label.chars().nth(n));
                format!(" {}", letter.unwrap_or(' '))
            });
            let letters: String = letters.collect();
            out.push_str(&format!(
                "{}\n",
                format!("{:margin$} {letters}", "").trim_end()
            ));
        }
        for (n, (label, row)) in self.down.labels.iter().zip(&panel.rows).enumerate() {
            out.push_str(&format!("{label:>margin$} "));
            // Every row starts as if left of it nothing failed, or as if theory predicted nothing.
            let mut before = row.first().and_then(|c| c.predicted).map(|_| 0);
            for cell in row {
                let edge = if cell.predicted == before { ' ' } else { '|' };
                out.push_str(&format!("{edge}{}", self.classes[cell.class].mark));
                before = cell.predicted;
            }
            let remark = panel.remarks.get(n).map_or("", String::as_str);
            out.push_str(&format!(
                "{}\n",
                if remark.is_empty() {
                    String::new()
                } else {
                    format!("  {remark}")
                }
            ));
        }
        out.push('\n');
    }
}

/// Appends `head` and `words` to `out`. Words are wrapped at 80 columns and indented so that they
/// start below each other.
fn wrapped(out: &mut String, head: &str, words: &str) {
    let indent = head.chars().count().min(8);
    let mut line = head.to_owned();
    let mut fresh = true;
    for word in words.split_whitespace() {
        if !fresh && line.chars().count() + 1 + word.chars().count() > COLUMNS {
            out.push_str(&format!("{}\n", line.trim_end()));
            line = " ".repeat(indent);
            fresh = true;
        }
        if !fresh {
            line.push(' ');
        }
        line.push_str(word);
        fresh = false;
    }
    out.push_str(&format!("{}\n", line.trim_end()));
}

#[cfg(test)]
mod tests {
    use super::*;

    const CLASSES: [Class; 2] = [
        Class::new('.', 5.0, "holds", 0),
        Class::new('X', f64::INFINITY, "grows", 1),
    ];

    fn map() -> Map {
        let (rows, columns) = ([1.0, 5.0, 0.5], [1.0, 2.0, 10.0]);
        let mut tell = |_| {};
        let mut panels = Panels::new(1, &mut tell);
        panels.add("one".to_owned(), &rows, &columns, |limit, x| {
            Cell::with_verdict(&CLASSES, *x, Some(u8::from(x > limit)))
        });
        Map {
            name: "test",
            title: "A test",
            across: Axis::new("step", "ms", &columns, |x| format!("{x}")),
            down: Axis::new("limit", "ms", &rows, |x| format!("{x}")),
            quantity: "the step",
            classes: &CLASSES,
            panels: panels.made,
            theory: "step > limit",
            layout: Layout::Beside(1),
            notes: vec!["Nothing is assumed.".to_owned()],
        }
    }

    #[test]
    fn the_text_shows_both_boundaries_and_counts_where_they_differ() {
        let map = map();
        let agreement = Agreement {
            predicted: 9,
            worse: 0,
            better: 3,
        };
        assert_eq!(map.agreement(), agreement);
        let text = map.text();
        assert!(
            text.contains("\n         1\n     1 2 0\n  1  .|. X\n  5  . .|X\n0.5 |. . X\n"),
            "{text}"
        );
        assert!(text.contains("3 of 9 cells disagree with theory: 0 worse, 3 better."));
        assert!(text.lines().all(|line| line.chars().count() <= COLUMNS));
    }
}
