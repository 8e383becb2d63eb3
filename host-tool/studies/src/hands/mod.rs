//! Control laws on hands: forearms that are a mechanism, drawn as the two-point study
//! draws them.
//!
//! Lives here: a drawn hand and what it holds (`drawn`), what its leads do (`leads`),
//! who drives it and what they know (`contender`), one after the other (`campaign`), as
//! tables (`table`). Not here: forearms (`hal_sim::body::hand`), searches for points and
//! voltages (`crate::hamana2022`), lines and laws (`crate::tracking`).
//! In: a seed. Out: errors of laws. All simulated: no evidence about people.

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

/// Why hands cannot be driven.
#[derive(Debug, thiserror::Error)]
pub enum HandsError {
    /// A hand.
    #[error(transparent)]
    Hand(#[from] TwoPointsError),
    /// A law.
    #[error(transparent)]
    Law(#[from] TrackingError),
}
