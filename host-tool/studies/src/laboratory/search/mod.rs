//! Searches: threshold, visible movement, ratio, comfort and maximum of a wearer.
//!
//! Lives here: the declaration of a search, its detector with the calculated chance
//! operator (the program), protocols of trials (`laboratory`).
//! In: a [`Declared`] search and a [`Probe`]. Out: a [`Finding`]: value, interval,
//! cost and trail, however far it came.

mod declaration;
mod detector;
mod milli;

pub use declaration::{Declared, Kind, Observer, Rating};
pub use detector::{Detector, Verdict};
pub use milli::Milli;
