//! The numbers that the search found, as a committed table.

use super::candidate::{Candidate, Equipment};
use super::search::Found;
use methods::control::{AddOns, DelayCompensation, DerivativeKind, Form};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// The committed table, docs/charts/control_gains.csv.
pub const COMMITTED: &str = include_str!("../../../../docs/charts/control_gains.csv");

/// One line of the table: a law, and how good it was on the training plants.
pub type Row = (Equipment, Found);

/// The table cannot be read.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
#[error(
    "E563 control_gains.csv, line {line}: {what}; `flexor chart control --search` writes it anew"
)]
pub struct GainsError {
    /// Line, 1-based.
    pub line: u64,
    /// What is wrong.
    pub what: String,
}

/// A line as it stands in the table.
#[derive(Serialize, Deserialize)]
struct Line {
    law: String,
    equipment: String,
    evaluations: usize,
    training_rmse_deg: String,
    period_ms: u32,
    extrapolation_ms: u16,
    derivative: String,
    feed_forward: bool,
    delay: String,
    adaptation: bool,
    numbers: String,
}

/// The table of what a search of so many evaluations found.
pub fn write(rows: &[Row], evaluations: usize) -> String {
    let mut out = csv::Writer::from_writer(Vec::new());
    for (equipment, found) in rows {
        let c = &found.candidate;
        let numbers = c.values.iter().map(|(name, x)| format!("{name}={x:.6e}"));
        // Writing to memory cannot fail.
        let _ = out.serialize(Line {
            law: c.form.name().to_owned(),
            equipment: equipment.name().to_owned(),
            evaluations,
            training_rmse_deg: format!("{:.4}", found.cost),
            period_ms: c.period_ms,
            extrapolation_ms: c.extrapolation_ms,
            derivative: format!("{:?}", c.add_ons.derivative),
            feed_forward: c.add_ons.feed_forward,
            delay: format!("{:?}", c.add_ons.delay),
            adaptation: c.add_ons.adaptation,
            numbers: numbers.collect::<Vec<_>>().join(" "),
        });
    }
    let bytes = out.into_inner().unwrap_or_default();
    String::from_utf8(bytes).unwrap_or_default()
}

/// Reads a table.
///
/// # Errors
/// [`GainsError`] names the line and the field.
pub fn read(table: &str) -> Result<Vec<Row>, GainsError> {
    let mut reader = csv::Reader::from_reader(table.as_bytes());
    let lines = (2..).zip(reader.deserialize());
    let read = |(line, read): (u64, csv::Result<Line>)| {
        let wrong = |what: String| GainsError { line, what };
        let read = read.map_err(|e| wrong(e.to_string()))?;
        row(&read).map_err(|field| wrong(format!("`{field}` cannot be read")))
    };
    lines.map(read).collect()
}

/// One of some options by how it is written; or the name of the field that is wrong.
fn named<T: Copy>(
    all: &[T],
    written: impl Fn(T) -> String,
    text: &str,
    field: &'static str,
) -> Result<T, &'static str> {
    all.iter()
        .copied()
        .find(|it| written(*it) == text)
        .ok_or(field)
}

/// One line, or the name of the field that is wrong.
fn row(line: &Line) -> Result<Row, &'static str> {
    let number = |text: &str, field| text.parse::<f64>().map_err(|_| field);
    let mut values = BTreeMap::new();
    for pair in line.numbers.split_whitespace() {
        let (name, value) = pair.split_once('=').ok_or("numbers")?;
        values.insert(name.to_owned(), number(value, "numbers")?);
    }
    let delays = DelayCompensation::ALL;
    let candidate = Candidate {
        form: named(&Form::ALL, |f| f.name().to_owned(), &line.law, "law")?,
        add_ons: AddOns {
            derivative: named(
                &DerivativeKind::ALL,
                |d| format!("{d:?}"),
                &line.derivative,
                "derivative",
            )?,
            feed_forward: line.feed_forward,
            delay: named(&delays, |d| format!("{d:?}"), &line.delay, "delay")?,
            adaptation: line.adaptation,
        },
        period_ms: line.period_ms,
        extrapolation_ms: line.extrapolation_ms,
        values,
    };
    let equipment = named(
        &Equipment::ALL,
        |e| e.name().to_owned(),
        &line.equipment,
        "equipment",
    )?;
    let cost = number(&line.training_rmse_deg, "training_rmse_deg")?;
    Ok((equipment, Found { candidate, cost }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_committed_table_has_every_law_and_is_what_is_written() {
        let rows = read(COMMITTED).expect("the committed table reads");
        assert_eq!(rows.len(), Form::ALL.len() * Equipment::ALL.len());
        let evaluations = COMMITTED.lines().nth(1).and_then(|l| l.split(',').nth(2));
        let evaluations = evaluations.and_then(|e| e.parse().ok()).expect("a number");
        assert_eq!(write(&rows, evaluations), COMMITTED);
    }

    #[test]
    fn a_spoilt_table_is_refused_by_line_and_field() {
        let spoilt = COMMITTED.replacen("pid,alone", "pdi,alone", 1);
        let error = read(&spoilt).expect_err("no such law").to_string();
        assert!(error.contains("E563") && error.contains("`law`"), "{error}");
    }
}
