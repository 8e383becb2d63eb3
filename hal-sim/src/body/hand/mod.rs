//! A forearm and hand in which points, currents, nerves and tendons are a mechanism
//! (Hamana 2022): what two points do is computed, nowhere typed in.
//!
//! Lives here, from the skin inwards: `field` (currents in fat and muscle), `network`
//! (skin, stages and their limiter as a circuit), `pools` and `membrane` (motor nerves),
//! `forearm` (all three: spikes), `force`, `digits` (angles), `response` (a hand under a
//! repeated period), `moving` (one in time), `placement` (where electrodes can lie),
//! `spec`. Not here: which voltages, searches and experiments (`studies`).
//! In: what each point's terminal is, for how long. Out: torques and angles of five
//! digits. All numbers are simulated; most parameters are assumed, each says so.

pub mod digits;
pub mod field;
pub mod force;
pub mod forearm;
pub mod membrane;
mod moving;
pub mod network;
mod placement;
pub mod pools;
mod response;
pub mod spec;
#[cfg(test)]
mod tests;

pub use moving::{FittedHand, MovingHand};
pub use placement::PlacementError;
pub use response::{Hand, InvalidHand, Response, Segment};
pub use spec::{HandSpec, Rule, SkinSpec};
