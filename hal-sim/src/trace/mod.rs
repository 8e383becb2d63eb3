//! Record of a device's output: one format of edges and DAC writes that every simulator writes and
//! every test reads.
//!
//! Contains the record, its edges and pulses, the CSV and VCD files, an independent checker
//! ([`check()`]) of timing, charge, dead time, grounding and group rules, and a [`judge()`] of the
//! effect of the output stages at the electrode. Uses nothing of the `firmware` crate, so that it
//! cannot share a mistake with the scheduler.
//! In: port states and DAC writes at unwrapped microseconds. Out: edges, pulses, files, violations,
//! verdicts.

pub mod check;
mod dump;
mod edges;
mod file;
mod intervals;
pub mod judge;
mod levels;
mod pulses;
mod record;
mod vcd;

pub use check::{Expectation, Group, GroupKind, Limits, Rule, Shape, TrainSpec, Violation, check};
pub use dump::Dump;
pub use edges::{Edge, Edges};
pub use file::{EdgeFileError, read_csv, write_csv};
pub use judge::judge;
pub use levels::{CHANNELS, Levels, State};
pub use pulses::{MAX_GAP_US, Polarity, Pulse};
pub use record::{DacWrite, Trace, TripWrite, Unwrap};
pub use vcd::{Vcd, write_vcd};
