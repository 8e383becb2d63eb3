//! Every method side by side: the muscle model's integrators and the control
//! laws that the device could have used, for charts and tests, on host and chip.
//!
//! Lives here: `muscle` (integrators), `control` (laws, differentiators,
//! predictors), `real` (the arithmetics they run in), `bench` (their cycles).
//! Not here: what is flashed (`firmware`), what is compared (`studies`).
//! In: what the product's own models and laws get. Out: what they answer.
#![no_std]
#![deny(unsafe_code)]

pub mod bench;
pub mod control;
pub mod muscle;
pub mod real;

#[cfg(test)]
extern crate std;
