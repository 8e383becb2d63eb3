//! What `flexor chart ladder` measured, as tables.
//!
//! Lives here: `prediction` (errors of a rung by itself, and what else a scene
//! needs), `replaced` and `tiring` (changes in closed loop). Not here: what the
//! axes are (`grid`), how a scene finds its place.
//! In: nothing. Out: constants.

mod prediction;
mod replaced;
mod tiring;

pub use prediction::{BODY, CYCLES, DYNAMICS, FATIGUE, LAW, TELEMETRY};
pub use replaced::CHANGE;
pub use tiring::TIRING;
