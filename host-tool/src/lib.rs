//! The flexor library on the PC.

pub mod link;
