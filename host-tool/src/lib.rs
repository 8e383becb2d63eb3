//! The flexor library on the PC: everything that `flexor` does.
//!
//! `session` reads what to do, `run` does it through `link`, `record` and
//! `analysis` keep and judge it, `report` draws it; `selftest` measures the
//! device itself, `bench` its algorithms and cycles; `accuracy`, `ladder` and
//! `tracking` compare muscle models, their rungs and control laws, `stability`
//! maps where methods fail; `experiments` are the papers' protocols; `cli` is the
//! command line.

pub mod accuracy;
pub mod analysis;
pub mod bench;
pub mod cli;
pub mod experiments;
pub mod ladder;
pub mod link;
pub mod live;
pub mod record;
pub mod report;
pub mod run;
pub mod selftest;
pub mod session;
pub mod stability;
pub mod tracking;
