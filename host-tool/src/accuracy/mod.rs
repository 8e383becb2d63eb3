//! Muscle models compared: error of each method and rung against the reference.

pub mod cases;
pub mod cost;
pub mod errors;
