//! The library of programs that drive a Flexor stimulator: sessions, the link, records and reports.
//!
//! - `session` reads session files, `wearer` the thresholds, limits and muscles of a wearer, and
//!   `fields` checks both against their permitted fields.
//! - `link` speaks the protocol, and `run` carries out a session through it. `choice` tries which
//!   level of a muscle model suffices. `calibration` finds thresholds with an operator, `search`
//!   by a staircase. `drive` drives a device call by call, for programs that decide while it runs.
//! - `record` writes and reads records, `analysis` computes their results, `statistics` compares
//!   them, and `report` draws them with `plot`.
//! - `models` evaluates the device's muscle models and controllers apart from a device.
//! - `identify` fits a muscle model to measured force; `limb` chooses muscles for a force at the
//!   hand.
//! - `clock` reads the time, `disk` replaces files as a whole, `number` formats numbers, and
//!   `suggestion` finds the name that a misspelt one was meant to be.
//!
//! Without its features (docs/how/architecture.md, Features) the package reads no clock, opens no
//! socket and starts no process, and builds for `wasm32-unknown-unknown`.

#![warn(missing_docs)]

pub mod analysis;
pub mod calibration;
pub mod choice;
pub mod clock;
pub mod disk;
pub mod drive;
pub mod fields;
pub mod identify;
pub mod limb;
pub mod link;
pub mod models;
mod number;
#[cfg(feature = "report")]
pub mod plot;
pub mod record;
#[cfg(feature = "report")]
pub mod report;
pub mod run;
pub mod search;
pub mod session;
pub mod statistics;
pub mod suggestion;
pub mod wearer;
