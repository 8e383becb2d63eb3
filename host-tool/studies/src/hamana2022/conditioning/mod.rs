//! Conditions simulated participants on the voltages that Hamana 2022 prints for them.
//!
//! Takes the declaration `hamana-participants.toml`, a participant and a seed; returns forearms with
//! weights, each with sessions that meet tables 2, 3 and 7 (approximate Bayesian computation).
//! `declaration` and `data` are what is known, `prior` and `mechanism` what is drawn, `forearm` the
//! places for electrodes, `conditioned` judges one forearm, `study` many, `outcome` and `weights`
//! summarise. The searches are the paper's, in the parent module. Everything is simulated: this is
//! no evidence about people.

mod conditioned;
mod data;
mod declaration;
mod forearm;
mod mechanism;
mod outcome;
mod prior;
mod study;
mod weights;

pub use conditioned::{Candidate, JudgedForearm, Setup, Solved};
pub use data::{PrintedVoltages, Table};
pub use declaration::{DECLARED, Declaration};
pub use mechanism::Mechanism;
pub use prior::Prior;
pub use study::{ConditioningStudy, MECHANISMS, PARTICIPANTS};
pub use weights::{WeightSummary, weighted_quantile};
