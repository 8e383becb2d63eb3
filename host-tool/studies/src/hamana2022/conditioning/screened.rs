//! Weights of the first phase at the declared seed, so that the second phase need not repeat it.

use crate::hamana2022::TwoPointsError;
use serde::Deserialize;
use std::collections::{BTreeMap, BTreeSet};

/// Text of `host-tool/experiments/hamana-screened.csv`, which `flexor experiment hamana-forearms`
/// writes: all forearms with weight in the first phase.
pub const SHIPPED: &str = include_str!("../../../../experiments/hamana-screened.csv");

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

/// Known weights of the first phase; by default none.
#[derive(Default)]
pub struct Screened {
    weights: BTreeMap<(String, u64), f64>,
    /// Participants of whom all weights are known.
    known: BTreeSet<String>,
}

impl Screened {
    /// Parses the file that is part of the program, and keeps the weights at this seed with this
    /// number of forearms.
    ///
    /// # Errors
    /// Returns E621 if it cannot be parsed.
    pub fn load_embedded(seed: u64, draws: u64) -> Result<Self, TwoPointsError> {
        let mut reader = csv::Reader::from_reader(SHIPPED.as_bytes());
        let mut screened = Self::default();
        for row in reader.deserialize() {
            let row: Row = row.map_err(|error| {
                TwoPointsError::Declaration(format!("hamana-screened.csv: {error}"))
            })?;
            if (row.seed, row.of) == (seed, draws) {
                screened.known.insert(row.participant.clone());
                screened
                    .weights
                    .insert((row.participant, row.forearm), row.weight);
            }
        }
        Ok(screened)
    }

    /// Returns the weight of a forearm in the first phase; `None` if it is not known.
    #[must_use]
    pub fn weight(&self, participant: &str, index: u64) -> Option<f64> {
        let weight = self.weights.get(&(participant.to_owned(), index));
        let is_known = self.known.contains(participant);
        is_known.then(|| weight.copied().unwrap_or_default())
    }
}
