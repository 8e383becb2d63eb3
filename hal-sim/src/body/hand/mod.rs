//! The multibody forearm and hand model (Hamana 2022): points, currents, nerves and tendons
//! interact, so that the effect of two points together is computed, not configured.
//!
//! Submodules, from the skin inwards: `field` (currents in fat and muscle), `network` (skin, output
//! stages and their current limiter as a circuit), `pools` and `membrane` (motor nerves), `forearm`
//! (combines these three into spikes), `nerve_samples` (when a nerve is checked), `force`, `digits` (angles), `response` (a hand under a
//! periodic stimulus), `moving` (a hand over time), `detail` (how much
//! of it is simulated), `placement` (possible positions of electrodes), `places` (electrodes at many
//! positions of one forearm),
//! `spec`. Voltages, searches and experiments belong to `studies`. Input: the state of each point's
//! terminal over time. Output: torques and angles of five digits. All numbers are simulated; most
//! parameters are assumed, and each says so.

mod detail;
pub mod digits;
pub mod field;
pub mod force;
pub mod forearm;
pub mod membrane;
mod moving;
mod nerve_samples;
pub mod network;
mod placement;
mod places;
pub mod pools;
mod response;
pub mod spec;
#[cfg(test)]
mod tests;

pub use moving::{FittedHand, MovingHand};
pub use placement::PlacementError;
pub use places::Places;
pub use response::{Hand, InvalidHand, Response, Segment};
pub use spec::{HandSpec, Rule, SkinSpec};
