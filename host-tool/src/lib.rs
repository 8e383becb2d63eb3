//! The flexor library on the PC.

pub mod analysis;
pub mod record;
pub mod report;
