//! A forearm under many pads.
//!
//! Lives here: `field` (what a current through a pad does in fat and muscle), `network`
//! (skin, stages and their limiter as a circuit).
//! Not here: nerves, muscles and joints.
//! In: tissue and pads. Out: potentials per ampere, currents.

pub mod field;
pub mod network;
