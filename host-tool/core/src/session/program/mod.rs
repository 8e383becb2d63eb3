//! `[[program]]`: amplitudes and widths over time of channels that nothing else drives.
//!
//! Lives here: the course of each channel, the order that each of its bursts gets, reading
//! and checking the tables. Not here: who sends the orders and when (`run`).
//! In: tables of a file, the setup that they are played on. Out: [`Programs`].

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
pub(super) use told::tell_beside;
