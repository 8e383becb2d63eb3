//! Defines the study's preregistered declaration, `lee.toml`.

use super::error::LeeError;
use host_core::identify::{Detector, Layout};
use serde::Deserialize;

/// Text of the built-in declaration.
pub const DECLARED: &str = include_str!("../../../experiments/lee.toml");

/// The preregistered study.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Declaration {
    /// Heading of the page.
    pub title: String,
    /// The paper that the study replicates.
    pub source: String,
    /// Seed of all draws.
    pub seed: u64,
    /// Number of replications of each subject.
    pub draws: u64,
    /// Search for the motor threshold I_MT.
    pub search: Search,
    /// The fifteen trains.
    pub trains: Trains,
    /// Simulated wrists whose structure differs from the model.
    pub foreign: Foreign,
    /// Limits that decide the claims.
    pub claims: Claims,
}

/// Threshold search (section 2.3.3, step 3).
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Search {
    /// Increment of the amplitude, mA.
    pub step_ma: f64,
    /// Largest amplitude, mA.
    pub most_ma: f64,
    /// Pulse rate of the trains.
    pub frequency_hz: u32,
    /// Probability of a false alarm in a whole search.
    pub false_alarm: f64,
}

/// Placement pulse and trains (section 2.3.3, steps 2 and 4).
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Trains {
    /// Pulse width.
    pub width_us: u32,
    /// Pulse rates in ascending order, Hz.
    pub frequencies_hz: [u32; 3],
    /// Number of amplitudes, evenly spaced from I_MT to `reach` times I_MT.
    pub amplitudes: usize,
    /// Ratio of the largest amplitude to I_MT.
    pub reach: f64,
    /// Pause between trains, s.
    pub break_s: f64,
    /// Pulse rate of the placement train.
    pub placement_hz: u32,
    /// Amplitude of the placement train, mA.
    pub placement_ma: f64,
}

/// Simulated wrists whose structure differs from the model.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Foreign {
    /// Sizes of each model mismatch; docs/identify.md defines size 1.
    pub sizes: Vec<f64>,
    /// Number of replications of each subject.
    pub draws: u64,
}

/// Limits that decide the claims.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Claims {
    /// Smallest mean R² of the exponential.
    pub r2: f64,
    /// Largest relative change of T_RT.
    pub flat: f64,
    /// Largest mean NRMSE at I5.
    pub nrmse_i5_percent: f64,
    /// Largest mean NRMSE at I1 to I4.
    pub nrmse_percent: f64,
    /// Range of the pooled coverage of the intervals.
    pub coverage: [f64; 2],
    /// Smallest coverage of the intervals in any cell.
    pub least: f64,
    /// Largest ratio of a variance to its bound.
    pub over_bound: f64,
    /// Largest share of searches with a false threshold.
    pub false_threshold: f64,
    /// Smallest share of searches within one step of the true threshold.
    pub within_step: f64,
}

impl Declaration {
    /// Parses the built-in declaration.
    ///
    /// # Errors
    /// Fails with E646 if the text cannot be parsed.
    pub fn load_embedded() -> Result<Self, LeeError> {
        toml::from_str(DECLARED).map_err(|e| LeeError::Declaration(e.to_string()))
    }
}

impl Search {
    /// Returns the detector, whose tries take two seconds: a train of one second, and one second of
    /// rest around it.
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
