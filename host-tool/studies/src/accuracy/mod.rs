//! Compares muscle models: the error of each method and model level against the reference, and its
//! cost.
//!
//! Modules: `cases` (trains and their true forces), `errors` (errors of a setting), `cost` (cycles
//! on the chip), `front` (error and cost together), `range` (the shipped model over all inputs that
//! the device accepts), `range_of_all` (every method over these), `study` (errors published earlier). The result is a [`Chart`]. The methods
//! are in `methods::muscle`, the figures in `figures`.

pub mod cases;
pub mod cost;
pub mod errors;
mod front;
pub mod range;
pub mod range_of_all;
pub mod study;
pub mod table;

pub use front::{Chart, Point, WANTED_PCT, all_errors, digits, measure, settings};
