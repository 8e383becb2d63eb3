//! What a program that stimulates needs, `flexor` or another.
//!
//! `session` reads what to do, `run` does it through `link`, `choice` tries which
//! models will do; `record` and `analysis` keep and judge it, `report` draws it
//! with `plot`, numbers written by `number`. `wearer` is who is stimulated: thresholds,
//! limits and muscles, from a file, which `calibration` finds with an operator; `fields`
//! holds such files and sessions against what they may say, `disk` replaces files as a
//! whole. `statistics` is what analyses of experiments share, `identify` makes a muscle's
//! numbers of measured force, `limb` finds muscles for a force at the hand, `clock` has the time,
//! `suggestion` finds the name that a misspelt one was meant to be.
//!
//! Without its features (docs/architecture.md, Features) the package reads no clock, opens no
//! socket and starts no process, and builds for `wasm32-unknown-unknown`.

pub mod analysis;
pub mod calibration;
pub mod choice;
pub mod clock;
pub mod disk;
pub mod fields;
pub mod identify;
pub mod limb;
pub mod link;
mod number;
#[cfg(feature = "report")]
pub mod plot;
pub mod record;
#[cfg(feature = "report")]
pub mod report;
pub mod run;
pub mod session;
pub mod statistics;
pub mod suggestion;
pub mod wearer;
