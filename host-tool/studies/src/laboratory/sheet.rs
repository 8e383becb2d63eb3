//! Data beside a paper's tables and figures: stored in `result.json` and shown on the page.

use serde::{Deserialize, Serialize};

/// Our results in the form of a table or figure of the paper, under the paper's own number.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Sheet {
    /// The paper's number of the table or figure, such as "Table 8" or "Figure 12".
    pub number: String,
    /// What the sheet shows, in a few words.
    pub title: String,
    /// Explanation below the heading: whose data are shown, whether they are simulated, and what
    /// the paper shows.
    pub caption: String,
    /// The contents: a table, plots or a matrix.
    pub shows: SheetContent,
}

/// Contents of a sheet, by the way in which they are shown.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum SheetContent {
    /// A table of text cells.
    Table(Grid),
    /// Small plots in rows, with a common legend.
    Plots(Plots),
    /// Numbers in cells that are shaded by size.
    Matrix(Matrix),
}

/// Numbers in cells with shades, from white for 0 to the darkest for the largest number.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct Matrix {
    /// Quantity that the numbers measure, with its unit.
    pub unit: String,
    pub heads: Vec<String>,
    /// Name of each row, and one number per column.
    pub rows: Vec<(String, Vec<f64>)>,
}

/// A table of formatted cells; the first cell of each row is its name.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct Grid {
    pub heads: Vec<String>,
    /// Rows with one cell per column.
    pub rows: Vec<Vec<String>>,
}

/// Small plots in rows, with a common legend.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct Plots {
    /// Number of plots side by side in a row.
    pub beside: usize,
    /// Legend text of each series; the index of a series selects its colour.
    pub series: Vec<String>,
    /// Plots from left to right, row by row.
    pub plots: Vec<Plot>,
}

/// One plot: marks between two axes.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct Plot {
    pub title: String,
    pub x: SheetAxis,
    pub y: SheetAxis,
    /// Range of x that the evaluation leaves out, shown in grey; `None` if everything is evaluated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub aside: Option<[f64; 2]>,
    /// Horizontal bands behind all other marks.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub bands: Vec<Band>,
    /// Vertical bars that start at y = 0.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub bars: Vec<Bar>,
    /// Lines with their points, above all other marks except the paper's values.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub curves: Vec<Curve>,
    /// The paper's values as pairs of x and y, drawn on top.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub paper: Vec<[f64; 2]>,
}

/// An axis of a plot: its name, range and ticks.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct SheetAxis {
    /// Name of the quantity, with its unit.
    pub name: String,
    /// Smallest and largest value on the axis. On an axis of names, the ends are half a position
    /// beyond the first and the last name.
    pub ends: [f64; 2],
    /// Whether the axis is logarithmic; its ends must then be positive.
    #[serde(default, skip_serializing_if = "is_false")]
    pub logarithmic: bool,
    /// Position and text of each tick; if empty, ticks are at round values.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub ticks: Vec<(f64, String)>,
}

/// Horizontal band between two values of y, with a line inside it.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct Band {
    /// Index of the series to which the band belongs, from 0; it selects the colour.
    pub series: usize,
    /// Value of y at the lower edge.
    pub low: f64,
    /// Value of y at the line inside the band.
    pub middle: f64,
    /// Value of y at the upper edge.
    pub high: f64,
}

/// A vertical bar from y = 0 to a value, with an optional interval.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct Bar {
    /// Index of the series to which the bar belongs, from 0; it selects the colour.
    pub series: usize,
    /// Values of x at the left and the right edge.
    pub x: [f64; 2],
    /// Value of y at the end of the bar.
    pub value: f64,
    /// Lower and upper end of the interval around the value; `None` if there is none.
    pub range: Option<[f64; 2]>,
}

/// A line through points, optionally with a mark and an interval at each.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Curve {
    /// Index of the series to which the line belongs, from 0; it selects the colour.
    pub series: usize,
    /// Whether a mark is drawn at each point; only then may `ranges` contain intervals.
    pub marked: bool,
    /// Points of the line as pairs of x and y.
    pub points: Vec<[f64; 2]>,
    /// Lower and upper end of each point's interval; empty if the points have none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub ranges: Vec<[f64; 2]>,
}

#[allow(clippy::trivially_copy_pass_by_ref)] // serde passes a reference
const fn is_false(flag: &bool) -> bool {
    !*flag
}

impl SheetAxis {
    /// Creates a linear axis between these ends, with ticks at round values.
    #[must_use]
    pub fn linear(name: &str, ends: [f64; 2]) -> Self {
        Self {
            name: name.to_owned(),
            ends,
            ..Self::default()
        }
    }

    /// Creates an axis with one position per name; the first name is at 0, the next at 1.
    #[must_use]
    pub fn categorical(name: &str, names: impl IntoIterator<Item = String>) -> Self {
        let ticks: Vec<(f64, String)> = (0..).map(f64::from).zip(names).collect();
        Self {
            ends: [-0.5, ticks.len() as f64 - 0.5],
            ticks,
            ..Self::linear(name, [0.0; 2])
        }
    }
}

impl Curve {
    /// Creates a line through these points, which are rounded to a thousandth.
    #[must_use]
    pub fn line(series: usize, points: impl IntoIterator<Item = [f64; 2]>) -> Self {
        let round = |value: f64| (1e3 * value).round() / 1e3;
        Self {
            series,
            marked: false,
            points: points.into_iter().map(|point| point.map(round)).collect(),
            ranges: Vec::new(),
        }
    }
}

impl Sheet {
    /// Creates a sheet that shows a table.
    #[must_use]
    pub fn table(number: &str, title: &str, caption: String, grid: Grid) -> Self {
        Self {
            number: number.to_owned(),
            title: title.to_owned(),
            caption,
            shows: SheetContent::Table(grid),
        }
    }

    /// Creates a sheet that shows a matrix of shades.
    #[must_use]
    pub fn matrix(number: &str, title: &str, caption: String, matrix: Matrix) -> Self {
        Self {
            number: number.to_owned(),
            title: title.to_owned(),
            caption,
            shows: SheetContent::Matrix(matrix),
        }
    }

    /// Creates a sheet that shows plots.
    #[must_use]
    pub fn figure(number: &str, title: &str, caption: String, plots: Plots) -> Self {
        Self {
            number: number.to_owned(),
            title: title.to_owned(),
            caption,
            shows: SheetContent::Plots(plots),
        }
    }
}

impl Grid {
    /// Formats the table for a terminal, with names aligned left and numbers aligned right.
    #[must_use]
    pub fn in_columns(&self) -> String {
        let rows: Vec<&Vec<String>> = std::iter::once(&self.heads).chain(&self.rows).collect();
        let wide = |column: usize| {
            let cells = rows.iter().filter_map(|row| row.get(column));
            cells.map(|cell| cell.chars().count()).max().unwrap_or(0)
        };
        let wide: Vec<usize> = (0..self.heads.len()).map(wide).collect();
        let line = |row: &&Vec<String>| {
            let cells = row.iter().zip(&wide).enumerate();
            let cells = cells.map(|(place, (cell, wide))| match place {
                0 => format!("{cell:<wide$}"),
                _ => format!("{cell:>wide$}"),
            });
            cells.collect::<Vec<_>>().join("  ").trim_end().to_owned()
        };
        rows.iter().map(line).collect::<Vec<_>>().join("\n")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_as_wide_as_their_cells() {
        let row = |cells: [&str; 2]| cells.map(str::to_owned).to_vec();
        let grid = Grid {
            heads: row(["", "RMSE"]),
            rows: vec![row(["P", "8.4"]), row(["Q and S", "19.0"])],
        };
        assert_eq!(
            grid.in_columns(),
            "         RMSE\nP         8.4\nQ and S  19.0"
        );
    }

    #[test]
    fn names_have_a_place_each() {
        let along = SheetAxis::categorical("", ["a", "b", "c"].map(str::to_owned));
        assert_eq!(along.ends, [-0.5, 2.5]);
        assert_eq!(along.ticks[2], (2.0, "c".to_owned()));
    }
}
