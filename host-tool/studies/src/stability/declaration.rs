//! A map whose cells can be computed one by one.
//!
//! Such a map can be checked cheaply: a few cells are simulated again and compared with the
//! committed numbers, and text and picture follow from all committed numbers.

use super::map::class_of;
use super::{Cell, Map, Panels};

/// Row and column of a cell, and the panel in which it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Place {
    /// Index in [`Map::panels`].
    pub panel: usize,
    /// Index in the labels of [`Map::down`].
    pub row: usize,
    /// Index in the labels of [`Map::across`].
    pub column: usize,
}

/// A map before its simulation: axes, classes and texts, and the function that simulates a cell.
pub struct Declaration {
    /// The map; its panels have titles and no cells.
    pub map: Map,
    /// Returns result and prediction of the cell at a place, with all their digits.
    pub simulate: Box<dyn Fn(Place) -> Cell + Send + Sync>,
}

/// Rounds a number to the five digits that the CSV file has.
pub fn rounded(number: f64) -> f64 {
    format!("{number:.4e}").parse().unwrap_or(number)
}

impl Declaration {
    /// Returns result and prediction of the cell at a place, with all their digits.and rounds its numbers to those of the CSV file.
    pub fn cell(&self, place: Place) -> Cell {
        let cell = (self.simulate)(place);
        let told = cell.told.map(rounded);
        let classes = self.map.classes;
        Cell {
            class: class_of(classes, rounded(cell.number)),
            number: rounded(cell.number),
            predicted: told
                .map(|told| classes[class_of(classes, told)].verdict)
                .or(cell.predicted),
            told,
        }
    }

    /// Simulates all cells.
    pub fn draw(&self, progress: &mut dyn FnMut(f64)) -> Map {
        let map = &self.map;
        let mut panels = Panels::new(map.panels.len(), progress);
        let rows: Vec<usize> = (0..map.down.labels.len()).collect();
        let columns: Vec<usize> = (0..map.across.labels.len()).collect();
        for (panel, blank) in map.panels.iter().enumerate() {
            panels.add(blank.title.clone(), &rows, &columns, |row, column| {
                self.cell(Place {
                    panel,
                    row: *row,
                    column: *column,
                })
            });
        }
        Map {
            panels: panels.made,
            ..map.clone()
        }
    }

    /// Returns the map with the cells of a CSV file, or `None` if that is not a file of this map.
    pub fn read(&self, csv: &str) -> Option<Map> {
        let mut map = self.map.clone();
        let (rows, columns) = (map.down.labels.len(), map.across.labels.len());
        let mut reader = csv::Reader::from_reader(csv.as_bytes());
        let records: Vec<csv::StringRecord> = reader.records().flatten().collect();
        for panel in &mut map.panels {
            for label in map.down.labels.iter().take(rows) {
                let line = |value: &str| {
                    let is_line = |r: &&csv::StringRecord| {
                        r.get(0) == Some(&*panel.title)
                            && r.get(1) == Some(&**label)
                            && r.get(2) == Some(value)
                    };
                    records.iter().find(is_line)
                };
                let field = |value: &str, column: usize| line(value)?.get(3 + column);
                let cell = |column| {
                    let number = field("number", column)?.parse().ok()?;
                    Some(Cell {
                        class: class_of(map.classes, number),
                        number,
                        predicted: field("predicted verdict", column).and_then(|t| t.parse().ok()),
                        told: field("predicted number", column).and_then(|t| t.parse().ok()),
                    })
                };
                panel
                    .rows
                    .push((0..columns).map(cell).collect::<Option<_>>()?);
            }
        }
        Some(map)
    }
}

impl Map {
    /// Returns the cells as CSV. Each row of a panel has a line with its numbers, one with its
    /// verdicts, and where theory predicts something, one with the predicted verdicts and one with
    /// the predicted numbers.
    pub fn csv(&self) -> String {
        let mut out = csv::Writer::from_writer(Vec::new());
        let mut write = |head: [&str; 3], cells: Vec<String>| {
            let head = head.map(str::to_owned).into_iter();
            // Writing to memory cannot fail.
            let _ = out.write_record(head.chain(cells));
        };
        let down = self.down.caption();
        write(["panel", &down, "value"], self.across.labels.clone());
        let shown = |number: f64| format!("{}", rounded(number));
        for panel in &self.panels {
            for (label, row) in self.down.labels.iter().zip(&panel.rows) {
                let mut line = |value: &str, text: &dyn Fn(&Cell) -> Option<String>| {
                    if row.iter().any(|cell| text(cell).is_some()) {
                        let cells = row.iter().map(|cell| text(cell).unwrap_or_default());
                        write([&panel.title, label, value], cells.collect());
                    }
                };
                line("number", &|cell| Some(shown(cell.number)));
                line("verdict", &|cell| Some(self.verdict(cell).to_string()));
                line("predicted verdict", &|c| Some(c.predicted?.to_string()));
                line("predicted number", &|cell| Some(shown(cell.told?)));
            }
        }
        let bytes = out.into_inner().unwrap_or_default();
        String::from_utf8(bytes).unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Axis, Class, Layout, Panel};
    use super::*;

    const CLASSES: [Class; 2] = [
        Class::new('.', 5.0, "holds", 0),
        Class::new('X', f64::INFINITY, "grows", 1),
    ];

    #[test]
    fn a_map_is_read_back_from_its_csv() {
        let declared = Declaration {
            map: Map {
                name: "test",
                title: "A test",
                across: Axis::new("step", "ms", &[1, 2, 3], |x| format!("{x}")),
                down: Axis::new("limit", "ms", &[4, 5], |x| format!("{x}")),
                quantity: "the step",
                classes: &CLASSES,
                panels: ["one", "two, with a comma"].map(Panel::blank).to_vec(),
                theory: "step > limit",
                layout: Layout::Beside(1),
                notes: Vec::new(),
            },
            simulate: Box::new(|at| {
                let number = (at.panel * 4 + at.row * 2 + at.column) as f64 / 1.234_567_8;
                let told = (at.row == 0).then_some(f64::INFINITY);
                Cell::with_prediction(&CLASSES, number, told)
            }),
        };
        let map = declared.draw(&mut |_| {});
        assert_eq!(map.panels[1].rows[1][2].number, 6.48);
        assert_eq!(declared.read(&map.csv()), Some(map));
        assert_eq!(declared.read("panel,limit (ms),value,1,2,3\n"), None);
    }
}
