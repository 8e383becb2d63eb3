//! All methods side by side: the integrators of the muscle model and the control laws that the
//! device could have used, for charts and tests, on host and chip.
//!
//! Submodules: `muscle` (integrators), `control` (laws, differentiators, predictors), `real` (the
//! arithmetics in which they run), `bench` (benchmarks of their cycles). The flashed code is in
//! `firmware`, the comparisons are in `studies`. Input and output are those of the product's own
//! models and laws.
#![no_std]
#![deny(unsafe_code)]

pub mod bench;
pub mod control;
pub mod muscle;
pub mod real;

#[cfg(test)]
extern crate std;
