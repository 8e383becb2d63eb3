//! The parameters that the search found, as a committed table.

use super::candidate::{Candidate, Equipment};
use super::default;
use super::search::SearchResult;
use super::wearer::{self, Points};
use firmware::control::HoldPolicy;
use methods::control::{AddOns, DelayCompensation, DerivativeKind, Form};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Text of the committed table, docs/charts/control_gains.csv.
pub const COMMITTED: &str = include_str!("../../../../docs/charts/control_gains.csv");

/// A line of the table: a control law with its equipment, and its cost on the training plants.
pub type Row = (Equipment, SearchResult<Candidate>);
/// The line of the default controller: its parameters by name, and its cost on the training plants.
pub type Default = SearchResult<BTreeMap<String, f64>>;

/// The table of gains cannot be read.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
#[error(
    "E563 control_gains.csv, line {line}: {what}; write the table again with `flexor chart \
     control --search`"
)]
pub struct GainsError {
    /// Number of the line in the table, from 1.
    pub line: u64,
    /// Field that is wrong, or a description of the problem.
    pub what: String,
}

/// A line of the table with its fields as text.
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

/// Formats the results of a search as a table; `evaluations` is the number of evaluations per law.
pub fn write(rows: &[Row], default: Option<&Default>, evaluations: usize) -> String {
    let mut out = csv::Writer::from_writer(Vec::new());
    for (equipment, found) in rows {
        let c = &found.candidate;
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
            numbers: joined(&c.values),
        });
    }
    if let Some(found) = default {
        // The structure of the default controller comes from the firmware.
        let shipped = wearer::shipped(Points::Two);
        let _ = out.serialize(Line {
            law: default::NAME.to_owned(),
            equipment: Equipment::Equipped.name().to_owned(),
            evaluations,
            training_rmse_deg: format!("{:.4}", found.cost),
            period_ms: shipped.law_period_ms.into(),
            extrapolation_ms: match shipped.hold {
                HoldPolicy::Extrapolate { max_ms } => max_ms,
                HoldPolicy::Hold => 0,
            },
            derivative: format!("{:?}", DerivativeKind::PseudoOfError),
            feed_forward: true,
            delay: format!("{:?}", DelayCompensation::Smith),
            adaptation: true,
            numbers: joined(&found.candidate),
        });
    }
    let bytes = out.into_inner().unwrap_or_default();
    String::from_utf8(bytes).unwrap_or_default()
}

fn joined(numbers: &BTreeMap<String, f64>) -> String {
    let pairs = numbers.iter().map(|(name, x)| format!("{name}={x:.6e}"));
    pairs.collect::<Vec<_>>().join(" ")
}

/// Reads the line of the default controller; `None` if the table has none.
///
/// # Errors
/// Returns [`GainsError`] with the line and the field.
pub fn read_default(table: &str) -> Result<Option<Default>, GainsError> {
    let mut found = None;
    for line in lines(table) {
        let (at, line) = line?;
        if line.law == default::NAME {
            let parsed = numbers(&line.numbers)
                .and_then(|n| Ok((n, number(&line.training_rmse_deg, "training_rmse_deg")?)));
            let (candidate, cost) = parsed.map_err(|field| unreadable(at, field))?;
            found = Some(SearchResult { candidate, cost });
        }
    }
    Ok(found)
}

/// Reads the lines of all laws in floating point.
///
/// # Errors
/// Returns [`GainsError`] with the line and the field.
pub fn read(table: &str) -> Result<Vec<Row>, GainsError> {
    let mut rows = Vec::new();
    for line in lines(table) {
        let (at, line) = line?;
        if line.law != default::NAME {
            rows.push(row(&line).map_err(|field| unreadable(at, field))?);
        }
    }
    Ok(rows)
}

fn unreadable(line: u64, field: &str) -> GainsError {
    let message = format!("`{field}` cannot be read");
    GainsError {
        line,
        what: message,
    }
}

/// Returns the lines of a table, each with its number from 1.
fn lines(table: &str) -> impl Iterator<Item = Result<(u64, Line), GainsError>> {
    let reader = csv::Reader::from_reader(table.as_bytes());
    (2..).zip(reader.into_deserialize()).map(|(line, read)| {
        let wrong = |e: csv::Error| GainsError {
            line,
            what: e.to_string(),
        };
        Ok((line, read.map_err(wrong)?))
    })
}

fn number(text: &str, field: &'static str) -> Result<f64, &'static str> {
    text.parse().map_err(|_| field)
}

fn numbers(text: &str) -> Result<BTreeMap<String, f64>, &'static str> {
    let pair = |pair: &str| {
        let (name, value) = pair.split_once('=').ok_or("numbers")?;
        Ok((name.to_owned(), number(value, "numbers")?))
    };
    text.split_whitespace().map(pair).collect()
}

/// Returns the option that is written as `text`, or `field` as an error if there is none.
fn named<T: Copy>(
    options: &[T],
    written: impl Fn(T) -> String,
    text: &str,
    field: &'static str,
) -> Result<T, &'static str> {
    options
        .iter()
        .copied()
        .find(|candidate| written(*candidate) == text)
        .ok_or(field)
}

/// Parses the line of a law, or returns the name of the first invalid field.
fn row(line: &Line) -> Result<Row, &'static str> {
    let values = numbers(&line.numbers)?;
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
    Ok((equipment, SearchResult { candidate, cost }))
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
        let default = read_default(COMMITTED).expect("the committed table reads");
        assert_eq!(write(&rows, default.as_ref(), evaluations), COMMITTED);
    }

    /// The device must ship the parameters that the search found.
    #[test]
    fn the_device_ships_the_numbers_of_the_committed_table() {
        if let Some(found) = read_default(COMMITTED).expect("the committed table reads") {
            for points in Points::ALL {
                let joint = default::joint(&found.candidate, points);
                assert_eq!(joint, wearer::shipped(points));
            }
        }
    }

    #[test]
    fn a_spoilt_table_is_refused_by_line_and_field() {
        let spoilt = COMMITTED.replacen("pid,alone", "pdi,alone", 1);
        let error = read(&spoilt).expect_err("no such law").to_string();
        assert!(error.contains("E563") && error.contains("`law`"), "{error}");
    }
}
