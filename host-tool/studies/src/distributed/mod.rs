//! Study of one muscle that several electrodes share: how long a force is held, how smooth it is,
//! and how much of it remains.
//!
//! Takes a seed and a number of draws; returns an [`Outcome`](crate::laboratory::Outcome) and
//! `draws.csv`. The declaration (`host-tool/experiments/distributed.toml`) was committed before its
//! seed was run. Each condition runs on the native simulator, whose pulses are streamed into the
//! random wearer's muscle (`hal_sim::body::shared`). Everything is simulated: this is no evidence
//! about people.

mod claims;
mod csv;
mod declared;
mod error;
mod figures;
mod held;
mod outcome;
mod person;
mod play;
mod rows;
mod run;
mod session;
mod study;
mod tables;

pub use claims::{PUBLISHED_S, exceeds, holds};
pub use declared::{
    Axes, Condition, DECLARED, DistributedDeclaration, Drive, Hold, MuscleOf, Open, Phase,
};
pub use error::DistributedError;
pub use held::{Endurance, Series, Window};
pub use outcome::RunInfo;
pub use person::DistributedWearer;
pub use play::play;
pub use run::Part;
pub use study::{AxisPoint, ConditionResult, DrawResult, NAME, Study};
