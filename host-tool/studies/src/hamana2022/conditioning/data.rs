//! The printed voltages that a forearm must meet, with the tolerance of the search.

use super::declaration::Declaration;
use crate::hamana2022::participant::{DEVICE_V, Participant};
use crate::hamana2022::printed::{TABLE_2, TABLE_3, printed_values};
use crate::hamana2022::voltages::{MOST_V, STEP_V};
use serde::{Deserialize, Serialize};

/// Tables of the paper that print greatest selective voltages. Each comes from a session of its own.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub enum Table {
    /// Table 2: experiment 1.
    Two,
    /// Table 3: experiment 2.
    Three,
    /// Table 7: experiments 3 and 4, posture and hold.
    Seven,
}

impl Table {
    /// The tables without thresholds.
    pub const UNSOLVED: [Self; 2] = [Self::Two, Self::Three];

    /// Returns the number that the paper gives the table.
    #[must_use]
    pub const fn number(self) -> u64 {
        match self {
            Self::Two => 2,
            Self::Three => 3,
            Self::Seven => 7,
        }
    }

    /// Returns the voltage at which the searches of the session end, V.
    #[must_use]
    pub const fn end_v(self) -> f64 {
        match self {
            Self::Two | Self::Three => MOST_V,
            Self::Seven => DEVICE_V,
        }
    }
}

/// Voltages that the paper prints for a participant, V.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PrintedVoltages {
    /// Greatest selective voltages of A and B in tables 2 and 3; `None` for a person of a wearer
    /// file.
    pub unsolved_v: [Option<[f64; 2]>; 2],
    /// Thresholds of A, B and the extensor's point, and greatest voltages of A and B, in table 7;
    /// `None` for R.
    pub solved_v: Option<([f64; 3], [f64; 2])>,
}

impl PrintedVoltages {
    /// Returns the voltages of a participant.
    #[must_use]
    pub fn of(participant: &Participant) -> Self {
        let name = &participant.name;
        let most = participant.paper.as_ref().map(|paper| {
            let [a, b, _] = paper.most_v;
            [a, b]
        });
        Self {
            unsolved_v: [
                printed_values(&TABLE_2, name),
                printed_values(&TABLE_3, name),
            ],
            solved_v: participant.thresholds_v.zip(most),
        }
    }

    /// Describes every pair of printed voltages that no forearm can have.
    #[must_use]
    pub fn conflicts(&self, name: &str, declaration: &Declaration) -> Vec<String> {
        let noise_v = f64::from(declaration.noise_steps) * STEP_V;
        let mut conflicts = Vec::new();
        if let Some((threshold_v, most_v)) = self.solved_v {
            for (point, (threshold, most)) in threshold_v.into_iter().zip(most_v).enumerate() {
                let letter = ["A", "B"][point];
                if most + noise_v < threshold - noise_v {
                    conflicts.push(format!(
                        "{name}, table 7: the greatest voltage of {letter}, {most} V, lies below \
                         its threshold, {threshold} V, by more than the noise of the search"
                    ));
                }
            }
        }
        let tables = Table::UNSOLVED.into_iter().zip(self.unsolved_v);
        let tables = tables.filter_map(|(table, most_v)| Some((table, most_v?)));
        let solved = self.solved_v.map(|(_, most_v)| (Table::Seven, most_v));
        for (table, most_v) in tables.chain(solved) {
            for (letter, most) in ["A", "B"].into_iter().zip(most_v) {
                let (number, end) = (table.number(), table.end_v());
                if most - noise_v > end {
                    conflicts.push(format!(
                        "{name}, table {number}: the greatest voltage of {letter}, {most} V, lies \
                         beyond the end of the search, {end} V"
                    ));
                }
            }
        }
        conflicts
    }
}
