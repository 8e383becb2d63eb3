//! The flexor library on the PC.

pub mod analysis;
pub mod cli;
pub mod link;
pub mod record;
pub mod report;
pub mod run;
pub mod selftest;
pub mod session;
