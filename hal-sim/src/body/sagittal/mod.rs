//! An arm that lifts in the sagittal plane: elbow and shoulder flexion, and eight muscles that a
//! wearer drives voluntarily, four of which lie under electrodes (Buatier de Mongeot 2024).
//!
//! Submodules: `geometry` (moment arms and fibre lengths as functions of the angles, from the
//! published numbers of `arm`), `links` (two rigid segments), `fibres` (response of the fibres
//! under an electrode to pulses), `heat` (power consumption of muscles), `moving` (the simulation
//! over time), `spec`. The wearer's intentions, the lifted object and the device belong to other
//! modules. Input: drives of the muscles, pulses, the force on the hand. Output: angles, position
//! of the hand, torques, energy. Everything is simulated; every number says whether it is sourced
//! or assumed.

mod fibres;
mod geometry;
mod heat;
mod links;
mod moving;
mod spec;

pub use geometry::{ALL, Geometry, LIMITS_DEG, MUSCLES, PostureGeometry};
pub use links::{GRAVITY_M_S2, Links};
pub use moving::{Intent, SagittalArm};
pub use spec::{ELECTRODES, Electrode, InvalidSagittal, SagittalSpec};

/// Number of joints of the model: flexion of elbow and of shoulder.
pub const JOINTS: usize = 2;
/// Index of the elbow among the joints.
pub const ELBOW: usize = 0;
/// Index of the shoulder among the joints.
pub const SHOULDER: usize = 1;
