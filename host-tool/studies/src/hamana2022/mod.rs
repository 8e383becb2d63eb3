//! Repeats Hamana 2022 on a multibody forearm model, to find which of its claims hold, and in which
//! wearers.
//!
//! Takes a cell (recruitment rule, grounding and operating point) and a seed; returns the shares of
//! random wearers for whom each claim holds. The population and the claims were committed before
//! they were run (`host-tool/experiments/hamana-population.toml`). The module contains the paper's
//! patterns, its searches for points and voltages, its trials and the claims. The forearm is in
//! `hal_sim::body::hand`. Everything is simulated: this is no evidence about people.

mod angles;
mod cells;
mod claims;
mod compared;
pub mod conditioning;
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
mod printed;
mod put_out;
mod replication;
mod row;
mod sessions;
mod study;
mod summary;
mod torque_claims;
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
