//! Compares control laws on random wearers.
//!
//! Modules: a campaign's plants (`plant`), the nominal wearer that laws know (`wearer`), references
//! and their reachable part (`target`, `reach`), exercises and how attempts are judged
//! (`exercise`), the controllers (`driver`), one trial (`trial`), the best possible result
//! (`optimum`). Takes laws with their parameters and seeds; returns angles, errors and rankings.
//! The laws are in `firmware::control` and `methods::control`, the simulated fingers in
//! `hal_sim::body`, figures in `figures`, the command in `cli::chart`.

pub mod ablation;
pub mod ablation_table;
pub mod campaign;
pub mod candidate;
pub(crate) mod columns;
pub mod contender;
pub mod cost;
pub mod default;
pub mod driver;
pub mod exercise;
pub mod gains;
pub mod optimum;
pub mod plant;
pub mod reach;
pub mod search;
pub mod statistics;
pub mod table;
pub mod target;
pub mod trial;
pub mod wearer;
pub mod widened;

use firmware::control::SpecError;
use firmware::range::OutOfRange;
use hal_sim::body::InvalidSpec;
use methods::control::ParameterError;

/// Reason why a trial cannot be run.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
pub enum TrackingError {
    /// The plant's finger is invalid.
    #[error("E560 a simulated finger is impossible: {0}")]
    Plant(InvalidSpec),
    /// The device refuses the specification of the joint.
    #[error("E561 the device refuses the joint: {}", describe_joint_mistake(.0))]
    Joint(SpecError),
    /// A parameter is missing or invalid for the control law.
    #[error("E562 these values do not define the control law: {}", describe_law_mistake(.0))]
    Law(ParameterError),
}

/// Returns the reason why the device refuses a joint, in words.
fn describe_joint_mistake(error: &SpecError) -> String {
    match error {
        SpecError::Range(field) => field.to_string(),
        SpecError::ChannelTwice { channel } => {
            format!("two of its stimulation points use channel {}", channel + 1)
        }
    }
}

/// Returns the reason why values do not form a control law, in words.
fn describe_law_mistake(error: &ParameterError) -> String {
    match error {
        ParameterError::Count { wanted } => format!("give {wanted} values, one per parameter"),
        ParameterError::Value { name } => format!(
            "`{name}` must be a finite number of at least 0, and above 0 if its search range is \
             logarithmic"
        ),
    }
}

impl From<InvalidSpec> for TrackingError {
    fn from(error: InvalidSpec) -> Self {
        Self::Plant(error)
    }
}

impl From<SpecError> for TrackingError {
    fn from(error: SpecError) -> Self {
        Self::Joint(error)
    }
}

impl From<OutOfRange> for TrackingError {
    fn from(error: OutOfRange) -> Self {
        Self::Joint(error.into())
    }
}

impl From<ParameterError> for TrackingError {
    fn from(error: ParameterError) -> Self {
        Self::Law(error)
    }
}
