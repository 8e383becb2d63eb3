//! The flexor library on the PC.

pub mod cli;
pub mod link;
