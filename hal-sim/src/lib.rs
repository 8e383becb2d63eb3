//! What stands in for the board and the wearer.

pub mod body;
pub mod trace;
pub mod wire;
