//! Data beside a paper's tables and figures: stored in `result.json` and shown on the page.

use serde::{Deserialize, Serialize};

/// A table or figure under the paper's own number.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Sheet {
    /// The paper's number, as "Table 8" or "Figure 12".
    pub number: String,
    /// Subject in a few words.
    pub title: String,
    /// Explanation of the contents: whose data they are, whether they are simulated, and what the
    /// paper shows.
    pub caption: String,
    /// Numbers to show.
    pub shows: SheetContent,
}

/// Contents of a sheet, by kind of presentation.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum SheetContent {
    /// Text in rows and columns.
    Table(Grid),
    /// Small multiples with axes.
    Plots(Plots),
    /// Numbers in shaded cells.
    Matrix(Matrix),
}

/// Numbers with shades, from white for 0 to darkest for the largest.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct Matrix {
    /// Quantity that the numbers measure.
    pub unit: String,
    /// Column heads.
    pub heads: Vec<String>,
    /// Name of each row, and one number per column.
    pub rows: Vec<(String, Vec<f64>)>,
}

/// A table of formatted cells; the first cell of a row is its name.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct Grid {
    /// Column heads.
    pub heads: Vec<String>,
    /// Rows with one cell per column.
    pub rows: Vec<Vec<String>>,
}

/// Plots side by side.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct Plots {
    /// Number of plots in a row.
    pub beside: usize,
    /// Legend of each colour, in the order of the palette.
    pub series: Vec<String>,
    /// Plots from left to right, row by row.
    pub plots: Vec<Plot>,
}

/// Marks between two axes.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct Plot {
    /// Heading above the plot.
    pub title: String,
    /// Horizontal axis.
    pub x: SheetAxis,
    /// Vertical axis.
    pub y: SheetAxis,
    /// Range of x that the evaluation ignores, shown in grey.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub aside: Option<[f64; 2]>,
    /// Horizontal bands behind all other marks.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub bands: Vec<Band>,
    /// Vertical bars from 0.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub bars: Vec<Bar>,
    /// Lines above all marks except the paper's values.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub curves: Vec<Curve>,
    /// The paper's values, as x and y.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub paper: Vec<[f64; 2]>,
}

/// Name, range and ticks of an axis.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct SheetAxis {
    /// Quantity with its unit.
    pub name: String,
    /// Smallest and largest value; on an axis of names, half a position beyond the first and the
    /// last.
    pub ends: [f64; 2],
    /// Whether the scale is logarithmic.
    #[serde(default, skip_serializing_if = "is_false")]
    pub logarithmic: bool,
    /// Position and text of each tick; empty for round steps.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub ticks: Vec<(f64, String)>,
}

/// Horizontal band between two values of y.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct Band {
    /// Index of the series, from 0.
    pub series: usize,
    /// Lower edge.
    pub low: f64,
    /// Value of the line inside the band.
    pub middle: f64,
    /// Upper edge.
    pub high: f64,
}

/// A vertical bar from 0.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct Bar {
    /// Index of the series, from 0.
    pub series: usize,
    /// Left and right edge.
    pub x: [f64; 2],
    /// Height of the bar.
    pub value: f64,
    /// Lower and upper end of the interval.
    pub range: Option<[f64; 2]>,
}

/// A line through points.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Curve {
    /// Index of the series, from 0.
    pub series: usize,
    /// Whether each point has a mark; only then may `ranges` contain intervals.
    pub marked: bool,
    /// Points as x and y.
    pub points: Vec<[f64; 2]>,
    /// Interval of each point; empty without intervals.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub ranges: Vec<[f64; 2]>,
}

#[allow(clippy::trivially_copy_pass_by_ref)] // serde passes a reference
const fn is_false(flag: &bool) -> bool {
    !*flag
}

impl SheetAxis {
    /// Creates a linear axis between these ends, with round steps.
    #[must_use]
    pub fn linear(name: &str, ends: [f64; 2]) -> Self {
        Self {
            name: name.to_owned(),
            ends,
            ..Self::default()
        }
    }

    /// Creates an axis with one position per name, the first at 0.
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
    /// Creates a line through these points, rounded to a thousandth, which is finer than any
    /// picture shows.
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
