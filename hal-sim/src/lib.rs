//! What stands in for the board and the wearer.
//!
//! `world` couples a device with a body in virtual time; `native` runs the
//! device code in this process, `qemu` its Thumb build; `lockstep` is what
//! they have in common. `body` and `trace` know nothing of the
//! firmware, so that they cannot agree with its mistakes.

pub mod body;
pub mod chip;
pub mod lockstep;
pub mod native;
pub mod qemu;
pub mod trace;
pub mod wire;
pub mod world;
