//! Compares the results of experiments and sweeps side by side.

use super::error::LaboratoryError;
use super::numbers::large_t;
use super::page::read_outcome;
use super::result::{Outcome, Row};
use hal_sim::input;
use host_core::html;
use host_core::report::{FileDifference, Html};
use serde::Serialize;
use std::collections::HashMap;
use std::io::ErrorKind;
use std::path::Path;

/// Largest number of rows that a terminal shows; the page shows all.
const MOST_ROWS: usize = 12;

/// The result of an experiment or a sweep, with the name under which it is compared.
#[derive(Debug)]
pub struct NamedResult {
    /// Path of the folder that contains the result, as the user typed it.
    pub name: String,
    /// The result that was read.
    pub outcome: Outcome,
    /// Text of the declaration; empty if the folder has no copy of it.
    declaration: String,
}

/// One number as it is in each of the compared results.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct ResultRow {
    /// Identifier of condition and measure, or of the claim.
    pub id: String,
    /// Readable name of the measure and condition, or wording of the claim.
    pub quantity: String,
    /// Unit of the values; "cases" for a claim, whose values are shares from 0 to 1.
    pub unit: String,
    /// Value in each result, in their order; `None` where a result does not have this row.
    pub values: Vec<Option<ResultValue>>,
}

/// Value of a measure or claim in one result, with its range.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct ResultValue {
    /// Median over the wearers or rounds; for a claim, the share of cases in which it holds.
    pub value: Option<f64>,
    /// 5th percentile over wearers or rounds; for a claim, the lower end of its confidence
    /// interval.
    pub low: Option<f64>,
    /// 95th percentile over wearers or rounds; for a claim, the upper end of its confidence
    /// interval.
    pub high: Option<f64>,
    /// Number of wearers, rounds or cases.
    pub n: u64,
}

impl NamedResult {
    /// Reads the result in `dir`; returns `None` if there is no `result.json`.
    ///
    /// # Errors
    /// Fails with E608 if the file has contents that this program does not write, or if it cannot
    /// be read.
    pub fn read(dir: &Path) -> Result<Option<Self>, LaboratoryError> {
        let Some(outcome) = read_outcome(dir)? else {
            return Ok(None);
        };
        let path = dir.join("declaration.toml");
        let declaration = match input::read_text(&path, input::LONGEST_TYPED) {
            Err(why) if why.kind() == ErrorKind::NotFound => String::new(),
            read => read.map_err(|why| LaboratoryError::File(path.display().to_string(), why))?,
        };
        Ok(Some(Self {
            name: dir.display().to_string(),
            outcome,
            declaration,
        }))
    }
}

/// Returns a row for every measure and claim that occurs in any of the results, in order of first
/// occurrence.
#[must_use]
pub fn result_rows(results: &[NamedResult]) -> Vec<ResultRow> {
    let mut rows: Vec<ResultRow> = Vec::new();
    let mut places: HashMap<String, usize> = HashMap::new();
    for (position, result) in results.iter().enumerate() {
        let claims = result.outcome.shares.iter().map(|share| {
            let id = format!("claim {} {}", share.id, share.at);
            let at = Some(&share.at).filter(|at| !at.is_empty());
            let at = at.map_or_else(String::new, |at| format!(" ({at})"));
            let value = ResultValue {
                value: (share.of > 0).then(|| share.holds as f64 / share.of as f64),
                low: share.low,
                high: share.high,
                n: share.of,
            };
            (id, format!("{}{at}", share.claim), "cases", value)
        });
        let numbers = result.outcome.rows.iter();
        let numbers = numbers.map(|row| {
            (
                row.id.clone(),
                row.quantity.clone(),
                &*row.unit,
                number(row),
            )
        });
        for (id, quantity, unit, value) in claims.chain(numbers) {
            let place = *places.entry(id.clone()).or_insert_with(|| {
                rows.push(ResultRow {
                    id,
                    quantity,
                    unit: unit.to_owned(),
                    values: vec![None; results.len()],
                });
                rows.len() - 1
            });
            rows[place].values[position] = Some(value);
        }
    }
    rows
}

fn number(row: &Row) -> ResultValue {
    ResultValue {
        value: row.ours,
        low: row.low,
        high: row.high,
        n: row.n as u64,
    }
}

/// Returns the differences between the declaration of the first result and that of each other
/// result.
#[must_use]
pub fn declaration_differences(results: &[NamedResult]) -> Vec<FileDifference> {
    let mut numbered = results.iter().enumerate();
    let Some((_, first)) = numbered.next() else {
        return Vec::new();
    };
    let others = numbered.filter_map(|(position, other)| {
        let file = ("declaration.toml", &*first.outcome.name);
        let texts = (
            (1, &*first.declaration),
            (position + 1, &*other.declaration),
        );
        FileDifference::between(file, texts.0, texts.1)
    });
    others.collect()
}

impl ResultRow {
    fn differs(&self) -> bool {
        self.values.iter().any(|value| *value != self.values[0])
    }

    /// Formats the value of each result as text.
    fn cells(&self) -> Vec<String> {
        let in_words = |value: &Option<ResultValue>| {
            let Some(ResultValue {
                value: Some(value),
                low,
                high,
                n,
            }) = value
            else {
                return "–".to_owned();
            };
            let (scale, mark) = match &*self.unit {
                "cases" => (100.0, " %".to_owned()),
                "" => (1.0, String::new()),
                unit => (1.0, format!(" {unit}")),
            };
            let short = |value: f64| match large_t(&self.quantity, value) {
                Some(words) => words.to_owned(),
                None => short(scale * value),
            };
            let range = low.zip(*high).filter(|(low, high)| low < high);
            let range = range.map(|(low, high)| format!("{} to {}, ", short(low), short(high)));
            format!(
                "{}{mark} ({}n = {n})",
                short(*value),
                range.unwrap_or_default()
            )
        };
        self.values.iter().map(in_words).collect()
    }
}

/// Formats a number with four significant digits.
fn short(value: f64) -> String {
    let decimals = match value.abs() {
        value if value < 9.9995 => 3,
        value if value < 99.995 => 2,
        value if value < 999.95 => 1,
        _ => 0,
    };
    format!("{value:.decimals$}")
}

/// Returns a table of the numbers that differ, for a terminal of 80 columns.
#[must_use]
pub fn results_text(results: &[NamedResult]) -> String {
    let mut text = "\nResults (median; 5th to 95th percentile)\n".to_owned();
    for (position, result) in results.iter().enumerate() {
        let (name, outcome) = (&result.name, &result.outcome);
        let drawn = format!("seed {}, {} draws", outcome.seed, outcome.declared.draws);
        text += &format!("{:>2}  {name}: {}, {drawn}\n", position + 1, outcome.name);
    }
    let rows = result_rows(results);
    let differing: Vec<&ResultRow> = rows.iter().filter(|row| row.differs()).collect();
    for row in differing.iter().take(MOST_ROWS) {
        text += &format!(
            "\n{}\n",
            host_core::plot::words::wrap_columns(&row.quantity, 80)
        );
        for (position, cell) in row.cells().iter().enumerate() {
            text += &format!("{:>4}  {cell}\n", position + 1);
        }
    }
    let (count, total) = (differing.len(), rows.len());
    let shown = match count > MOST_ROWS {
        true => format!("; the first {MOST_ROWS} are above, the page has all"),
        false => String::new(),
    };
    text += &format!("\n{count} of {total} numbers differ{shown}.\n");
    let differences = declaration_differences(results);
    let texts = differences
        .iter()
        .map(|file_difference| format!("\n{}", file_difference.text()));
    text += &texts.collect::<String>();
    text.trim_end().to_owned()
}

/// Returns the contents of the comparison page: every number, in bold where it differs from the
/// first result, and the differences between the declarations.
#[must_use]
pub fn results_body(results: &[NamedResult]) -> Html {
    let names = results.iter().map(|result| {
        let outcome = &result.outcome;
        let (seed, draws) = (outcome.seed, outcome.declared.draws);
        html!(
            "<li>{}, seed {}, {} draws, <code>{}</code></li>\n",
            outcome.title,
            seed,
            draws,
            result.name
        )
    });
    let rows = result_rows(results).into_iter().map(|row| {
        let cells = row.cells();
        let cells = cells.iter().map(|cell| match *cell == cells[0] {
            true => html!("<td>{}</td>", cell),
            false => html!("<td><b>{}</b></td>", cell),
        });
        let cells: Html = cells.collect();
        html!(
            "<tr><th scope=\"row\">{}</th>{}</tr>\n",
            row.quantity,
            cells
        )
    });
    let heads = (1..=results.len()).map(|number| html!("<th>{}</th>", number));
    let table = html!(
        "<table><thead><tr><th>Quantity</th>{}</tr></thead><tbody>\n{}</tbody></table>\n\
         <p class=\"note\">Each cell: median (5th to 95th percentile, number of values); for a \
         claim, the share of cases in which it holds, with its interval. Bold: differs from the \
         first result.</p>\n",
        heads.collect::<Html>(),
        rows.collect::<Html>()
    );
    let differences = declaration_differences(results);
    let files: Html = differences.iter().map(FileDifference::html).collect();
    let files = match files.is_empty() {
        true => files,
        false => html!("<section><h2>Declarations</h2>\n{}</section>\n", files),
    };
    html!(
        "<section><h2>Results</h2>\n<ol>\n{}</ol>\n{}</section>\n{}",
        names.collect::<Html>(),
        table,
        files
    )
}
