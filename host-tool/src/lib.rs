//! The `flexor` program.
//!
//! `cli` is the command line, `live` its dashboard, `selftest` measures the device itself, and
//! `protocol` describes the link to other programs.
//! Sessions, runs and records are in `host-core`, comparisons in `studies`.

pub mod cli;
pub mod live;
pub mod protocol;
pub mod selftest;
