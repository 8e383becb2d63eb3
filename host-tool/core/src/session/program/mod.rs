//! `[[program]]`: amplitudes and widths over time, for channels that nothing else drives.
//!
//! This module reads and checks the tables, and computes the course of each channel and the order
//! for each of its bursts. `run` decides when the orders are sent.
//!
//! Input: the tables of a file, and the setup for which they are meant. Output: [`Programs`].

mod course;
mod fields;
mod gaps;
mod passes;
mod played;
mod read;
mod rise;
mod steps;
mod told;

pub(super) use fields::program;
pub use played::Programs;
pub(super) use read::read_programs;
pub(super) use told::check_setpoints;
