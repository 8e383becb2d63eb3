//! Hamana 2022 on a multibody forearm model: which of its claims come out, and in which wearers.
//!
//! Lives here: who is drawn and what is judged (`population.toml`, committed before it was
//! looked at), the paper's patterns, its searches for points and voltages, its trials, and
//! the claims. Not here: the forearm (`hal_sim::body::hand`), the command (`cli`).
//! In: a cell (rule, ground, operating point), a seed. Out: shares of drawn wearers in
//! whom each claim holds. All simulated: no evidence about people.

mod angles;
mod cells;
mod claims;
mod compared;
mod couplings;
mod departure;
mod error;
mod experiments;
mod held;
pub mod paper;
mod participant;
mod pattern;
mod points;
mod population;
mod put_out;
mod replication;
mod row;
mod sessions;
mod study;
mod summary;
mod tracked;
mod trials;
mod voltages;
mod wearers;

pub use cells::{Cells, CellsRun, TWO_POINTS};
pub use claims::{Individuations, PHASES_US, Torques, judge_claims};
pub use compared::compare_with_paper;
pub use departure::Departure;
pub use error::TwoPointsError;
pub use experiments::{Condition, EXPERIMENTS, Experiment, Protocol, StimulationResult};
pub use held::Hold;
pub use participant::{Participant, PrintedResults};
pub use pattern::{PERIOD_US, Pattern, Points, WIDTH_US};
pub use population::{DECLARED, DrawnHand, Population};
pub use put_out::{OutputComparison, driven_v};
pub use replication::{Averages, CONDUCTED, PATTERNS, Replication};
pub use sessions::Session;
pub use study::{Cell, DrawOutcome, KnownThresholds, Numbers, PreparedHand, prepare};
pub use summary::Summary;
pub use tracked::{LAWS, Method, TrialTracking};
pub use trials::{Outcome, Postures, Trials};
pub use voltages::{Voltages, calibrate, search_extensor};
pub use wearers::{Participants, WEARERS, Wearer};
