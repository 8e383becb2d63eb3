//! `lee.toml`: what was decided before looking.

use super::error::LeeError;
use host_core::identify::{Detector, Layout};
use serde::Deserialize;

/// The program's own.
pub const DECLARED: &str = include_str!("../../../experiments/lee.toml");

/// What is done and judged.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Declaration {
    /// Heading.
    pub title: String,
    /// The paper.
    pub source: String,
    /// Of all draws.
    pub seed: u64,
    /// Replications of each subject.
    pub draws: u64,
    /// For I_MT.
    pub search: Search,
    /// Fifteen of them.
    pub trains: Trains,
    /// Bodies of another structure.
    pub foreign: Foreign,
    /// What decides.
    pub claims: Claims,
}

/// Section 2.3.3, step 3.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Search {
    /// Step, mA.
    pub step_ma: f64,
    /// Largest amplitude, mA.
    pub most_ma: f64,
    /// Of its trains, Hz.
    pub frequency_hz: u32,
    /// Probability of any, of a whole search.
    pub false_alarm: f64,
}

/// Section 2.3.3, steps 2 and 4.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Trains {
    /// Of every pulse, µs.
    pub width_us: u32,
    /// In ascending order, Hz.
    pub frequencies_hz: [u32; 3],
    /// Evenly from I_MT to `reach` times I_MT.
    pub amplitudes: usize,
    /// Greatest over I_MT.
    pub reach: f64,
    /// Between trains, s.
    pub break_s: f64,
    /// Of the placement pulse's train, Hz.
    pub placement_hz: u32,
    /// And its amplitude, mA.
    pub placement_ma: f64,
}

/// Bodies of another structure.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Foreign {
    /// How large each departure is.
    pub sizes: Vec<f64>,
    /// Replications of each subject.
    pub draws: u64,
}

/// What decides a claim.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Claims {
    /// Of the exponential.
    pub r2: f64,
    /// Part by which T_RT may change.
    pub flat: f64,
    /// At I5.
    pub nrmse_i5_percent: f64,
    /// At I1 to I4.
    pub nrmse_percent: f64,
    /// Of intervals, pooled.
    pub coverage: [f64; 2],
    /// Of intervals, in any cell.
    pub least: f64,
    /// Variance over its bound.
    pub over_bound: f64,
    /// Per search.
    pub false_threshold: f64,
    /// Of searches.
    pub within_step: f64,
}

impl Declaration {
    /// The program's own.
    ///
    /// # Errors
    /// E646: it cannot be read.
    pub fn load_embedded() -> Result<Self, LeeError> {
        toml::from_str(DECLARED).map_err(|e| LeeError::Declaration(e.to_string()))
    }
}

impl Search {
    /// Tries of two seconds: a second's train, a second's rest around it.
    #[must_use]
    pub fn detector(&self) -> Detector {
        Detector {
            step_ma: self.step_ma,
            most_ma: self.most_ma,
            false_alarm: self.false_alarm,
            layout: Layout {
                before: 300,
                rise: 300,
                train: 1_000,
                decay: 400,
                samples: 2_000,
            },
        }
    }
}
