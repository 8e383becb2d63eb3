//! Searches for a wearer's threshold, visible movement, ratio, comfort and maximum.
//!
//! Contains the declaration of a search, the ascending staircase (its detector, with the calculated
//! probability of a false alarm, is in `statistics`), the staircase on a device, and the report of
//! a search. The simulated wearers on which searches are judged are in the studies; asking the
//! operator is the program's task. Takes a search file and a port; returns a [`Finding`] with value,
//! interval, cost and trail, even if the search ended early.

mod declaration;
mod device;
mod error;
mod file;
mod milli;
mod plan;
mod report;
mod stair;

/// Name and text of the built-in searches.
pub const SHIPPED: &[(&str, &str)] = &[("finger", include_str!("../../../searches/finger.toml"))];

pub use crate::statistics::{Detector, Verdict};
pub use declaration::{Kind, Observer, Rating, SearchDeclaration};
pub use device::{DeviceError, OnDevice, Operator, Question};
pub use error::SearchError;
pub use file::SearchFile;
pub use milli::Milli;
pub use plan::{Search, Site};
pub use report::{PART, level_unit, report};
pub use stair::{Answer, Finding, Probe, SearchEnd, Step, search};
