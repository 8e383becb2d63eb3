//! Muscle models compared: error of each method and rung against the reference.
//!
//! Lives here: `cases` (the trains and their true forces), `errors` (a setting
//! against them), `cost` (its cycles on the chip), `front` (both together), `range` (the
//! shipped model over all that the device takes), `study` (errors found before).
//! Not here: the methods (`methods::muscle`), pictures (`report`).
//! In: this checkout. Out: [`Chart`].

pub mod cases;
pub mod cost;
pub mod errors;
mod front;
pub mod range;
pub mod study;

pub use front::{Chart, Point, WANTED_PCT, all_errors, digits, measure};
