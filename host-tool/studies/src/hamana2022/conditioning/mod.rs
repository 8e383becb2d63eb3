//! Conditions simulated participants on the voltages that Hamana 2022 prints for them.
//!
//! Takes the declaration `hamana-participants.toml`, a participant and a seed; returns forearms with
//! weights, each with sessions that meet tables 2, 3 and 7 (approximate Bayesian computation).
//! `declaration` and `data` are what is known, `prior` and `mechanism` what is drawn, `forearm` the
//! places for electrodes, `conditioned` judges one forearm (`judged` is the result), `study` many,
//! `outcome` and `weights` summarise; `posterior` is what is shipped, from which `wearer` makes
//! wearers, and `medoid` finds the most typical one. `calibration` tests the procedure where the truth is known (`reference`, `ranks`). The searches are the paper's, in the parent module. Everything is simulated: this is no
//! evidence about people.

mod calibration;
mod conditioned;
mod data;
mod declaration;
mod forearm;
mod information;
mod judged;
mod measurements;
mod mechanism;
mod mechanisms;
mod medoid;
mod outcome;
mod posterior;
mod prior;
mod ranks;
mod reference;
mod run;
mod setup;
mod study;
mod wearer;
mod weights;

pub use calibration::{CALIBRATION, CalibrationStudy};
pub use data::{PrintedVoltages, Table};
pub use declaration::{ClaimKind, DECLARED, Declaration};
pub use judged::{Accepted, Candidate, Effort, JudgedForearm};
pub use mechanism::Mechanism;
pub use medoid::{BEHAVIOUR, behaviour, medoid};
pub use posterior::{AcceptedForearm, Posterior, SHIPPED};
pub use prior::Prior;
pub use setup::{Setup, Solved};
pub use study::{Conditioning, ConditioningStudy, MECHANISMS, PARTICIPANTS};
pub use weights::{WeightSummary, weighted_quantile};
