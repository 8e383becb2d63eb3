//! Fixed-point arithmetic for a core with a 32×32→64 multiplier and no 64-bit divider.
//!
//! This module contains `fixed_point` (number format of the controllers), `division` (quotients and
//! square roots), `exponential` (and logarithm), `polynomial` and `reciprocal` (one divisor, many numerators).
//! Inputs and results are words; each function states its rounding.

pub mod division;
pub mod exponential;
pub mod fixed_point;
pub(crate) mod polynomial;
pub(crate) mod reciprocal;
