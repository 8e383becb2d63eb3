//! Searches for a wearer's threshold, visible movement, ratio, comfort and maximum.
//!
//! Contains the declaration of a search, the ascending staircase (its detector, with the calculated
//! probability of a false alarm, is in `statistics`), the simulated wearers on which a search is
//! judged, and the staircase on a device. Asking the operator is the program's task, protocols of
//! trials are in `laboratory`. Takes a [`SearchDeclaration`] and a [`Probe`]; returns a [`Finding`]
//! with value, interval, cost and trail, even if the search ended early.

mod declaration;
mod device;
pub mod judge;
mod milli;
mod plan;
mod stair;

/// Name and text of the built-in searches.
pub const SHIPPED: &[(&str, &str)] =
    &[("finger", include_str!("../../../../searches/finger.toml"))];

pub use declaration::{Kind, Observer, Rating, SearchDeclaration};
pub use device::{DeviceError, OnDevice, Operator, Question};
pub use host_core::statistics::{Detector, Verdict};
pub use milli::Milli;
pub use plan::{Search, SearchFile, Site};
pub use stair::{Answer, Finding, Probe, SearchEnd, Step, search};
