//! The reference board around the chip.

pub mod front_end;
pub mod wiring;
