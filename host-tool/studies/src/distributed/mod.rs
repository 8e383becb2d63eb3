//! One muscle's pulses shared by several electrodes: how long a force is held, how smooth it
//! is, and what is left of it.
//!
//! Lives here: the declaration (`host-tool/experiments/distributed.toml`, committed before its
//! seed was run), persons drawn of it, each condition on the device with its pulses streamed
//! into the person's muscle, how that is judged, and what is told of it. Not here: the muscle
//! (`hal_sim::body::shared`), the command (`cli`).
//! In: a seed, draws. Out: an [`Outcome`](crate::laboratory::Outcome) and `draws.csv`. All
//! simulated: no evidence about people.

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
