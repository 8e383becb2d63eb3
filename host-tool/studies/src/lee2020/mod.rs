//! Lee 2020 on a bench whose truth is known: does the method find it, and do the paper's
//! claims come out?
//!
//! Lives here: the protocol (threshold, placement, fifteen trains), what becomes of its
//! records, bodies of another structure, the same through a device, and what stands beside
//! the paper's tables and figures. Not here: the bench (`hal_sim::body::bench`), fits and
//! detectors (`host_core::identify`), the command (`cli`). In: `lee.toml`, committed before
//! it was run, a seed, draws. Out: an [`crate::laboratory::Outcome`], `draws.csv`, wearer
//! files. All simulated: no evidence about people.

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

/// Lee's subjects.
pub const SUBJECTS: usize = 10;

/// K01 to K10, from 0 on.
#[must_use]
pub fn name(subject: usize) -> String {
    format!("K{:02}", subject + 1)
}
