//! Limbs fixed to a bench, whose force a laboratory measures.
//!
//! Lives here: `sensor` (a torque sensor on a lever, as the laboratory reads it),
//! `recruitment` (how many fibres a pulse excites: thresholds are distributed),
//! `generator` (what makes the force of a train of pulses: the calcium-force model, or
//! something of another structure), `wrist` (Lee 2020, figures 4 and 5), `elbow` (Harris
//! 2017, figure 4) with `arms` (moment arms about the elbow, two sources). Not here: the
//! experimenter's filter, fits and detectors (the host's). In: pulses, time, a seed. Out:
//! what the sensor reads at 1 kHz; the truth, for tests and for whoever judges a method.

pub mod arms;
pub mod elbow;
pub mod generator;
pub mod recruitment;
pub mod sensor;
pub mod wrist;

pub use elbow::{CellSide, IsometricElbow, IsometricSpec, RigMuscle};
pub use generator::{Foreign, Generator, Kind};
pub use recruitment::{Pool, StrengthDuration};
pub use sensor::{Sensor, SensorSpec};
pub use wrist::{Wrist, WristSpec};

/// A number of a bench that cannot be; names the field.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("bench: `{0}` is out of range")]
pub struct InvalidBench(pub &'static str);
