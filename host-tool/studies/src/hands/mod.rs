//! Compares control laws on multibody forearm models, generated at random as in the two-point
//! study.
//!
//! Takes a seed and returns the tracking errors of the controllers. `drawn` prepares a random hand,
//! `leads` drives its leads, `contender` holds the controllers and what they know, `campaign` runs
//! all of them on all hands, and `table` formats the result. The forearms are in
//! `hal_sim::body::hand`, the searches for points and voltages in `crate::hamana2022`, transmission
//! lines and control laws in `crate::tracking`. Everything is simulated: this is no evidence about
//! people.

mod campaign;
mod contender;
mod drawn;
mod leads;
pub mod table;

pub use campaign::{Case, Hands, Plan, Score};
pub use contender::{Contender, Outcome, contenders};
pub use drawn::{Actuation, DrivenHand};

use crate::hamana2022::TwoPointsError;
use crate::tracking::TrackingError;

/// Reason why hands cannot be driven.
#[derive(Debug, thiserror::Error)]
pub enum HandsError {
    /// A hand is invalid, or its searches failed.
    #[error(transparent)]
    Hand(#[from] TwoPointsError),
    /// A control law is invalid.
    #[error(transparent)]
    Law(#[from] TrackingError),
}
