//! Study of which of ten electrodes are needed for a reference force at the hand.
//!
//! Takes a seed and the declaration (`host-tool/experiments/electrode-choice.toml`); returns
//! numbers and matrices of electrodes and directions. `wearer` turns random arms into ten forces at
//! the hand, `sets` computes the error of every set of electrodes, and `outcome` summarises it. The
//! arm is in `hal_sim::body::arm`, the recruitment in `firmware::limb` and `host_core::limb`.
//! Everything is simulated: this is no evidence about people.

mod declaration;
mod outcome;
mod run;
mod sets;
mod wearer;

pub use declaration::{DECLARED, Study};
pub use outcome::{NAME, RunInfo, outcome};
pub use run::Run;
pub use sets::{METHODS, MissedForce, SETS, best, missed_forces, squares};
pub use wearer::{DIRECTION_NAMES, NAMES, Wearer, directions};
