//! A forearm under many pads.
//!
//! Lives here: `field` (what a current through a pad does in fat and muscle).
//! Not here: nerves, muscles and joints.
//! In: tissue and pads. Out: potentials per ampere.

pub mod field;
