//! Searches: threshold, visible movement, ratio, comfort and maximum of a wearer.
//!
//! Lives here: the declaration of a search, the ascending stair (its detector, with the
//! calculated chance of a false alarm, is `statistics`'), the declared wearers on whom it is judged,
//! and the stair on a device through ordinary requests. Not here: who asks the
//! operator (the program), protocols of trials (`laboratory`).
//! In: a [`SearchDeclaration`] search and a [`Probe`]. Out: a [`Finding`]: value, interval,
//! cost and trail, however far it came.

mod declaration;
mod device;
pub mod judge;
mod milli;
mod plan;
mod stair;

/// Name and text of the searches that are part of the program.
pub const SHIPPED: &[(&str, &str)] =
    &[("finger", include_str!("../../../../searches/finger.toml"))];

pub use declaration::{Kind, Observer, Rating, SearchDeclaration};
pub use device::{DeviceError, OnDevice, Operator, Question};
pub use host_core::statistics::{Detector, Verdict};
pub use milli::Milli;
pub use plan::{Search, SearchFile, Site};
pub use stair::{Answer, Finding, Probe, SearchEnd, Step, search};
