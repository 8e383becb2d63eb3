//! Every method side by side: the muscle model's integrators and the control
//! laws that the device could have used, for charts and tests.
//!
//! Lives here: `muscle` (integrators), `control` (laws, differentiators,
//! predictors), `real` (the arithmetics they run in). Not here: anything the
//! product path calls; nothing outside this room and `bench` may use it.
//! In: what the product's own models and laws get. Out: what they answer.

pub mod control;
pub mod muscle;
pub mod real;
