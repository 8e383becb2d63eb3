//! What stands beside one of a paper's tables or figures, as numbers: `result.json` keeps
//! it, and the page draws it.

use serde::{Deserialize, Serialize};

/// A table or a figure under the paper's own number.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Sheet {
    /// "Table 8", "Figure 12", as the paper numbers it.
    pub number: String,
    /// What it is of, in a few words.
    pub title: String,
    /// What is shown, of whom, whether it is simulated, and what the paper's shows.
    pub caption: String,
    /// Its numbers.
    pub shows: SheetContent,
}

/// What a sheet shows.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum SheetContent {
    /// Rows and columns.
    Table(Grid),
    /// Small multiples.
    Plots(Plots),
    /// Shades.
    Matrix(Matrix),
}

/// Numbers as shades, from none to the largest.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct Matrix {
    /// What a number is of.
    pub unit: String,
    /// Over the columns.
    pub heads: Vec<String>,
    /// Names with as many numbers as there are heads.
    pub rows: Vec<(String, Vec<f64>)>,
}

/// Cells as they are printed, the first of a row its name.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct Grid {
    /// Over the columns.
    pub heads: Vec<String>,
    /// As many cells as there are heads, each.
    pub rows: Vec<Vec<String>>,
}

/// Plots side by side.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct Plots {
    /// As many in a row.
    pub beside: usize,
    /// What each colour is, in the order of the palette.
    pub series: Vec<String>,
    /// The plots.
    pub plots: Vec<Plot>,
}

/// Marks between two axes.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct Plot {
    /// Over it.
    pub title: String,
    /// Across.
    pub x: SheetAxis,
    /// Up.
    pub y: SheetAxis,
    /// From x to x: what does not count.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub aside: Option<[f64; 2]>,
    /// Ranges across the whole plot, under everything.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub bands: Vec<Band>,
    /// Upright bars from 0.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub bars: Vec<Bar>,
    /// Lines, over everything but the paper's numbers.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub curves: Vec<Curve>,
    /// What the paper printed, at x and y.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub paper: Vec<[f64; 2]>,
}

/// An axis.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct SheetAxis {
    /// What is counted, with its unit.
    pub name: String,
    /// Its ends; of names, half a place beyond the first and the last.
    pub ends: [f64; 2],
    /// Whether it is even in the logarithm.
    #[serde(default, skip_serializing_if = "is_false")]
    pub logarithmic: bool,
    /// Values with what stands there; round steps without.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub ticks: Vec<(f64, String)>,
}

/// From one y to another.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct Band {
    /// Of which series, from 0.
    pub series: usize,
    /// From where.
    pub low: f64,
    /// Middle.
    pub middle: f64,
    /// To where.
    pub high: f64,
}

/// A bar from 0.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct Bar {
    /// Of which series, from 0.
    pub series: usize,
    /// Left and right end.
    pub x: [f64; 2],
    /// Its height.
    pub value: f64,
    /// Ends of its interval.
    pub range: Option<[f64; 2]>,
}

/// A line.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Curve {
    /// Of which series, from 0.
    pub series: usize,
    /// Whether each point is marked; then `ranges` may have its interval.
    pub marked: bool,
    /// x and y.
    pub points: Vec<[f64; 2]>,
    /// Of each point, or none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub ranges: Vec<[f64; 2]>,
}

#[allow(clippy::trivially_copy_pass_by_ref)] // as serde asks for it
const fn is_false(flag: &bool) -> bool {
    !*flag
}

impl SheetAxis {
    /// From one value to another, in round steps.
    #[must_use]
    pub fn linear(name: &str, ends: [f64; 2]) -> Self {
        Self {
            name: name.to_owned(),
            ends,
            ..Self::default()
        }
    }

    /// A place for each name, the first at 0.
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
    /// A line through these, to a thousandth of a unit: no picture shows more.
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
    /// A table.
    #[must_use]
    pub fn table(number: &str, title: &str, caption: String, grid: Grid) -> Self {
        Self {
            number: number.to_owned(),
            title: title.to_owned(),
            caption,
            shows: SheetContent::Table(grid),
        }
    }

    /// A table of shades.
    #[must_use]
    pub fn matrix(number: &str, title: &str, caption: String, matrix: Matrix) -> Self {
        Self {
            number: number.to_owned(),
            title: title.to_owned(),
            caption,
            shows: SheetContent::Matrix(matrix),
        }
    }

    /// A figure.
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
    /// For a terminal: names to the left, numbers to the right.
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
