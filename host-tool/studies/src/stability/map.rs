//! A map of classes over two axes, with panels for a third, and its text.
//!
//! Every cell holds the result and, where there is a theory, its prediction. Both are verdicts of
//! the same kind, so that their boundaries can be compared and their disagreements counted.

use rayon::prelude::*;

/// Largest width of the text.
const COLUMNS: usize = 80;

/// One axis: name, unit, and a label for each row or column.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    /// Name of the quantity that varies.
    pub name: &'static str,
    /// Unit; empty for names and pure numbers.
    pub unit: &'static str,
    /// One label for each row or column.
    pub labels: Vec<String>,
}

/// One class of cells.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Class {
    /// Mark in the text.
    pub mark: char,
    /// Largest number in the class; larger numbers belong to a later class.
    pub up_to: f64,
    /// Description for the legend.
    pub meaning: &'static str,
    /// Verdict: 0 holds, 1 fails, 2 fails badly.
    pub verdict: u8,
}

/// Result and prediction for one pair of axis values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cell {
    /// Index into [`Map::classes`].
    pub class: usize,
    /// Measured value of [`Map::quantity`].
    pub number: f64,
    /// Verdict that theory predicts, as in [`Class::verdict`]; `None` if theory predicts nothing.
    pub predicted: Option<u8>,
    /// Number that theory predicts, if it predicts one.
    pub told: Option<f64>,
}

/// Cells for one value of the third axis.
#[derive(Clone, Debug, PartialEq)]
pub struct Panel {
    /// Value of the third axis, in words.
    pub title: String,
    /// Cells by row, as many as the axes have labels.
    pub rows: Vec<Vec<Cell>>,
    /// Text after each row; may be empty.
    pub remarks: Vec<String>,
}

/// Arrangement of the panels in a map's figure, with the number of panels side by side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Layout {
    /// Cells, panels along each row.
    Beside(usize),
    /// Cells, panels down each column.
    Down(usize),
    /// Measured and predicted numbers as lines, panels along each row.
    Lines(usize),
}

/// A map with its prediction and its explanation.
#[derive(Clone, Debug, PartialEq)]
pub struct Map {
    /// File stem in docs/maps.
    pub name: &'static str,
    /// Title of one line.
    pub title: &'static str,
    /// Axis of the columns.
    pub across: Axis,
    /// Axis of the rows.
    pub down: Axis,
    /// Quantity of the cells' numbers, with its unit.
    pub quantity: &'static str,
    /// Classes from the best to the worst.
    pub classes: &'static [Class],
    pub panels: Vec<Panel>,
    /// Formula of the predicted boundary, with its source.
    pub theory: &'static str,
    pub layout: Layout,
    /// Notes for the reader: method, fixed numbers, assumptions.
    pub notes: Vec<String>,
}

impl Axis {
    /// Makes an axis of values; `label` formats each.
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

    /// Returns name and unit.
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

/// Returns the class of a number; a number within rounding of a limit belongs to the lower class.
pub fn class_of(classes: &[Class], number: f64) -> usize {
    let above = |class: &&Class| number > class.up_to * (1.0 + 1e-9);
    classes.iter().take_while(above).count()
}

impl Cell {
    /// Makes a cell from a measured number, and the number that theory predicts.
    pub fn with_prediction(classes: &[Class], number: f64, told: Option<f64>) -> Self {
        Self {
            class: class_of(classes, number),
            number,
            predicted: told.map(|told| classes[class_of(classes, told)].verdict),
            told,
        }
    }

    /// Makes a cell from a measured number, and the verdict that theory predicts.
    pub fn with_verdict(classes: &[Class], number: f64, predicted: Option<u8>) -> Self {
        Self {
            predicted,
            ..Self::with_prediction(classes, number, None)
        }
    }
}

impl Panel {
    /// Returns the cells row by row.
    pub fn cells(&self) -> impl Iterator<Item = &Cell> {
        self.rows.iter().flatten()
    }
}

/// Builds panels; their cells are computed on all cores.
pub struct Panels<'a> {
    /// Number of panels.
    count: usize,
    /// Receives the finished part, 0 to 1.
    progress: &'a mut dyn FnMut(f64),
    /// Finished panels.
    pub made: Vec<Panel>,
}

impl<'a> Panels<'a> {
    /// Starts without panels; `count` will be added.
    pub fn new(count: usize, progress: &'a mut dyn FnMut(f64)) -> Self {
        Self {
            count,
            progress,
            made: Vec::new(),
        }
    }

    /// Adds a panel with the cell of each row and column.
    pub fn add<R: Sync, C: Sync>(
        &mut self,
        title: String,
        rows: &[R],
        columns: &[C],
        cell: impl Fn(&R, &C) -> Cell + Sync,
    ) {
        let mut panel = Panel {
            title,
            rows: Vec::new(),
            remarks: Vec::new(),
        };
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

/// Comparison of measured and predicted verdicts over a map.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Agreement {
    /// Number of cells with a prediction.
    pub predicted: usize,
    /// Number of cells worse than predicted.
    pub worse: usize,
    /// Number of cells better than predicted.
    pub better: usize,
}

impl Map {
    /// Returns the measured verdict of a cell.
    pub fn verdict(&self, cell: &Cell) -> u8 {
        self.classes[cell.class].verdict
    }

    /// Counts the cells in which measured and predicted verdicts differ.
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

    /// Returns the map as text: at most 80 columns, one mark for each cell, `|` between cells where
    /// theory's verdict changes.
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

/// Writes `words` after `head`, wrapped at 80 columns and indented below the head.
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
