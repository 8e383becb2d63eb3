//! The numbers that the search found, as a committed table.

use super::candidate::{Candidate, Equipment};
use super::search::Found;
use methods::control::{AddOns, DelayCompensation, DerivativeKind, Form};
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

const HEADER: [&str; 11] = [
    "law",
    "equipment",
    "evaluations",
    "training_rmse_deg",
    "period_ms",
    "extrapolation_ms",
    "derivative",
    "feed_forward",
    "delay",
    "adaptation",
    "numbers",
];

/// Names of the choices, as they stand in the table.
fn derivative_name(kind: DerivativeKind) -> String {
    format!("{kind:?}")
}

/// The table of what a search of so many evaluations found.
#[must_use]
pub fn write(rows: &[Row], evaluations: usize) -> String {
    let mut out = csv::Writer::from_writer(Vec::new());
    // Writing to memory cannot fail.
    let _ = out.write_record(HEADER);
    for (equipment, found) in rows {
        let c = &found.candidate;
        let numbers = c
            .values
            .iter()
            .map(|(name, value)| format!("{name}={value:.6e}"));
        let numbers: Vec<String> = numbers.collect();
        let _ = out.write_record([
            c.form.name().to_owned(),
            equipment.name().to_owned(),
            evaluations.to_string(),
            format!("{:.4}", found.cost),
            c.period_ms.to_string(),
            c.extrapolation_ms.to_string(),
            derivative_name(c.add_ons.derivative),
            c.add_ons.feed_forward.to_string(),
            format!("{:?}", c.add_ons.delay),
            c.add_ons.adaptation.to_string(),
            numbers.join(" "),
        ]);
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
    let mut rows = Vec::new();
    for record in reader.records() {
        let line = rows.len() as u64 + 2;
        let wrong = |what: String| GainsError { line, what };
        let record = record.map_err(|e| wrong(e.to_string()))?;
        rows.push(row(&record).map_err(|field| wrong(format!("`{field}` cannot be read")))?);
    }
    Ok(rows)
}

/// One line, or the name of the field that is wrong.
fn row(record: &csv::StringRecord) -> Result<Row, &'static str> {
    let field = |name: &'static str| {
        let place = HEADER.iter().position(|h| *h == name);
        place.and_then(|n| record.get(n)).ok_or(name)
    };
    fn number<T: std::str::FromStr>(text: &str, name: &'static str) -> Result<T, &'static str> {
        text.parse().map_err(|_| name)
    }
    let named = |name| {
        let text = field(name)?;
        Ok::<_, &'static str>(move |option: String| option == text)
    };
    let is_form = named("law")?;
    let is_equipment = named("equipment")?;
    let is_derivative = named("derivative")?;
    let is_delay = named("delay")?;
    let mut values = BTreeMap::new();
    for pair in field("numbers")?.split_whitespace() {
        let (name, value) = pair.split_once('=').ok_or("numbers")?;
        values.insert(name.to_owned(), number(value, "numbers")?);
    }
    let candidate = Candidate {
        form: (Form::ALL.into_iter())
            .find(|f| is_form(f.name().to_owned()))
            .ok_or("law")?,
        add_ons: AddOns {
            derivative: (DerivativeKind::ALL.into_iter())
                .find(|d| is_derivative(derivative_name(*d)))
                .ok_or("derivative")?,
            feed_forward: number(field("feed_forward")?, "feed_forward")?,
            delay: (DelayCompensation::ALL.into_iter())
                .find(|d| is_delay(format!("{d:?}")))
                .ok_or("delay")?,
            adaptation: number(field("adaptation")?, "adaptation")?,
        },
        period_ms: number(field("period_ms")?, "period_ms")?,
        extrapolation_ms: number(field("extrapolation_ms")?, "extrapolation_ms")?,
        values,
    };
    let equipment = (Equipment::ALL.into_iter())
        .find(|e| is_equipment(e.name().to_owned()))
        .ok_or("equipment")?;
    let cost = number(field("training_rmse_deg")?, "training_rmse_deg")?;
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
