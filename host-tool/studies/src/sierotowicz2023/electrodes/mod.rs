//! Which of ten electrodes serve a wanted force at the hand?
//!
//! Lives here: what was declared (`host-tool/experiments/electrode-choice.toml`), drawn wearers as ten
//! forces at the hand (`wearer`), what every set of electrodes misses (`sets`), what that
//! comes to (`outcome`). Not here: the body (`hal_sim::body::arm`), how muscles are recruited
//! (`firmware::limb`, `host_core::limb`), the command (`cli`). In: a seed. Out: numbers and a
//! matrix of electrodes and directions. All simulated: no evidence about people.

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
