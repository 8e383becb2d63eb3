//! What stands in for the board and the wearer.

pub mod body;
pub mod lockstep;
pub mod qemu;
pub mod trace;
pub mod wire;
