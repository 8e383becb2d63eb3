//! Checks captures of a logic analyser against the edges that a simulation predicts.
//!
//! [`capture`] reads and writes sigrok session files. [`expected`] turns predicted channel states
//! into line edges. [`fit`] aligns one capture with the expected edges, estimates the clock error
//! of the analyser and judges every edge. [`plan`] distributes more lines than an analyser has
//! inputs over several captures, and [`merge`] judges these captures together. [`synthesise`]
//! makes captures from exact edges, with faults, for tests and rehearsals.
//!
//! The crate reads no clock and no file system. Equal inputs give equal results.

pub mod capture;
pub mod expected;
pub mod fit;
pub mod line;
pub mod merge;
pub mod plan;
pub mod synthesise;
