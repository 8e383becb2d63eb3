//! Weights of the first phase, by which the second one selects its forearms.

use crate::hamana2022::TwoPointsError;
use crate::hamana2022::participant::Participant;
use hal_sim::random::{unit, word};
use serde::Deserialize;

/// Text of `host-tool/experiments/hamana-screened.csv`, which `flexor experiment hamana-forearms`
/// writes: all forearms with weight in the first phase.
pub const SHIPPED: &str = include_str!("../../../../experiments/hamana-screened.csv");

/// Random stream by which forearms are selected.
const SELECTED: u64 = 0x7135;
/// Number of bisections of the weight from which on every forearm is selected.
const BISECTIONS: u32 = 60;

/// Row of the file.
#[derive(Clone, Debug, Deserialize)]
struct Row {
    participant: String,
    seed: u64,
    /// Number of forearms of the participant in the first phase.
    of: u64,
    forearm: u64,
    weight: f64,
}

/// Forearms with weight in the first phase.
pub struct Screened {
    rows: Vec<Row>,
}

/// Forearm of the second phase.
#[derive(Clone, Debug, PartialEq)]
pub struct SelectedForearm {
    /// Name of the participant.
    pub participant: String,
    /// Number of the forearm in the first phase.
    pub index: u64,
    /// Chance by which it was selected, above 0 and at most 1.
    pub chance: f64,
}

impl Screened {
    /// Parses the file that is part of the program.
    ///
    /// # Errors
    /// Returns E621 if it cannot be parsed.
    pub fn load_embedded() -> Result<Self, TwoPointsError> {
        let mut reader = csv::Reader::from_reader(SHIPPED.as_bytes());
        let rows: Result<Vec<Row>, csv::Error> = reader.deserialize().collect();
        let rows = rows.map_err(|error| {
            TwoPointsError::Declaration(format!("hamana-screened.csv: {error}"))
        })?;
        Ok(Self { rows })
    }

    /// Selects forearms of each participant, `expected` of them on average, each with a chance in
    /// proportion to its weight in the first phase.
    ///
    /// # Errors
    /// Returns E621 if a participant has no forearm with weight at this seed and number of draws.
    pub fn selected(
        &self,
        participants: &[Participant],
        (seed, draws): (u64, u64),
        expected: f64,
    ) -> Result<Vec<SelectedForearm>, TwoPointsError> {
        let mut selected = Vec::new();
        for Participant { name, .. } in participants {
            let own = self.rows.iter();
            let own =
                own.filter(|row| row.participant == *name && (row.seed, row.of) == (seed, draws));
            let own: Vec<&Row> = own.collect();
            if own.is_empty() {
                return Err(TwoPointsError::Declaration(format!(
                    "no forearm of {name} has weight in the first phase at seed {seed} with \
                     {draws} forearms; run hamana-forearms so, and enter its screened.csv in \
                     host-tool/experiments/hamana-screened.csv"
                )));
            }
            let from = weight_of_certainty(&own, expected);
            let stream = name
                .bytes()
                .fold(seed ^ SELECTED, |seed, byte| word(seed, byte.into()));
            for row in own {
                let chance = (row.weight / from).min(1.0);
                if unit(stream, row.forearm) < chance {
                    selected.push(SelectedForearm {
                        participant: name.clone(),
                        index: row.forearm,
                        chance,
                    });
                }
            }
        }
        Ok(selected)
    }
}

/// Returns the weight from which on every forearm is selected, so that `expected` are selected on
/// average.
fn weight_of_certainty(rows: &[&Row], expected: f64) -> f64 {
    let count = |from: f64| {
        rows.iter()
            .map(|row| (row.weight / from).min(1.0))
            .sum::<f64>()
    };
    let most = rows
        .iter()
        .map(|row| row.weight)
        .fold(f64::MIN_POSITIVE, f64::max);
    let (mut low, mut high) = (f64::MIN_POSITIVE, most * rows.len() as f64);
    for _ in 0..BISECTIONS {
        let middle = (low * high).sqrt();
        match count(middle) > expected {
            true => low = middle,
            false => high = middle,
        }
    }
    low
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn as_many_are_selected_as_expected() {
        let rows: Vec<Row> = (0..1_000_u64)
            .map(|forearm| Row {
                participant: "P".to_owned(),
                seed: 1,
                of: 1_000,
                forearm,
                weight: 1e-9 * (forearm % 10) as f64,
            })
            .collect();
        let rows: Vec<&Row> = rows.iter().collect();
        let from = weight_of_certainty(&rows, 200.0);
        let chances = rows.iter().map(|row| (row.weight / from).min(1.0));
        assert!((chances.sum::<f64>() - 200.0).abs() < 1e-6, "{from}");
    }
}
