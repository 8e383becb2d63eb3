//! Defines the study's preregistered declaration, `lee.toml`.

use super::error::LeeError;
use host_core::identify::{Detector, Layout};
use serde::Deserialize;

/// Text of the built-in declaration.
pub const DECLARED: &str = include_str!("../../../experiments/lee.toml");

/// Content of the declaration `lee.toml`.
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
    /// Placement train and the fifteen trains of a session.
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
    /// Increment of the amplitude from one try to the next, mA.
    pub step_ma: f64,
    /// Amplitude at which a search without a threshold ends, mA.
    pub most_ma: f64,
    /// Pulse rate of the train of each try, Hz.
    pub frequency_hz: u32,
    /// Probability of a false alarm in a whole search.
    pub false_alarm: f64,
}

/// Placement pulse and trains (section 2.3.3, steps 2 and 4).
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Trains {
    /// Pulse width of all trains, µs.
    pub width_us: u32,
    /// Pulse rates in ascending order, Hz.
    pub frequencies_hz: [u32; 3],
    /// Number of amplitudes, evenly spaced from I_MT to `reach` times I_MT.
    pub amplitudes: usize,
    /// Ratio of the largest amplitude to I_MT.
    pub reach: f64,
    /// Pause from the end of a train to the start of the next, s.
    pub break_s: f64,
    /// Pulse rate of the placement train, Hz.
    pub placement_hz: u32,
    /// Amplitude of the placement train, mA.
    pub placement_ma: f64,
}

/// Simulated wrists whose structure differs from the model.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Foreign {
    /// Sizes of each model mismatch; docs/evidence/identify.md defines size 1.
    pub sizes: Vec<f64>,
    /// Number of replications of each subject with each mismatch and size.
    pub draws: u64,
}

/// Limits that decide the claims.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Claims {
    /// R² of the exponential that the mean over subjects must exceed at each frequency.
    pub r2: f64,
    /// Relative change of T_RT from I1 to I5 below which T_RT counts as independent of amplitude.
    pub flat: f64,
    /// NRMSE at I5 below which the mean over subjects must lie, %.
    pub nrmse_i5_percent: f64,
    /// Largest allowed mean over subjects of the NRMSE at I1 to I4, %.
    pub nrmse_percent: f64,
    /// Range in which the coverage of the 95 % intervals, pooled over subjects, must lie, as
    /// fractions.
    pub coverage: [f64; 2],
    /// Smallest allowed coverage of the intervals of one constant in one subject, as a fraction.
    pub least: f64,
    /// Largest allowed ratio of the variance of an estimate to its Cramér-Rao bound, as the
    /// geometric mean over subjects.
    pub over_bound: f64,
    /// Largest allowed share of searches that find a threshold where no fibre responds.
    pub false_threshold: f64,
    /// Smallest allowed share of searches that end within one step of the true threshold.
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
    /// Returns the detector of the threshold search. Each try takes two seconds: a train of one
    /// second, and one second of rest around it.
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
