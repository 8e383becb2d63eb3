//! Replicates Lee 2020 on a simulated test rig with known true values: whether the method finds
//! them, and whether the paper's claims hold.
//!
//! Contains the protocol (threshold, placement, fifteen trains), the analysis of its records,
//! simulated wrists with another structure, the same protocol on a device, and the comparison with
//! the paper's tables and figures. The test rig is in `hal_sim::body::bench`, fits and detectors in
//! `host_core::identify`, the command in `cli`. Takes `lee.toml`, committed before the first run, a
//! seed and a number of draws; returns an [`crate::laboratory::Outcome`], `draws.csv` and wearer
//! files. Everything is simulated and no evidence about people.

mod alone;
mod analysis;
mod claims;
mod csv;
mod declaration;
mod device;
mod error;
mod figures;
mod foreign;
mod judged;
mod outcome;
#[allow(clippy::approx_constant)] // printed numbers
mod paper;
mod pools;
mod protocol;
mod quality;
mod run;
mod spread;
mod study;
mod tables;
mod trends;
mod truth;
mod wearer;

pub use alone::ExactWrist;
pub use analysis::{TrainAnalysis, run_analysis};
pub use declaration::{DECLARED, Declaration};
pub use device::OnDevice;
pub use error::LeeError;
pub use foreign::Mismatch;
pub use outcome::RunInfo;
pub use protocol::{Amplitudes, SearchResult, Session, Stimulator, Train};
pub use run::Run;
pub use study::{Part, Study, SubjectReplication, Unit};
pub use truth::Truth;

/// Number of Lee's subjects.
pub const SUBJECTS: usize = 10;

/// Returns the subject's name, K01 to K10; the index counts from 0.
#[must_use]
pub fn name(subject: usize) -> String {
    format!("K{:02}", subject + 1)
}
