//! Test rigs: limbs fixed to an apparatus that measures their force.
//!
//! Submodules: `sensor` (a torque sensor on a lever, as the laboratory reads it), `recruitment`
//! (the share of fibres that a pulse excites, from distributed thresholds), `generator` (force of a
//! train of pulses, from the calcium-force model or one of another structure), `wrist` (Lee 2020,
//! figures 4 and 5), `elbow` (Harris 2017, figure 4) with `arms` (moment arms about the elbow, two
//! sources). The experimenter's filter, fits and detectors belong to the host. Input: pulses, time,
//! a seed. Output: the sensor's samples at 1 kHz, and the true values for tests and for the
//! evaluation of a method.

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

/// Error: the value of a field of a test rig is out of range. Contains the name of the field.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("test rig: `{0}` is out of range")]
pub struct InvalidBench(pub &'static str);
